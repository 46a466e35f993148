"""Sizes of features by their surfaces' displacements: diameters, thicknesses, and where single surfaces lie."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from relmodel.arrays import Bools, Floats, Ints
from vision.presence.items import Items
from vision.presence.presence_parameters import StateParameters
from vision.presence.surfaces import Surfaces


@dataclass(frozen=True)
class Measures:
    """Measured sizes of items, as columns: item; what: diameter, thickness, width (between walls of a pocket), offset
    (how far outward a surface lies), shift (how far aside the middle of a bore lies), of parts that lie elsewhere
    displacement, dx, dy, dz (mm along the world's axes) and turn (degrees); nominal, value, sigma: in `unit_of(what)`;
    changed: whether it is surely another.
    """

    item: Ints
    what: list[str]
    nominal: Floats
    value: Floats
    sigma: Floats
    changed: Bools


def unit_of(what: str) -> str:
    """The unit of a measured size."""
    return "deg" if what == "turn" else "mm"


def join(a: Measures, b: Measures) -> Measures:
    """The rows of both."""
    return Measures(
        np.concatenate([a.item, b.item]),
        [*a.what, *b.what],
        *(np.concatenate([getattr(a, name), getattr(b, name)]) for name in ("nominal", "value", "sigma", "changed")),
    )


def measure_items(items: Items, radius: Floats, surfaces: Surfaces, p: StateParameters) -> Measures:
    """All sizes that the displacements of surfaces give."""
    feature = np.array([level == "feature" for level in items.level])
    surface = items.surface
    measured = np.isfinite(surfaces.mm[surface])
    closed = measured & np.isfinite(surfaces.shift_sigma[surface])
    flat = measured & ~closed
    round_ = closed & np.isfinite(radius[surface]) & feature[items.member]
    sign = np.where(surfaces.inward[surface], -2.0, 2.0)
    diameter = 2 * radius[surface]
    pieces = [
        _columns(
            items, round_, "diameter", diameter, diameter + sign * surfaces.mm[surface], 2 * surfaces.sigma[surface]
        ),
        _columns(
            items, round_, "shift", np.zeros(len(surface)), np.linalg.norm(surfaces.shift[surface], axis=1),
            surfaces.shift_sigma[surface],
        ),
        _columns(
            items, flat & (np.array(items.level)[items.member] != "part"), "offset",
            np.zeros(len(surface)), surfaces.mm[surface], surfaces.sigma[surface],
        ),
        _thicknesses(items, surfaces, measured),
        _widths(items, surfaces, flat),
    ]  # fmt: skip
    item = np.concatenate([piece[0] for piece in pieces])
    what = [name for piece in pieces for name in piece[1]]
    nominal, value, sigma = (np.concatenate([piece[k] for piece in pieces]) for k in (2, 3, 4))
    off = np.abs(value - nominal)
    # A web's other side is hardly ever seen: its thickness is told, not judged.
    judged = (np.array(what) != "thickness") | (np.array(items.kind)[item] == "rib")
    # Whether a single surface lies elsewhere, as a wall of a pocket, is known from where it was sought.
    judged &= ~np.isin(what, ("offset", "width"))
    least = np.where(np.array(what) == "thickness", p.changed_wall_mm, p.changed_mm)
    changed = judged & (off > p.changed_sigma * sigma) & (off > least)
    return Measures(item, what, nominal, value, sigma, changed)


_Columns = tuple[Ints, list[str], Floats, Floats, Floats]


def _columns(items: Items, rows: Bools, what: str, nominal: Floats, value: Floats, sigma: Floats) -> _Columns:
    return items.member[rows], [what] * int(rows.sum()), nominal[rows], value[rows], sigma[rows]


def _thicknesses(items: Items, surfaces: Surfaces, measured: Bools) -> _Columns:
    """Of ribs and webs, where surfaces on both sides are measured: the nominal and how far both sides lie outward."""
    flat = np.linalg.norm(surfaces.normal, axis=1) > 0.99
    rows = np.flatnonzero(measured & np.isfinite(items.thickness[items.member]) & flat[items.surface])
    item, normal = items.member[rows], surfaces.normal[items.surface[rows]]
    # The first surface of an item says which side is which.
    first = rows[np.diff(item, prepend=-1) != 0]
    reference = np.zeros((len(items), 3))
    reference[items.member[first]] = surfaces.normal[items.surface[first]]
    facing = np.einsum("ni,ni->n", normal, reference[item])
    sums = []
    for side in (facing > 0.98, facing < -0.98):
        weight = np.where(side, surfaces.sigma[items.surface[rows]] ** -2.0, 0.0)
        total = np.bincount(item, weight, len(items))
        sums.append((total, np.bincount(item, weight * surfaces.mm[items.surface[rows]], len(items))))
    both = np.flatnonzero((sums[0][0] > 0) & (sums[1][0] > 0))
    nominal = items.thickness[both]
    value = nominal + sum(s[both] / w[both] for w, s in sums)
    sigma = np.sqrt(np.asarray(sum(1 / w[both] for w, _ in sums)))
    return both, ["thickness"] * len(both), nominal, np.asarray(value), sigma


def _widths(items: Items, surfaces: Surfaces, measured: Bools) -> _Columns:
    """Of pockets, between walls that face each other where both are measured: the distance between them along their
    normals in the middle of their edges, by the model and with both walls where they were found."""
    rows = np.flatnonzero(
        measured
        & (np.array(items.kind)[items.member] == "pocket")
        & (np.linalg.norm(surfaces.normal, axis=1) > 0.99)[items.surface]
    )
    pairs = [np.zeros((2, 0), np.int64)]
    for k in range(1, int(np.bincount(items.member[rows]).max(initial=1))):
        same = items.member[rows[:-k]] == items.member[rows[k:]]
        pairs.append(np.stack([rows[:-k][same], rows[k:][same]]))
    one, other = np.concatenate(pairs, axis=1)
    a, b = items.surface[one], items.surface[other]
    normal, way = surfaces.normal[a], surfaces.middle[b] - surfaces.middle[a]
    across = np.einsum("ni,ni->n", normal, way)
    facing = (np.einsum("ni,ni->n", normal, surfaces.normal[b]) < -0.9999) & (across > 0)
    one, a, b, nominal = one[facing], a[facing], b[facing], across[facing]
    order = np.lexsort((b, a, items.member[one]))
    one, a, b, nominal = one[order], a[order], b[order], nominal[order]
    value = nominal - surfaces.mm[a] - surfaces.mm[b]
    return items.member[one], ["width"] * len(one), nominal, value, np.hypot(surfaces.sigma[a], surfaces.sigma[b])
