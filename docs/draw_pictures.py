"""Draws the pictures of these pages from recordings that it simulates, by NumPy and matplotlib:

    python3 docs/draw_pictures.py --bin build/bin --work WORK            # all but those of real scans
    python3 docs/draw_pictures.py --bin build/bin --work WORK beam belief
    python3 docs/draw_pictures.py --bin build/bin --work WORK --real SEQ real

WORK keeps recordings and results. `page` needs chromium. SEQ is a labelled recording.
"""
import argparse
import pathlib
import shutil
import subprocess

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from PIL import Image

STATIC, MOVING, MISSED, LOST = "#8a8a8a", "#1f9e3f", "#d7191c", "#ff8c00"
GROUND = 1  # dynains::Cause::kGround
MARGIN, MARGIN_SLOPE = 0.25, 0.0075  # defaults of docs/parameters.md


class Recording:
    """A labelled sequence in the layout of KITTI, and the results of `dynains run` on it."""

    def __init__(self, sequence, results):
        self.sequence, self.results = pathlib.Path(sequence), pathlib.Path(results)
        self.names = sorted(file.stem for file in (self.sequence / "velodyne").glob("*.bin"))
        lines = (self.sequence / "calib.txt").read_text().splitlines()
        T_camera_sensor = self._matrix(next(line for line in lines if line.startswith("Tr")).split()[1:])
        rows = (self.sequence / "poses.txt").read_text().split("\n")
        self.T_world_sensor = [
            np.linalg.inv(T_camera_sensor) @ self._matrix(row.split()) @ T_camera_sensor
            for row in rows if row.strip()
        ]

    @staticmethod
    def _matrix(numbers):
        return np.vstack([np.array(numbers, float).reshape(3, 4), [0, 0, 0, 1]])

    def __len__(self):
        return len(self.names)

    def points(self, k):
        """x y z, m, sensor frame."""
        file = self.sequence / "velodyne" / f"{self.names[k]}.bin"
        return np.fromfile(file, np.float32).reshape(-1, 4)[:, :3].astype(float)

    def in_world(self, k):
        T = self.T_world_sensor[k]
        return self.points(k) @ T[:3, :3].T + T[:3, 3]

    def truth(self, k):
        """Whether each point moves, and its instance."""
        labels = np.fromfile(self.sequence / "labels" / f"{self.names[k]}.label", np.uint32)
        return (labels & 0xFFFF) > 250, labels >> 16

    def verdict(self, k, folder="labels"):
        """Whether each point was removed, and its instance."""
        labels = np.fromfile(self.results / folder / f"{self.names[k]}.label", np.uint32)
        return (labels & 0xFFFF) == 251, labels >> 16

    def causes(self, k):
        return np.fromfile(self.results / "causes" / f"{self.names[k]}.cause", np.uint8)

    def beliefs(self, k):
        return np.fromfile(self.results / "beliefs" / f"{self.names[k]}.belief", np.uint8) / 255.0


class Workshop:
    """Runs the program once for each recording."""

    def __init__(self, programs, work, out, real):
        self.programs, self.work, self.out = map(pathlib.Path, (programs, work, out))
        self.real = real
        for folder in (self.work, self.out):
            folder.mkdir(parents=True, exist_ok=True)

    def call(self, *command):
        subprocess.run([str(word) for word in command], check=True, stdout=subprocess.DEVNULL,
                       stderr=subprocess.DEVNULL)

    def dynains(self, *arguments):
        self.call(self.programs / "dynains", *arguments)

    def simulate(self, name, *flags):
        sequence = self.work / name
        if not sequence.exists():
            command = [self.programs / "dynains_simulate"]
            self.call(*command, sequence, "--labelling", "instant", *flags)
        return sequence

    def run(self, sequence, name, *flags):
        results = self.work / (name + "_results")
        if not results.exists():
            self.dynains("run", sequence, "--out", results, "--write-beliefs", "--write-online", *flags)
        return Recording(sequence, results)

    def street(self):
        return self.run(self.simulate("street"), "street", "--passes", "2", "--view")

    def drive(self):
        """The recording of the tutorial, as a folder."""
        sequence = self.simulate("drive", "--sensor", "hdl32", "--scans", "200", "--seed", "5")
        return self.run(sequence, "drive", "--passes", "2")

    def save(self, figure, name):
        path = self.out / f"{name}.png"
        figure.savefig(path, dpi=100, bbox_inches="tight", pad_inches=0.08)
        plt.close(figure)
        reduce_colours(path)


