# %% A crowd in ten lines: removes the moving points of a simulated street.
import dynains

street = dynains.Simulator("crowd", "os1-64", scans=20)  # or your own arrays
remover = dynains.DynaInsRemover()
scans = list(street)
frames = [remover.push(scan.points, scan.T_world_sensor, scan.time) for scan in scans]
verdicts = [frame.finished for frame in frames if frame.finished] + remover.flush()
kept = [dynains.is_static(verdict.labels) for verdict in verdicts]
rows = dynains.evaluate(*zip(*((s.points, s.T_world_sensor, s.labels) for s in scans)), kept)
print("map:", remover.map_points().shape, {k: round(v, 3) for k, v in rows["estimate"].items()})
