"""Contacts between the placed parts of an assembly: flat faces that lie on each other, shafts in holes, tapers in
their seats, balls in sockets, rings in grooves.

Two faces are in contact that lie on one surface, the material of one on the other side than that of the other, and
that overlap there.  Pairs are found by an R-tree of the faces' boxes, so the work grows with what touches and not with
all pairs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from relmodel.arrays import Bools, Floats, Ints
from relmodel.features.outlines import KINDS, Outlines
from relmodel.features.parameters import DEFAULTS
from relmodel.geometry.curves import BOX
from relmodel.geometry.transforms import boxes_carried, inverse
from relmodel.model.content_keys import row_count_or_none
from relmodel.model.model import Shape, Table
from relmodel.model.placed_parts import PlacedParts, Places

_P = DEFAULTS.contacts
_CONTACT = dict(zip(KINDS, ("planar", "cylindrical", "conical", "spherical", "toroidal"), strict=True))


def contacts(placed: PlacedParts, assembly: int) -> Table:
    """Columns of `part_contact`, without the object's identity, of parts that different instances of an assembly hold.

    What touches within one instance is a contact of the object that stands there.
    """
    shapes, places = placed.model.shapes, placed.of(assembly)
    near = _near_others(shapes, places)
    outlines = {i: Outlines(shapes[i]) for i in np.unique(places.shape[near]).tolist()}
    held = [(i, o) for i in near.tolist() if len((o := outlines[int(places.shape[i])]).number)]
    if len({int(places.child[i]) for i, _ in held}) < 2:
        return {}
    place = np.concatenate([np.full(len(o.number), i) for i, o in held])
    pose, child = places.pose[place], places.child[place]
    row = np.concatenate([np.arange(len(o.number)) for _, o in held])
    kind, hole, radius, wide, half_angle = (
        np.concatenate([getattr(o, n) for _, o in held]) for n in ("kind", "hole", "radius", "wide", "half_angle")
    )
    frame = pose @ np.concatenate([o.frame for _, o in held])
    faces = _Faces(kind, hole, radius, wide, half_angle, frame)
    reach = _tolerance(kind, radius)[:, None].repeat(3, 1)
    boxes = boxes_carried(pose, np.concatenate([o.boxes for _, o in held])) + np.hstack([-reach, reach])

    a, b = _meeting(boxes)
    keep = (child[a] < child[b]) & (kind[a] == kind[b])
    order = np.lexsort((b[keep], a[keep], place[b[keep]], place[a[keep]]))
    a, b = a[keep][order], b[keep][order]
    on_one, gap = faces.on_one_surface(a, b)
    shaft = np.where(hole[a], radius[b], radius[a])
    tolerance = _tolerance(kind[a], shaft)
    rows = []
    for i in np.flatnonzero(on_one & (np.abs(gap) <= tolerance)).tolist():
        ours, theirs = (outlines[int(places.shape[place[x]])] for x in (a[i], b[i]))
        row_a, row_b = int(row[a[i]]), int(row[b[i]])
        a_from_b = inverse(frame[a[i]]) @ frame[b[i]]
        area = ours.overlap(row_a, theirs, row_b, a_from_b, float(shaft[i]))
        if area > _P.least_area_mm2:
            rows.append((i, area, int(ours.number[row_a]), int(theirs.number[row_b])))
    if not rows:
        return {}
    at = np.array([i for i, *_ in rows])
    return {
        "object_path_a": [placed.path(assembly, int(i)) for i in place[a[at]]],
        "object_path_b": [placed.path(assembly, int(i)) for i in place[b[at]]],
        "surface_a": np.array([s for *_, s, _ in rows]),
        "surface_b": np.array([s for *_, s in rows]),
        "kind": [_CONTACT[kind] for kind in kind[a[at]]],
        "gap": gap[at],
        "area": np.array([area for _, area, *_ in rows]),
        "tolerance": tolerance[at],
    }


@dataclass
class _Faces:
    """All placed faces, columns as `Outlines` has them; frame: in the assembly."""

    kind: npt.NDArray[np.str_]
    hole: Bools
    radius: Floats
    wide: Floats
    half_angle: Floats
    frame: Floats

    def on_one_surface(self, a: Ints, b: Ints) -> tuple[Bools, Floats]:
        """Whether the faces a and b (n,), of one kind, have opposite sides of one surface but for a gap; and the gap.

        It is the distance of planes and of cones, else the radius of the hole less that of the other; negative where
        the parts overlap.
        """
        kind, inner = self.kind[a], np.where(self.hole[a], -1.0, 1.0)
        z_a, z_b = self.frame[a, :3, 2], self.frame[b, :3, 2]
        apart = self.frame[b, :3, 3] - self.frame[a, :3, 3]
        along = np.einsum("nd,nd->n", apart, z_a)
        beside = np.linalg.norm(apart - along[:, None] * z_a, axis=1) <= _P.touch_mm
        centred = np.linalg.norm(apart, axis=1) <= _P.touch_mm
        parallel = np.linalg.norm(np.cross(z_a, z_b), axis=1) < _P.parallel_rad
        same_way = np.einsum("nd,nd->n", z_a, z_b) > 0
        alike = np.abs(self.half_angle[a] - self.half_angle[b]) < _P.parallel_rad
        as_wide = np.abs(self.wide[a] - self.wide[b]) <= _P.touch_mm
        flat, cone = kind == "plane", kind == "cone"
        on_one = np.select(
            [flat, kind == "cylinder", cone, kind == "sphere"],
            [parallel & ~same_way, parallel & beside, parallel & same_way & beside & alike, centred],
            parallel & centred & as_wide,
        )
        fit = inner * (self.radius[b] - self.radius[a])
        # The apex of a taper that hangs free in its seat is further along than that of the seat.
        gap = np.where(flat, along, np.where(cone, -inner * along * np.sin(self.half_angle[a]), fit))
        return on_one & (flat | (self.hole[a] != self.hole[b])), gap


def _tolerance(kind: npt.NDArray[np.str_], radius: Floats) -> Floats:
    """Greatest gap (n,): of what turns in its hole with the clearance of its fit, else of what touches."""
    return np.where(np.isin(kind, ("plane", "cone")), _P.touch_mm, _P.fit_mm + _P.fit_share * radius)


def _near_others(shapes: Sequence[Shape], places: Places) -> Ints:
    """Rows of the places whose boxes come as near to that of another instance as parts in contact do."""
    has = np.array([row_count_or_none(shape.surfaces) > 0 for shape in shapes], bool)
    have = np.flatnonzero(has[places.shape])
    child = places.child[have]
    if len(have) == 0 or np.all(child == child[0]):
        return np.empty(0, np.int64)
    bounds = np.zeros((len(shapes), 6))
    for shape in np.unique(places.shape[have]).tolist():
        surfaces = shapes[shape].surfaces
        boxes = np.stack([np.asarray(surfaces[c], float) for c in BOX], axis=1)
        sizes = np.nan_to_num([np.asarray(surfaces[c], float) for c in ("radius", "radius2")])
        reach = _P.fit_mm + _P.fit_share * float(np.abs(sizes).max(initial=0.0))
        bounds[shape] = np.concatenate([boxes[:, :3].min(axis=0) - reach, boxes[:, 3:].max(axis=0) + reach])
    boxes = boxes_carried(places.pose[have], bounds[places.shape[have]])
    a, b = _meeting(boxes)
    return np.asarray(have[np.unique(a[child[a] != child[b]])], np.int64)


def _meeting(boxes: Floats) -> tuple[Ints, Ints]:
    """Pairs of rows of boxes (n, 6) that meet, each in both orders and with itself."""
    from shapely import STRtree, box

    x0, y0, z0, x1, y1, z1 = boxes.T
    flat = box(x0, y0, x1, y1)
    a, b = STRtree(flat).query(flat)
    meet = (z0[a] <= z1[b]) & (z1[a] >= z0[b])
    return a[meet], b[meet]