def reduce_colours(path, colours=128):
    """A palette divides the size of a picture by three."""
    picture = Image.open(path).convert("RGB")
    palette = picture.quantize(colours, Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE)
    palette.save(path, optimize=True)
    print(f"{path}: {path.stat().st_size // 1000} kB")


def from_above(axes, points, colour, size=0.3, half_width=32.0):
    axes.scatter(points[:, 0], points[:, 1], s=size, c=colour, linewidths=0, rasterized=True)
    axes.set(xlim=(-half_width, half_width), ylim=(-half_width * 0.6, half_width * 0.6), xticks=[],
             yticks=[], aspect="equal")


STAGES = (("ingest", "points, pose, time"), ("ground", "ground | others"), ("window", "K scans"),
          ("cluster", "instances"), ("motion", "aligned pose"), ("evidence", "free, hit, beliefs"),
          ("judge", "causes"), ("verdict", "labels"), ("map", "static points"))


def draw_stages(axes):
    """Boxes with the stages, and the data that each passes on below."""
    axes.set(xlim=(-0.5, len(STAGES) - 0.5), ylim=(0, 1))
    axes.axis("off")
    for i, (stage, data) in enumerate(STAGES):
        axes.text(i, 0.7, stage, ha="center", va="center", fontsize=9,
                  bbox={"boxstyle": "round,pad=0.35", "facecolor": "#e6eefb", "edgecolor": "#1f4e9e"})
        axes.text(i, 0.15, data, ha="center", va="center", fontsize=7.5, style="italic")
        if i > 0:
            axes.annotate("", xy=(i - 0.36, 0.7), xytext=(i - 0.64, 0.7),
                          arrowprops={"arrowstyle": "->"})


