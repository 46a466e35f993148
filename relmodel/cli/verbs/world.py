"""Place objects in a world, as a world file says."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from relmodel.cli.options import store_target
from relmodel.cli.output import say
from relmodel.errors import InputError

if TYPE_CHECKING:
    from vision.cameras.cameras import Rig

EXAMPLE = "relmodel world cell.yaml --store cell.duckdb"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file", type=Path, metavar="FILE", help="world file (YAML)")


def run(args: argparse.Namespace) -> int:
    from relmodel.cli.progress import shown
    from relmodel.store import Store
    from relmodel.world.placement import place_world
    from vision.cameras.record import record_rig

    with Store.open(store_target(args)) as store, shown() as progress:
        report = place_world(
            store,
            args.file,
            progress=progress,
            write_rig=lambda run, connection, _, path: record_rig(run, connection, _read_rig(path)),
        )
    say(
        f"{report.world}, revision {report.revision}: {report.status} (run {report.run_id}); "
        f"{report.objects} objects and {report.parts} parts placed"
    )
    return 0


def _read_rig(path: Path) -> Rig:
    """The rig of one file: whether the world changed is told by its digest."""
    from vision.cameras.files import read_rig, rig_inputs

    if len(rig_inputs(path)) > 1:
        raise InputError(f"the rig {path} is of several files: make it one with relmodel rig convert, and name that")
    return read_rig(path)
