"""The paper's experiments, by `dynains run` and `dynains eval`:

    paper_experiments.py table1 ROOT    Table I, beside published scores; ROOT is SemanticKITTI (the
                                        published windows of 00, 01, 02, 05, 07), or one recording
    paper_experiments.py sweep SEQ      Fig. 5: scores against a parameter, by default tau-s
    paper_experiments.py runtime SEQ    Fig. 7: milliseconds per component; needs no labels

Recordings have labels of SemanticKITTI. Further flags go to both programs, such as --start and --end,
or --poses. Each experiment writes NAME.csv, and for Fig. 5 and Fig. 7 also NAME.png, if matplotlib is
there.
"""
import argparse
import csv
import json
import statistics
import subprocess
import tempfile
from pathlib import Path

# Table I: scans, and PR (%), RR (%) and F1 by method.
WINDOWS = {"00": (4390, 4530), "01": (150, 250), "02": (860, 950), "05": (2350, 2670), "07": (630, 820)}
PUBLISHED = {
    "00": {
        "OctoMap": (34.568, 99.979, 0.514),
        "Removert": (85.502, 99.354, 0.919),
        "ERASOR": (93.980, 97.081, 0.955),
        "DynamicFilter": (90.070, 91.090, 0.906),
        "paper, IOC only": (97.973, 97.540, 0.977),
        "paper, full": (98.067, 96.679, 0.974),
    },
    "01": {
        "OctoMap": (20.777, 99.863, 0.344),
        "Removert": (94.221, 93.608, 0.939),
        "ERASOR": (91.487, 95.383, 0.934),
        "DynamicFilter": (87.950, 87.690, 0.878),
        "paper, IOC only": (89.498, 84.663, 0.870),
        "paper, full": (99.262, 87.188, 0.928),
    },
    "02": {
        "OctoMap": (23.746, 99.792, 0.384),
        "Removert": (76.319, 96.799, 0.853),
        "ERASOR": (87.731, 97.008, 0.921),
        "DynamicFilter": (88.020, 86.100, 0.871),
        "paper, IOC only": (99.015, 98.672, 0.988),
        "paper, full": (99.085, 98.716, 0.989),
    },
    "05": {
        "OctoMap": (33.904, 99.882, 0.506),
        "Removert": (86.900, 87.880, 0.874),
        "ERASOR": (88.730, 98.262, 0.933),
        "DynamicFilter": (90.170, 84.650, 0.873),
        "paper, IOC only": (97.909, 96.373, 0.971),
        "paper, full": (98.021, 96.015, 0.970),
    },
    "07": {
        "OctoMap": (38.183, 99.565, 0.552),
        "Removert": (80.689, 98.822, 0.888),
        "ERASOR": (90.624, 99.271, 0.948),
        "DynamicFilter": (87.940, 86.800, 0.874),
        "paper, IOC only": (92.084, 95.187, 0.936),
        "paper, full": (92.165, 95.187, 0.936),
    },
}
VARIANTS = {
    "dynains, paper preset, IOC only": ["--preset", "paper", "--use-belief", "false"],
    "dynains, paper preset, full": ["--preset", "paper"],
    "dynains, default preset": [],
}


def dynains(*words):
    subprocess.run([options.program, *map(str, words)], check=True, stdout=subprocess.DEVNULL)


def scores_of(recording, window, unlabeled, variants):
    """Runs over a recording under the flags of each variant; scores by name of row."""
    rows = {}
    for name, flags in variants.items():
        with tempfile.TemporaryDirectory() as folder:
            out, scores = Path(folder) / "out", Path(folder) / "scores.json"
            dynains("run", recording, "--out", out, "--accept-poses", "-q", *window, *flags, *further)
            dynains("eval", recording, out, "--unlabeled", unlabeled, "--json", scores, *further)
            rows.update((row["name"], row) for row in json.loads(scores.read_text())["rows"])
            rows[name] = rows.pop("run")
    return rows


def table1():
    yield "sequence", "method", "pr", "rr", "f1", "source"
    folders = [options.recording / below for below in ("sequences", "dataset/sequences", ".")]
    places = [(name, folder / name) for folder in folders for name in WINDOWS]
    found = {name: place for name, place in places if (place / "velodyne").exists()}
    for name, recording in sorted(found.items()) or [(options.recording.name, options.recording)]:
        for method, scores in PUBLISHED.get(name, {}).items():
            yield name, f"{method} (published)", *scores, "published"
        window = ["--start", WINDOWS[name][0], "--end", WINDOWS[name][1]] if name in found else []
        for method, row in scores_of(recording, window, "static", VARIANTS).items():
            yield name, method, *(row["voxels"][score] for score in ("pr", "rr", "f1")), "measured"


def sweep():
    yield options.parameter, "pr", "rr", "f1", "sa", "da", "ha"
    variants = {
        value: ["--preset", "paper", f"--{options.parameter}", value] for value in options.values.split(",")
    }
    rows = scores_of(options.recording, [], "ignore", variants)
    for value in variants:
        scores = {**rows[value]["voxels"], **rows[value]["points"]}
        yield value, *(scores[name] for name in ("pr", "rr", "f1", "sa", "da", "ha"))


def runtime():
    yield "component", "mean_ms", "median_ms", "p95_ms", "max_ms"
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "out"
        flags = ["--preset", "paper", "--accept-poses", "--one-thread", "-q"]
        dynains("run", options.recording, "--out", out, *flags, *further)
        scans = list(csv.DictReader((out / "timing.csv").read_text().splitlines()))
    for column in (name for name in scans[0] if name.endswith("_ms")):
        times = sorted(float(scan[column]) for scan in scans)
        high = times[round(0.95 * (len(times) - 1))]
        yield column[: -len("_ms")], statistics.mean(times), statistics.median(times), high, times[-1]


def draw(rows):
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots()
    names, columns = rows[0], list(zip(*rows[1:]))
    if options.experiment == "sweep":
        for name, column, scale in zip(names[1:4], columns[1:4], (1, 1, 100)):
            scores = [scale * value for value in column]
            axes.plot(list(map(float, columns[0])), scores, "o-", label=name.upper())
        axes.set(xlabel=names[0], ylabel="%")
        axes.legend()
    else:
        above = [max(0, high - mean) for mean, high in zip(columns[1], columns[3])]
        axes.barh(columns[0], columns[1], xerr=[[0] * len(above), above])
        axes.invert_yaxis()
        axes.set(xlabel="ms per scan, to the 95th percentile")
    figure.savefig(f"{options.experiment}.png", bbox_inches="tight", dpi=150)


parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("experiment", choices=["table1", "sweep", "runtime"])
parser.add_argument("recording", type=Path)
parser.add_argument("--parameter", default="tau-s", help="of sweep")
parser.add_argument("--values", default="0.1,0.2,0.3,0.4,0.5,0.6,0.7,0.8,0.9", help="of sweep")
parser.add_argument("--program", default="dynains", help="[dynains of PATH]")
options, further = parser.parse_known_args()

table = []
with open(f"{options.experiment}.csv", "w", newline="") as file:
    for row in globals()[options.experiment]():
        table.append(row)
        csv.writer(file).writerow(row)
        print(*(f"{value:.4f}" if isinstance(value, float) else value for value in row), sep="\t")
if options.experiment != "table1":
    try:
        draw(table)
    except ImportError as error:
        print(f"no picture: {error}")