def draw_pipeline(workshop):
    """The stages, and one scan after six of them, from above."""
    recording, k = workshop.street(), 60
    points, causes, beliefs = recording.points(k), recording.causes(k), recording.beliefs(k)
    removed, instances = recording.verdict(k)
    is_ground, clustered = causes == GROUND, instances > 0
    figure = plt.figure(figsize=(10.2, 5.6))
    grid = figure.add_gridspec(3, 3, height_ratios=(0.42, 1, 1))
    draw_stages(figure.add_subplot(grid[0, :]))
    axes = [figure.add_subplot(grid[1 + i // 3, i % 3]) for i in range(6)]
    from_above(axes[0], points, plt.cm.viridis(np.clip((points[:, 2] + 2) / 4, 0, 1)), 0.15)
    from_above(axes[1], points[is_ground], "#d8c9a3", 0.15)
    from_above(axes[1], points[~is_ground], "#3b5b92")
    from_above(axes[2], points[clustered], plt.cm.tab20((instances[clustered] * 7) % 20))
    order = np.argsort(beliefs[clustered])
    from_above(axes[3], points[clustered][order], plt.cm.coolwarm(beliefs[clustered][order]))
    from_above(axes[4], points[~removed & ~is_ground], STATIC)
    from_above(axes[4], points[removed], MOVING)
    static = [recording.in_world(i)[~recording.verdict(i)[0]][::3] for i in range(k - 20, k + 21, 2)]
    centre = recording.T_world_sensor[k]
    local = (np.concatenate(static) - centre[:3, 3]) @ centre[:3, :3]
    from_above(axes[5], local, plt.cm.viridis(np.clip((local[:, 2] + 2) / 4, 0, 1)), 0.1)
    titles = ("ingest: one scan by height", "ground: tan", "cluster: one colour per instance",
              "evidence: belief, grey 0.5, red 1", "verdict: moving points green",
              "map: static points by height")
    for panel, title in zip(axes, titles):
        panel.set_title(title, fontsize=9)
    figure.tight_layout(pad=0.4)
    workshop.save(figure, "pipeline")


def beams_near(recording, reference, target, half_width):
    """Beams of a scan whose direction passes a point of the world at a small distance: range,
    lateral and vertical offset at the range of the point (m), and the range of the point."""
    T = recording.T_world_sensor[reference]
    point = (target - T[:3, 3]) @ T[:3, :3]
    returns = recording.points(reference)
    ranges = np.linalg.norm(returns, axis=1)
    distance = np.linalg.norm(point)
    forward = point / distance
    side = np.cross([0, 0, 1], forward)
    side /= np.linalg.norm(side)
    up = np.cross(forward, side)
    directions = returns / ranges[:, None]
    lateral, vertical = distance * directions @ side, distance * directions @ up
    near = (directions @ forward > 0) & (np.abs(lateral) < half_width) & (np.abs(vertical) < 0.5)
    nearest_row = vertical[near][np.argmin(np.hypot(lateral[near], vertical[near]))] if near.any() else 0
    near &= np.abs(vertical - nearest_row) < 0.12  # one row of beams
    return ranges[near], lateral[near], distance


def find_sample(recording, half_width):
    """A point of a moving vehicle, and references that see it free, hit it and are occluded."""
    random = np.random.default_rng(1)
    for k in range(40, len(recording) - 40, 5):
        moves, instances = recording.truth(k)
        points = recording.points(k)
        candidates = np.flatnonzero(moves & (points[:, 2] > -1.2) &
                                    (np.linalg.norm(points, axis=1) < 25))
        for i in random.permutation(candidates)[:40]:
            target = recording.in_world(k)[i]
            found = {}
            for lag in (-30, -20, -10, -4, -2, 2, 4, 10, 20, 30):
                ranges, lateral, distance = beams_near(recording, k + lag, target, half_width)
                margin = MARGIN + MARGIN_SLOPE * distance
                if len(ranges) < 12 or not 8 < distance < 30:
                    continue
                middle = ranges[np.abs(lateral) < 0.15]
                if len(middle) < 2:
                    continue
                if middle.min() > distance + 3 and ranges.max() < distance + 25:
                    found.setdefault("free", lag)
                elif np.all(np.abs(middle - distance) < margin):
                    found.setdefault("hit", lag)
                elif middle.max() < distance - 2:
                    found.setdefault("unknown", lag)
            if len(found) == 3:
                return k, target, found
    raise SystemExit("no sample is seen in all three ways")


def draw_beam(workshop):
    """One sample, and the beams of three references near it."""
    recording, half_width = workshop.street(), 0.8
    k, target, found = find_sample(recording, half_width)
    figure, axes = plt.subplots(1, 3, figsize=(10.2, 3.3), sharey=True)
    words = {"free": "the beams end behind the sample", "hit": "they end within the margin",
             "unknown": "they end in front of it"}
    for panel, name in zip(axes, ("free", "hit", "unknown")):
        ranges, lateral, distance = beams_near(recording, k + found[name], target, half_width)
        margin = MARGIN + MARGIN_SLOPE * distance
        begin, end = min(distance - 2, ranges.min() - 1), max(distance + 4, ranges.max() + 1)
        # A beam reaches its lateral offset at the range of the sample: lines fan out slightly.
        for length, offset in zip(ranges, lateral):
            panel.plot([begin, length], [offset * begin / distance, offset * length / distance],
                       color="#9db7d9", linewidth=0.8)
        panel.plot(ranges, lateral * ranges / distance, ".", color="#1f4e9e", markersize=4)
        panel.axvspan(distance - margin, distance + margin, color="#f3c969", alpha=0.6, linewidth=0)
        panel.plot(distance, 0, "o", color=MISSED, markersize=7)
        when = f"{abs(found[name])} scans {'later' if found[name] > 0 else 'earlier'}"
        panel.set(title=f"{name}: {words[name]}\n({when})", xlabel="range from the reference, m",
                  xlim=(begin, end))
        panel.title.set_fontsize(9)
    axes[0].set_ylabel("lateral distance, m")
    figure.tight_layout(pad=0.4)
    workshop.save(figure, "beam")


WAITING_CAR = 7  # instance of the simulated queue: it stands for 7.8 s, then it leaves


def draw_belief(workshop):
    """A car that waits and drives: its way, its belief, and the verdicts on it."""
    sequence = workshop.simulate("stop_and_go", "--scene", "stop-and-go", "--scans", "120", "--seed", "3")
    recording = workshop.run(sequence, "stop_and_go")
    chosen, moves, centres = {}, [], []
    for k in range(len(recording)):
        moving, instances = recording.truth(k)
        chosen[k] = np.flatnonzero(instances == WAITING_CAR)
        moves.append(moving[chosen[k][0]])
        centres.append(recording.in_world(k)[chosen[k]].mean(axis=0)[:2])
    scans = np.array(sorted(chosen))
    times, moves = 0.1 * scans, np.array(moves)
    steps = np.linalg.norm(np.diff(centres, axis=0), axis=1)
    driven = np.concatenate([[0], np.cumsum(np.where(moves[1:], steps, 0))])
    def mean_of(values_of):
        return np.array([np.mean(values_of(k)[chosen[k]]) for k in scans])
    figure, axes = plt.subplots(3, 1, figsize=(8.6, 4.6), sharex=True)
    axes[0].plot(times, driven, color="black")
    axes[0].set_ylabel("driven, m")
    axes[1].plot(times, mean_of(recording.beliefs), color=MISSED)
    axes[1].axhline(0.65, color="black", linewidth=0.8, linestyle=":")
    axes[1].text(0, 0.67, "tau_free", fontsize=8)
    axes[1].set(ylabel="belief", ylim=(0.45, 1.02))
    for folder, colour, label in (("labels", MOVING, "final"), ("online", "#1f4e9e", "zero latency")):
        removed = 100 * mean_of(lambda k: recording.verdict(k, folder)[0])
        axes[2].plot(times, removed, color=colour, label=label)
    axes[2].set(ylabel="removed, %", xlabel="time of the scan, s")
    axes[2].legend(fontsize=8, loc="center left")
    for panel in axes:
        panel.fill_between(times, 0, 1, where=moves, transform=panel.get_xaxis_transform(),
                           color="#cfe8cf", linewidth=0)
    axes[0].text(times[moves][0], driven.max(), " the car drives", va="top", fontsize=8)
    figure.align_ylabels()
    figure.tight_layout(pad=0.4)
    workshop.save(figure, "belief")


def draw_errors(workshop):
    """A crowd from above: what was removed, missed and lost."""
    sequence = workshop.simulate("crowd", "--scene", "crowd", "--sensor", "os1-64", "--scans", "80",
                                 "--seed", "3")
    recording = workshop.run(sequence, "crowd")
    parts = {"kept static": [], "removed moving": [], "lost static": [], "missed moving": []}
    for k in range(0, len(recording), 4):
        world, moves, removed = recording.in_world(k), recording.truth(k)[0], recording.verdict(k)[0]
        for name, mask in (("kept static", ~moves & ~removed), ("removed moving", moves & removed),
                           ("lost static", ~moves & removed), ("missed moving", moves & ~removed)):
            parts[name].append(world[mask])
    figure, axes = plt.subplots(figsize=(9, 4.6))
    centre = recording.T_world_sensor[len(recording) // 2][:3, 3]
    for (name, points), colour in zip(parts.items(), (STATIC, MOVING, LOST, MISSED)):
        points = np.concatenate(points) - centre
        if name == "kept static":
            points = points[::6]
        axes.scatter(points[:, 0], points[:, 1], s=0.6, c=colour, linewidths=0, label=name)
    axes.set(xlim=(-45, 45), ylim=(-22, 22), aspect="equal", xlabel="x, m", ylabel="y, m")
    axes.legend(loc="upper right", markerscale=8, fontsize=8)
    workshop.save(figure, "errors")


def draw_before_and_after(workshop, recording, name, half_width, step, every):
    figure, axes = plt.subplots(1, 2, figsize=(10.2, 3.4))
    centre = recording.T_world_sensor[len(recording) // 2]
    for k in range(0, len(recording), step):
        local = ((recording.in_world(k) - centre[:3, 3]) @ centre[:3, :3])[::every]
        removed = recording.verdict(k)[0][::every]
        is_ground = (recording.causes(k) == GROUND)[::every]
        for panel in axes:
            from_above(panel, local[~removed & is_ground], "#dddddd", 0.1, half_width)
            from_above(panel, local[~removed & ~is_ground], "#555555", 0.25, half_width)
        from_above(axes[0], local[removed], MISSED, 0.4, half_width)
    axes[0].set_title("all points, moving ones red", fontsize=9)
    axes[1].set_title("static points", fontsize=9)
    figure.tight_layout(pad=0.4)
    workshop.save(figure, name)


def draw_map(workshop):
    draw_before_and_after(workshop, workshop.drive(), "map", 45, 3, 2)


def draw_real(workshop):
    """Any real recording, before and after."""
    recording = workshop.run(pathlib.Path(workshop.real), "real")
    draw_before_and_after(workshop, recording, "real", 45, 2, 2)


def draw_page(workshop):
    """The page of a run, by a browser."""
    page = workshop.street().results / "view.html"
    browser = shutil.which("chromium") or shutil.which("chromium-browser")
    path = (workshop.out / "page.png").resolve()
    workshop.call(browser, "--headless", "--no-sandbox", "--use-angle=swiftshader",
                  "--enable-unsafe-swiftshader", "--window-size=900,450", "--hide-scrollbars",
                  "--virtual-time-budget=20000", f"--screenshot={path}", page.resolve().as_uri())
    reduce_colours(path, 48)


def draw_grid(workshop):
    """The occupancy grid of a street, of all points and without moving ones."""
    results = workshop.street().results
    figure, axes = plt.subplots(1, 2, figsize=(10.2, 3.2))
    for panel, name, flags in ((axes[0], "all points", ["--keep-moving"]), (axes[1], "static points", [])):
        file = workshop.work / f"grid_{len(flags)}.yaml"
        workshop.dynains("grid", results, "--out", file, "--resolution", "0.1", "--force", "-q", *flags)
        image = np.array(Image.open(file.with_suffix(".pgm")))
        height, width = image.shape
        middle = image[height // 4:3 * height // 4, width // 8:3 * width // 4]
        panel.imshow(middle, cmap="gray", interpolation="none")
        panel.set_title(name, fontsize=9)
        panel.axis("off")
    figure.tight_layout(pad=0.4)
    workshop.save(figure, "grid")


def main():
    drawings = {"pipeline": draw_pipeline, "beam": draw_beam, "belief": draw_belief,
                "errors": draw_errors, "map": draw_map, "grid": draw_grid, "page": draw_page, "real": draw_real}
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bin", required=True, help="folder of the programs")
    parser.add_argument("--work", required=True, help="folder for recordings and results")
    parser.add_argument("--out", default=pathlib.Path(__file__).parent / "pictures",
                        help="folder for the pictures [docs/pictures]")
    parser.add_argument("--real", help="a labelled recording for the drawing `real`")
    parser.add_argument("names", nargs="*", help=", ".join(drawings))
    arguments = parser.parse_args()
    workshop = Workshop(arguments.bin, arguments.work, arguments.out, arguments.real)
    for name in arguments.names or [name for name in drawings if name != "real"]:
        drawings[name](workshop)


main()
