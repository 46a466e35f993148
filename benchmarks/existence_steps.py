"""Steps of "does any box meet this volume?" by nested segment and range trees, fitted as c log2(n)^3.

    python benchmarks/existence_steps.py [--largest 100000] [--report FOLDER]

The fit takes the sizes up to 1e4; the last row is predicted by it.  The bound is one on the worst case, so that the
table has the most steps of 1,000 volumes whose sides lie at ends of boxes: in x and y both sides are looked for on
every level, and in z they lie beyond all boxes, where no early answer ends the search.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import numpy.typing as npt
from tabulate import tabulate

from relmodel.find.indexes import RangeTree

Floats = npt.NDArray[np.float64]
FITTED = (1000, 2000, 5000, 10_000)


def boxes_of(case: str, count: int, rng: np.random.Generator) -> Floats:
    if case == "clustered":
        clusters = rng.uniform(-20000, 20000, (30, 3))
        centre = rng.choice(clusters, count) + rng.normal(0, 400, (count, 3))
        half = rng.lognormal(2, 1, (count, 3))
    elif case == "nested":
        centre = np.zeros((count, 3))
        half = np.linspace(1, 1000, count)[:, None] * np.ones(3)
    elif case == "sliced":  # plates, one behind the other; of equal size they would take fewer steps
        centre = np.zeros((count, 3))
        centre[:, 2] = np.arange(count)
        half = np.column_stack([rng.uniform(900, 1100, (count, 2)), np.full(count, 0.2)])
    else:  # through one point
        centre = rng.uniform(-300, 300, (count, 3))
        half = np.abs(centre) + rng.uniform(1, 300, (count, 3))
    return np.concatenate([centre - half, centre + half], axis=1)


def steps_of(case: str, count: int) -> tuple[int, float]:
    """The most steps of 1,000 volumes, and the size of the tree in MB."""
    rng = np.random.default_rng(count)
    boxes = boxes_of(case, count, rng)
    tree = RangeTree(boxes)
    asked = np.full((1000, 6), boxes[:, 5].max() + 1)
    for axis in (0, 1):
        asked[:, [axis, axis + 3]] = np.sort(rng.choice(boxes[:, [axis, axis + 3]].ravel(), (1000, 2)), axis=1)
    return max(tree.existence(volume)[1] for volume in asked), tree.nbytes / 1e6


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--largest", type=int, default=100_000)
    parser.add_argument("--report", type=Path, metavar="FOLDER", help="write the table and a plot into a folder")
    arguments = parser.parse_args()
    rows, lines = [], {}
    for case in ("clustered", "nested", "sliced", "through one point"):
        measured = {count: steps_of(case, count) for count in (*FITTED, arguments.largest)}
        cubes = np.log2(FITTED) ** 3
        c = float((cubes @ [measured[n][0] for n in FITTED]) / (cubes @ cubes))
        for count, (steps, size) in measured.items():
            predicted = c * np.log2(count) ** 3
            rows.append([case, count, steps, predicted, predicted / steps, size])
        lines[case] = (c, {count: steps for count, (steps, _) in measured.items()})
    headers = ["boxes", "n", "steps", "c log2(n)^3", "predicted / counted", "MB"]
    print(tabulate(rows, headers=headers, floatfmt=".4g"))
    if arguments.report:
        arguments.report.mkdir(parents=True, exist_ok=True)
        words = '# The most steps of "any box here?", fitted up to 10,000 boxes; by benchmarks/existence_steps.py.'
        table = tabulate(rows, headers=headers, floatfmt=".4g", tablefmt="github")
        (arguments.report / "existence_steps.md").write_text(f"{words}\n\n![Steps](existence_steps.png)\n\n{table}\n")
        from matplotlib.figure import Figure

        figure = Figure(figsize=(7, 5))
        axes = figure.subplots()
        n = np.geomspace(min(FITTED), arguments.largest, 100)
        for case, (c, steps_at) in lines.items():
            (line,) = axes.plot(n, c * np.log2(n) ** 3, label=case)
            axes.plot(list(steps_at), list(steps_at.values()), "o", color=line.get_color())
        axes.set(xscale="log", xlabel="boxes", ylabel="steps")
        axes.legend()
        figure.savefig(arguments.report / "existence_steps.png", dpi=110)


if __name__ == "__main__":
    main()
