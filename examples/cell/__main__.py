"""Load the cell into a store: `python -m examples.cell cell.duckdb [--picture cell.png]`."""

from __future__ import annotations

import argparse
from pathlib import Path

from relmodel.app.cli.main import main as relmodel

HERE = Path(__file__).parent
OBJECTS = (
    (HERE.parent / "demo" / "bulkhead_A.step.gz", "bulkhead", "A"),
    (HERE / "table.urdf", "table", ""),
    (HERE / "arm.urdf", "arm", ""),
    (HERE / "head.urdf", "stereo_head", ""),
)


def load_cell(store: str) -> int:
    """Make a store at `store` with the cell in it; returns the exit status of the first step that failed, or 0."""
    steps = [["init"]]
    steps += [["load", str(file), "--object", name, "--variant", variant] for file, name, variant in OBJECTS]
    steps += [["world", str(HERE / "cell.yaml")], ["where", "head", "--on", "left_arm"]]
    for step in steps:
        if status := relmodel([*step, "--store", store]):
            return status
    return 0


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("store", help="DuckDB file to make, or a PostgreSQL URL")
    parser.add_argument("--picture", type=Path, metavar="PNG", help="draw the cell too")
    args = parser.parse_args()
    ended = load_cell(args.store)
    if args.picture and not ended:
        from examples.cell.picture import draw_cell

        draw_cell(args.store, args.picture)
    raise SystemExit(ended)
