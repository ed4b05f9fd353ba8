# %% Ten lines: removes the moving points of the street of README.md, or of your own recording.
import dynains

scans = list(dynains.Recording("build/street"))
remover = dynains.DynaInsRemover()
frames = [remover.push(scan.points, scan.T_world_sensor, scan.time) for scan in scans]
verdicts = [frame.finished for frame in frames if frame.finished] + remover.flush()
kept = [dynains.is_static(verdict.labels) for verdict in verdicts]
rows = dynains.evaluate(*zip(*((s.points, s.T_world_sensor, s.labels) for s in scans)), kept)
print("map:", remover.map_points().shape, {k: round(v, 3) for k, v in rows["estimate"].items()})
