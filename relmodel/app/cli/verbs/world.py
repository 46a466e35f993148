"""Place objects in a world, as a world file says."""

from __future__ import annotations

import argparse
from pathlib import Path

from relmodel.app.cli.options import store_target
from relmodel.app.cli.output import say

EXAMPLE = "relmodel world cell.yaml --store cell.duckdb"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file", type=Path, metavar="FILE", help="world file (YAML)")


def run(args: argparse.Namespace) -> int:
    from relmodel.app.cli.progress import shown
    from relmodel.store import Store
    from vision.cameras.record import place_world_with_rigs

    with Store.open(store_target(args)) as store, shown(store) as progress:
        report = place_world_with_rigs(store, args.file, progress)
    say(
        f"{report.world}, revision {report.revision}: {report.status} (run {report.run_id}); "
        f"{report.objects} objects and {report.parts} parts placed"
    )
    return 0
