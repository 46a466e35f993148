"""A list of pairs to inspect one after the other: CSV as a spreadsheet writes it, a line a pair."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from relmodel.errors import InputError
from relmodel.paths import read_text

FILES = ("left", "right", "prior", "rig", "overlay", "crops")
COLUMNS = (*FILES, "serial")
SEPARATORS = ",;\t"
# From what is right to what is worst.
_STATUSES = (0, 5, 1, 3, 2, 4)


@dataclass(frozen=True)
class Listed:
    """A line of a list: the paths by column, None where the cell is empty, what the pair is called, the
    number of the physical part, and where it stands: `FILE, line N`."""

    paths: dict[str, Any]
    name: str
    serial: str | None
    place: str


def read_pairs(file: Path, serial: str | None = None, **given: Path | None) -> list[Listed]:
    """The pairs of a list, whose first line names its columns, some of COLUMNS; paths are relative to the list's
    folder; `serial` and the paths `given` stand for empty cells.  Raises InputError, which names the line, where it is
    no such list."""
    text = read_text(file, "list of pairs")
    heading = next(iter(text.splitlines()), "")
    rows = csv.reader(text.splitlines(keepends=True), delimiter=max(SEPARATORS, key=heading.count), strict=True)
    pairs: list[Listed] = []
    try:
        names = [cell.strip().lower() for cell in next(rows, [])]
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
        raise InputError(f"the list {file} names no pair: give a line for each below the columns' names")
    return pairs


def worst(statuses: Iterable[int]) -> int:
    """The worst of exit statuses: an internal error, wrong use, bad input, refused or ambiguous, not as modelled."""
    return max(statuses, key=_STATUSES.index, default=0)


def _check_columns(names: Sequence[str], file: Path) -> None:
    known = f"the columns are some of {', '.join(COLUMNS)}, left among them"
    wrong = next((name for name in names if name not in COLUMNS or names.count(name) > 1), None)
    if wrong is not None:
        often = "stands there twice" if wrong in COLUMNS else "is not known"
        raise InputError(f"{file}, line 1: the column {wrong!r} {often}: {known}")
    if "left" not in names:
        raise InputError(f"{file}, line 1: there is no column left: {known}")


def _listed(
    cells: dict[str, str], place: str, folder: Path, serial: str | None, given: dict[str, Path | None]
) -> Listed:
    paths = {name: folder / cells[name] if cells.get(name) else given.get(name) for name in FILES}
    if not cells.get("left"):
        raise InputError(f"{place}: no picture of the camera left is named: name one, or take the line out")
    if paths["rig"] is None:
        raise InputError(f"{place}: no rig is named: give --rig, or a column rig")
    return Listed(paths, cells["left"], cells.get("serial") or serial, place)
