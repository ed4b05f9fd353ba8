"""Draws Fig. 5 and Fig. 7 of the paper from tables of `dynains`, by matplotlib:

    dynains experiment sweep SEQ --csv sweep.csv
    dynains run SEQ --out OUT --preset paper --one-thread
    python3 draw_experiments.py sweep.csv OUT/timing.csv  # writes sweep.png and OUT/timing.png
"""
import csv
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt


def columns_of(path):
    """The columns of a table, by name; what is no number stays a text."""
    with open(path, newline="") as file:
        rows = list(csv.DictReader(file))
    columns = {name: [row[name] for row in rows] for name in rows[0]}
    for name, values in columns.items():
        try:
            columns[name] = [float(value or "nan") for value in values]
        except ValueError:
            pass
    return columns


def draw_sweep(path):
    """Fig. 5: PR, RR and F1 (%) against the parameter in the first column."""
    table = columns_of(path)
    parameter = next(iter(table))
    figure, axes = plt.subplots()
    for name, scale in (("pr", 1), ("rr", 1), ("f1", 100)):
        axes.plot(table[parameter], [scale * value for value in table[name]], "o-", label=name.upper())
    axes.set(xlabel=parameter, ylabel="%")
    axes.legend()
    return figure


def draw_timing(path):
    """Fig. 7: mean time of each stage, with a line up to its 95th percentile."""
    times = {name: values for name, values in columns_of(path).items() if name.endswith("_ms")}
    figure, axes = plt.subplots()
    means = [sum(values) / len(values) for values in times.values()]
    p95 = [sorted(values)[(95 * len(values) - 1) // 100] for values in times.values()]
    above = [max(0, high - mean) for high, mean in zip(p95, means)]
    axes.barh([name.removesuffix("_ms") for name in times], means, xerr=[[0] * len(above), above])
    axes.invert_yaxis()
    axes.set(xlabel="ms per scan")
    return figure


for path in sys.argv[1:]:
    with open(path) as file:
        is_timing = file.readline().startswith("scan,")
    draw = draw_timing if is_timing else draw_sweep
    draw(path).savefig(path.removesuffix(".csv") + ".png", bbox_inches="tight", dpi=150)
