"""A list of pictures to inspect, a line for those taken together: CSV as a spreadsheet writes it."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from relmodel.errors import InputError
from relmodel.paths import read_text

FILES = ("prior", "rig", "overlay", "crops")
COLUMNS = (*FILES, "serial")  # all others are cameras
SEPARATORS = ",;\t"
# From what is right to what is worst.
_STATUSES = (0, 5, 1, 3, 2, 4)


@dataclass(frozen=True)
class Listed:
    """A line of a list: pictures by camera, other paths by column, None where the cell is empty, what the line is
    called, the number of the physical part, and where it stands: `FILE, line N`."""

    pictures: dict[str, Path]
    paths: dict[str, Any]
    name: str
    serial: str | None
    place: str


def read_pairs(file: Path, serial: str | None = None, **given: Path | None) -> list[Listed]:
    """The lines of a list, whose first names its columns, some of COLUMNS and cameras; paths are relative to the list's
    folder; `serial` and the paths `given` stand for empty cells.  Raises InputError, which names the line, where it is
    no such list."""
    text = read_text(file, "list of pictures")
    heading = next(iter(text.splitlines()), "")
    rows = csv.reader(text.splitlines(keepends=True), delimiter=max(SEPARATORS, key=heading.count), strict=True)
    pairs: list[Listed] = []
    try:
        names = [name.lower() if name.lower() in COLUMNS else name for name in map(str.strip, next(rows, []))]
        _check_columns(names, file)
        for row in rows:
            cells = [cell.strip() for cell in row]
            place = f"{file}, line {rows.line_num}"
            if not any(cells) or cells[0].startswith("#"):
                continue
            if len(cells) > len(names):
                raise InputError(
                    f"{place}: {len(cells)} cells under {len(names)} columns: quote cells that hold commas"
                )
            pairs.append(_listed(dict(zip(names, cells, strict=False)), place, file.parent, serial, given))
    except csv.Error as error:
        raise InputError(f"{file}, line {rows.line_num}: this is no CSV ({error}): see to its quotes") from error
    if not pairs:
        raise InputError(
            f"the list {file} names no picture: give a line for those taken together, below the columns' names"
        )
    return pairs


def worst(statuses: Iterable[int]) -> int:
    """The worst of exit statuses: an internal error, wrong use, bad input, refused or ambiguous, not as modelled."""
    return max(statuses, key=_STATUSES.index, default=0)


def _check_columns(names: Sequence[str], file: Path) -> None:
    known = f"name cameras, and where needed {', '.join(COLUMNS)}"
    if "" in names:
        raise InputError(f"{file}, line 1: a column has no name: {known}")
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise InputError(f"{file}, line 1: the column {twice!r} stands there twice: {known}")
    if not set(names) - set(COLUMNS):
        raise InputError(f"{file}, line 1: there is no column of a camera: {known}")


def _listed(
    cells: dict[str, str], place: str, folder: Path, serial: str | None, given: dict[str, Path | None]
) -> Listed:
    paths = {name: folder / cells[name] if cells.get(name) else given.get(name) for name in FILES}
    pictures = {name: folder / cell for name, cell in cells.items() if name not in COLUMNS and cell}
    if not pictures:
        raise InputError(f"{place}: no picture is named: name one under its camera, or take the line out")
    if paths["rig"] is None:
        raise InputError(f"{place}: no rig is named: give --rig, or a column rig")
    name = next(cells[camera] for camera in pictures)
    return Listed(pictures, paths, name, cells.get("serial") or serial, place)
