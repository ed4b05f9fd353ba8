"""Draws Fig. 5 and Fig. 7 of the paper from the tables of `dynains experiment`, by matplotlib:

    dynains experiment sweep SEQ --csv sweep.csv
    dynains experiment runtime SEQ --csv runtime.csv
    python3 draw_experiments.py sweep.csv runtime.csv     # writes sweep.png and runtime.png
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


def draw_runtime(path):
    """Fig. 7: mean time of each component, with a line up to its 95th percentile."""
    table = columns_of(path)
    figure, axes = plt.subplots()
    above = [max(0, p95 - mean) for mean, p95 in zip(table["mean_ms"], table["p95_ms"])]
    axes.barh(table["component"], table["mean_ms"], xerr=[[0] * len(above), above])
    axes.invert_yaxis()
    axes.set(xlabel="ms per scan")
    return figure


for path in sys.argv[1:]:
    with open(path) as file:
        is_runtime = file.readline().startswith("component,")
    draw = draw_runtime if is_runtime else draw_sweep
    draw(path).savefig(path.removesuffix(".csv") + ".png", bbox_inches="tight", dpi=150)
