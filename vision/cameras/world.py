"""World files that mount rigs: placed with their rigs as rows."""

from __future__ import annotations

from pathlib import Path

from relmodel.errors import InputError
from relmodel.progress import Progress, silent
from relmodel.store import Store
from relmodel.world.placement import WorldReport, place_world
from vision.cameras.cameras import Rig
from vision.cameras.files import read_rig, rig_inputs
from vision.cameras.record_cameras import record_rig


def place_world_with_rigs(store: Store, path: str | Path, progress: Progress = silent) -> WorldReport:
    """`place_world` with the rigs of the file, in any format of `read_rig` that is one file."""
    return place_world(
        store,
        path,
        progress=progress,
        write_rig=lambda run, connection, _, file: record_rig(run, connection, _read_one_file(file)),
    )


def _read_one_file(path: Path) -> Rig:
    """The rig of one file: its digest says whether the world changed."""
    if len(rig_inputs(path)) > 1:
        raise InputError(f"the rig {path} is of several files: make it one with relmodel rig convert, and name that")
    return read_rig(path)
