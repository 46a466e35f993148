"""Sizes of features by their surfaces' displacements: diameters, thicknesses, and where single surfaces lie."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from relmodel.arrays import Bools, Floats, Ints
from vision.presence.items import Items
from vision.presence.presence_parameters import StateParameters
from vision.presence.surfaces import Surfaces

DISPLACED = ("displacement", "dx", "dy", "dz", "turn")  # of parts that lie elsewhere


@dataclass(frozen=True)
class Measures:
    """Measured sizes of items, as columns: item; what: diameter, thickness, width (between walls of a pocket), offset
    (how far outward a surface lies), shift (how far aside the middle of a bore lies), of parts that lie elsewhere
    displacement, dx, dy, dz (mm along the world's axes) and turn (degrees); nominal, value, sigma: in `unit_of(what)`;
    changed: whether it surely differs.
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


def find_moved(items: Items, surfaces: Surfaces, distinct_px: Floats, least_share: float) -> Bools:
    """Which rows of `items.member` are moved faces that count for their feature or surface.

    distinct_px (n,): of items; a face with less than a share of that does not count, such as one face of a body.
    """
    much = surfaces.distinct_px[items.surface] >= least_share * distinct_px[items.member]
    return np.asarray(surfaces.moved[items.surface] & much & (np.array(items.level)[items.member] != "part"))


def measure_items(items: Items, radius: Floats, surfaces: Surfaces, moved: Bools, p: StateParameters) -> Measures:
    """All sizes that the displacements of surfaces give, and which surely differ: a feature or surface has changed
    where one of its sizes has.

    moved: from `find_moved`.
    """
    level, kind = np.array(items.level)[items.member], np.array(items.kind)
    surface, opposed, others = items.surface, surfaces.opposed, np.arange(len(items))
    mm, sigma, shift_sigma = surfaces.mm[surface], surfaces.sigma[surface], surfaces.shift_sigma[surface]
    aside = np.linalg.norm(surfaces.shift[surface], axis=1)
    measured = np.isfinite(mm)
    round_ = measured & np.isfinite(shift_sigma) & np.isfinite(radius[surface]) & (level == "feature")
    single = measured & ~round_ & (level != "part")
    diameter, grows = 2 * radius[surface], np.where(surfaces.inward[surface], -2.0, 2.0)
    zero, always = np.zeros(len(surface)), np.ones(len(surface), bool)
    # Whether a single face lies elsewhere, as a wall of a pocket, is known from where it was sought, and a web's other
    # side is hardly ever seen: widths and webs are reported, and judged where a face of theirs has moved.
    has_moved = np.zeros(len(items), bool)
    has_moved[items.member[moved]] = True
    thickness, thickness_sigma = _thicknesses(items, surfaces, measured)
    width = opposed.sizes(surfaces.mm)
    width_sigma = np.hypot(surfaces.sigma[opposed.one], surfaces.sigma[opposed.other])
    wall_moved = has_moved[opposed.item] & (surfaces.moved[opposed.one] | surfaces.moved[opposed.other])
    pieces = [
        _columns("diameter", round_, items.member, diameter, diameter + grows * mm, 2 * sigma, always),
        _columns("shift", round_, items.member, zero, aside, shift_sigma, always),
        _columns("offset", single, items.member, zero, mm, sigma, moved),
        _columns(
            "thickness", np.isfinite(thickness), others, items.thickness, thickness, thickness_sigma,
            (kind == "rib") | has_moved,
        ),
        _columns(
            "width", np.isfinite(width) & (opposed.sign < 0), opposed.item, opposed.mm, width, width_sigma, wall_moved
        ),
    ]  # fmt: skip
    what = np.array([name for piece in pieces for name in piece[0]], "U9")
    item, nominal, value, sigma, judged = (np.concatenate([piece[k] for piece in pieces]) for k in range(1, 6))
    off = np.abs(value - nominal)
    least = np.where(what == "thickness", p.changed_wall_mm, p.changed_mm)
    changed = judged & ((what == "offset") | (off > p.changed_sigma * sigma) & (off > least))
    # A size that no part can have is dropped.
    most = np.full(len(items), np.inf)
    np.minimum.at(most, opposed.item, opposed.most)
    kept = np.isin(what, ("offset", "shift")) | (value > 0) & (value <= most[item])
    return Measures(item[kept], what[kept].tolist(), nominal[kept], value[kept], sigma[kept], changed[kept])


_Columns = tuple[list[str], Ints, Floats, Floats, Floats, Bools]


def _columns(
    what: str, rows: Bools, item: Ints, nominal: Floats, value: Floats, sigma: Floats, judged: Bools
) -> _Columns:
    return [what] * int(rows.sum()), item[rows], nominal[rows], value[rows], sigma[rows], judged[rows]


def _thicknesses(items: Items, surfaces: Surfaces, measured: Bools) -> tuple[Floats, Floats]:
    """Of ribs and webs, mm and sigma (n,): the nominal and how far both sides lie outward; nan of other items, and of
    those of which one side is not measured."""
    flat = np.linalg.norm(surfaces.normal, axis=1) > 0.99
    rows = np.flatnonzero(measured & np.isfinite(items.thickness[items.member]) & flat[items.surface])
    item, normal = items.member[rows], surfaces.normal[items.surface[rows]]
    # The first surface of an item says which side is which.
    first = rows[np.diff(item, prepend=-1) != 0]
    reference = np.zeros((len(items), 3))
    reference[items.member[first]] = surfaces.normal[items.surface[first]]
    facing = np.einsum("ni,ni->n", normal, reference[item])
    value, variance = items.thickness.copy(), np.zeros(len(items))
    for side in (facing > 0.98, facing < -0.98):
        weight = np.where(side, surfaces.sigma[items.surface[rows]] ** -2.0, 0.0)
        total = np.bincount(item, weight, len(items)).astype(float)
        total[total == 0] = np.nan
        value += np.bincount(item, weight * surfaces.mm[items.surface[rows]], len(items)) / total
        variance += 1 / total
    return value, np.sqrt(variance)
