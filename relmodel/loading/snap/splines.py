"""Splines that are one function to round-off."""

from __future__ import annotations

from typing import Any

import numpy as np

from relmodel.arrays import Bools, Floats, Ints
from relmodel.columns import Ragged, stack, take
from relmodel.geometry.splines import Splines
from relmodel.loading.load_parameters import DEFAULTS
from relmodel.model.content_keys import row_count_or_none
from relmodel.model.model import Table

_P = DEFAULTS.snap
_EXACT = tuple(f"{way}{name}" for way in ("", "u_", "v_") for name in ("degree", "periodic", "multiplicities"))
_KNOTS = ("knots", "u_knots", "v_knots", "weights")


def snapped_splines(table: Table, owner: str, row: Ints, ids: Ints, stored: Table) -> tuple[Table, Bools]:
    """Splines of a shape, those of the store for rows (n,) where the stored ones of these identities (n,) are alike;
    and of which of these (n,) they are not."""
    unlike = np.zeros(len(row), bool)
    count = row_count_or_none(table)
    if not count or not len(stored["id"]):
        return table, unlike
    at = {int(number): i for i, number in enumerate(table[owner])}
    there = {int(identity): i for i, identity in enumerate(stored["id"])}
    source = np.arange(count)
    for k, (number, identity) in enumerate(zip(row.tolist(), ids.tolist(), strict=True)):
        i, j = at.get(number), there.get(identity)
        if i is None or j is None:
            unlike[k] = (i is None) != (j is None)
        elif _alike(table, i, stored, j):
            source[i] = count + j
        else:
            unlike[k] = True
    theirs: Table = {c: _packed(stored[c], table[c]) for c in table if c != owner}
    ours = {c: table[c] for c in theirs}
    return {owner: table[owner], **take(stack([ours, theirs]), source)}, unlike


def _packed(values: Any, like: Any) -> Any:
    """A column of the store as those of a shape are."""
    return Ragged.pack(list(values), like.values.dtype) if isinstance(like, Ragged) else values.astype(like.dtype)


def _alike(ours: Table, i: int, theirs: Table, j: int) -> bool:
    """Whether two splines are one function but for round-off."""
    if _agree(ours["poles"][i], theirs["poles"][j], _P.round_off_mm) and all(
        _agree(ours[c][i], theirs[c][j], 0.0) for c in _EXACT if c in ours
    ):
        knots = [(ours[c][i], theirs[c][j]) for c in _KNOTS if c in ours]
        return all(_agree(a, b, _P.knot_share * max([1.0, *_flat(a).tolist()])) for a, b in knots)
    if "knots" not in ours:
        return False
    # A kernel inserts a knot where an edge ends next to another.
    cuts = [_flat(ours["knots"][i]), _flat(theirs["knots"][j])]
    knots_of_both = np.unique(np.concatenate(cuts))
    t = np.concatenate([knots_of_both, (knots_of_both[:-1] + knots_of_both[1:]) / 2])
    t = np.clip(t, max(c[0] for c in cuts), min(c[-1] for c in cuts))
    first, second = (
        Splines(table, np.array([row])).evaluate(np.zeros(len(t), np.int64), t)[0]
        for table, row in ((ours, i), (theirs, j))
    )
    return _agree(first, second, _P.round_off_mm)


def _agree(a: Any, b: Any, tolerance: float) -> bool:
    a, b = _flat(a), _flat(b)
    return len(a) == len(b) and bool(np.all(np.abs(a - b) <= tolerance))


def _flat(values: Any) -> Floats:
    return np.empty(0) if values is None else np.asarray(values, float).ravel()
