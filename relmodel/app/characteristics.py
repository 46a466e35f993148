"""Tolerances of sizes that a person's CSV states: each row is held against the parts, and all are recorded, or none."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from sqlalchemy import Connection

from relmodel.arrays import by_column
from relmodel.errors import InputError
from relmodel.names import read_bytes, read_csv
from relmodel.resources import user_name
from relmodel.store import Run, Store

COLUMNS = ("path", "what", "nominal", "plus", "minus")
_KEPT = "part_id item what nominal lower_limit upper_limit"
_NEAR_MM = 0.005  # of a size of the model within which it is the one that a file names


def record_tolerances(store: Store, file: Path, variant: str = "") -> str:
    """Record the tolerances of a CSV with COLUMNS, mm, of a variant of the objects that it names; what was done.
    Raises InputError for a row that fits no size; nothing is recorded then."""
    digest = hashlib.sha256(read_bytes(file, "list of tolerances")).hexdigest()
    asked = {"file": file.name, "variant": variant, "user": user_name()}
    with Run.begin(store, "set", asked, inputs={"tolerances": (file.name, digest)}) as run:
        with store.read() as connection:
            rows = _read_rows(store, connection, file, variant)
        words = f"the tolerances of {file.name} are recorded, {len(rows)} in all"

        def write(connection: Connection) -> None:
            run.append(connection, "size_tolerance", {"run_id": run.id, **by_column(_KEPT, rows)})
            run.finish(words, connection)

        run.transact(write)
    return f"{words} (run {run.id})"


def _read_rows(store: Store, connection: Connection, file: Path, variant: str) -> list[tuple[Any, ...]]:
    """What `size_tolerance` keeps, by row of the file."""
    rows = list(read_csv(file, "list of tolerances"))
    if len(rows) < 2 or rows.pop(0)[1] != [*COLUMNS]:
        raise InputError(f"{file}, line 1: give the columns {','.join(COLUMNS)}, and below them a line for each size")
    there: dict[str, dict[str, Any]] = {cells[0]: {} for _, cells in rows}
    for size in store.rows(connection, "object/sizes", paths=list(there), variant=variant):
        if there[size.path].setdefault(size.what, size).part_id != size.part_id:
            raise InputError(f"{file}: {size.path} is another part in each variant: say which with --variant")
    found: dict[Any, tuple[Any, ...]] = {}
    for place, (path, *cells) in rows:
        try:
            row = _resolve(path, [*cells, "", "", "", ""], there[path])
            if found.setdefault(row[:3], row) is not row:
                raise InputError(f"the {row[2]} of {path} or of an equal part stands above: leave one out")
        except InputError as error:
            raise InputError(f"{place}: {error}") from error
    return list(found.values())


def _resolve(path: str, cells: Sequence[str], sizes: Mapping[str, Any]) -> tuple[Any, ...]:
    """What `size_tolerance` keeps of a row of the file; sizes: of its path.  Raises InputError, without place."""
    size = sizes.get(what := cells[0])
    if size is None:
        known = f"it has {', '.join(sorted(sizes))}" if sizes else "relmodel show and find name parts and features"
        raise InputError(f"inspections measure no {what!r} of {path}: {known}")
    if size.source == "file":
        raise InputError(f"the CAD file states the limits of {what} of {path}: leave the row out")
    try:
        nominal, plus, minus = numbers = [float(cell) if cell else None for cell in cells[1:4]]
        int(sum(filter(None, numbers)))  # fails where one is not finite
    except (ValueError, OverflowError):
        raise InputError(f"{', '.join(cells[1:4])} are no numbers: write them with points, mm") from None
    minus = minus if minus is None or cells[3].startswith("+") else -abs(minus)
    if what in ("presence", "count"):
        plus, minus = plus or 0.0, minus or 0.0
    elif not (-math.inf if minus is None else minus) < (math.inf if plus is None else plus):
        raise InputError(f"plus {plus} is not above minus {minus}: give the upper deviation as plus")
    if nominal is not None and not abs(nominal - size.nominal) <= _NEAR_MM:
        raise InputError(f"{what} of {path} is {size.nominal:g} in the model, not {nominal:g}: give that, or nothing")
    ends = (None if end is None else size.nominal + end for end in (minus, plus))
    return size.part_id, size.item, what, size.nominal, *ends
