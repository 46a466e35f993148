"""Contacts between the placed parts of an assembly: flat faces that lie on each other, and shafts in holes.

Pairs are found by an R-tree of the boxes of all flat and cylindrical faces, so the work grows with what touches and
not with all pairs.  Areas are those of the overlap of the faces' outlines, drawn in the plane, or in angle and height.
"""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from relmodel.geometry.curves import BOX
from relmodel.geometry.transforms import boxes_carried
from relmodel.index.rtree import PackedRTree
from relmodel.loading.brep import curves_of, surfaces_of
from relmodel.loading.neutral import LoadedModel, Shape, Table

if TYPE_CHECKING:
    from shapely import Polygon

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

TOUCH_MM = 0.01  # between faces that lie on each other, and between the axes of a shaft and its hole
FIT_MM, FIT_SHARE = 0.1, 0.2  # difference of the radii of a shaft and its hole: mm, and share of the shaft's radius
_PARALLEL = 1e-4  # rad
_LEAST_AREA = 1e-4  # mm2
_CHORD_RAD = np.pi / 360
_CHORDS = 180  # of a smooth piece of another curve


def contacts(model: LoadedModel, assembly: int) -> Table:
    """Columns of `part_contact`, without the object's identity, of parts that different instances of an assembly hold.

    What touches within one instance is a contact of the object that stands there.
    """
    places = _places(model, assembly)
    faces = {i: _Faces(model.shapes[i]) for i in sorted({shape for _, _, shape, _ in places})}
    held = [(place, faces[shape]) for place, (_, _, shape, _) in enumerate(places) if len(faces[shape].number)]
    if len({places[place][0] for place, _ in held}) < 2:
        return {}
    pose = np.concatenate([np.tile(places[p][3], (len(f.number), 1, 1)) for p, f in held])
    place = np.concatenate([np.full(len(f.number), p) for p, f in held])
    child = np.array([child for child, *_ in places])[place]
    row = np.concatenate([np.arange(len(f.number)) for _, f in held])
    round_, radius, hole = (np.concatenate([getattr(f, n) for _, f in held]) for n in ("round", "radius", "hole"))
    frame = pose @ np.concatenate([f.frame for _, f in held])
    reach = TOUCH_MM + np.where(round_, FIT_MM + FIT_SHARE * radius, 0.0)[:, None]
    boxes = boxes_carried(pose, np.concatenate([f.boxes for _, f in held])) + np.hstack(
        [-reach.repeat(3, 1), reach.repeat(3, 1)]
    )

    a, b = PackedRTree(boxes).in_boxes(boxes)
    keep = (child[a] < child[b]) & (round_[a] == round_[b])
    order = np.lexsort((b[keep], a[keep], place[b[keep]], place[a[keep]]))
    a, b = a[keep][order], b[keep][order]
    z_a, z_b = frame[a, :3, 2], frame[b, :3, 2]
    across = frame[b, :3, 3] - frame[a, :3, 3]
    along = np.einsum("nd,nd->n", across, z_a)
    parallel = np.linalg.norm(np.cross(z_a, z_b), axis=1) < _PARALLEL
    facing = np.einsum("nd,nd->n", z_a, z_b) < 0
    shaft = np.where(hole[a], radius[b], radius[a])
    gap = np.where(round_[a], np.where(hole[a], 1, -1) * (radius[a] - radius[b]), along)
    tolerance = np.where(round_[a], FIT_MM + FIT_SHARE * shaft, TOUCH_MM)
    aligned = np.where(
        round_[a], (hole[a] != hole[b]) & (np.linalg.norm(across - along[:, None] * z_a, axis=1) <= TOUCH_MM), facing
    )
    found = np.flatnonzero(parallel & aligned & (np.abs(gap) <= tolerance))
    rows = []
    for i in found.tolist():
        face_a, face_b = (faces[places[place[x]][2]] for x in (a[i], b[i]))
        area = _overlap(face_a, int(row[a[i]]), frame[a[i]], face_b, int(row[b[i]]), frame[b[i]], float(shaft[i]))
        if area > _LEAST_AREA:
            rows.append((i, area, int(face_a.number[row[a[i]]]), int(face_b.number[row[b[i]]])))
    if not rows:
        return {}
    at = np.array([i for i, *_ in rows])
    return {
        "path_a": [places[place[x]][1] for x in a[at]],
        "path_b": [places[place[x]][1] for x in b[at]],
        "surface_a": np.array([s for *_, s, _ in rows]),
        "surface_b": np.array([s for *_, s in rows]),
        "kind": np.where(round_[a[at]], "cylindrical", "planar").tolist(),
        "gap": gap[at],
        "area": np.array([area for _, area, *_ in rows]),
        "tolerance": tolerance[at],
    }


def _places(model: LoadedModel, assembly: int) -> list[tuple[int, str, int, Floats]]:
    """Ordinal of the instance, path, shape and pose of each part placed in an assembly, in the order of the file."""
    out = []
    instances = model.assemblies[assembly].instances
    for no, (one, segment) in enumerate(zip(instances, segments([i.name for i in instances]), strict=True)):
        if one.kind == "part":
            out.append((no, segment, model.parts[one.child].shape, one.parent_from_child))
        else:
            for _, path, shape, pose in _places(model, one.child):
                out.append((no, f"{segment}/{path}", shape, one.parent_from_child @ pose))
    return out


def segments(names: list[str]) -> list[str]:
    """Names of instances as pieces of paths, unlike each other; as the view `object_child` makes them."""
    plain = [name.replace("/", "_") for name in names]
    count = Counter(plain)
    return [f"{name}#{no}" if not name or "#" in name or count[name] > 1 else name for no, name in enumerate(plain)]


class _Faces:
    """The flat and the cylindrical faces of a shape.

    number (n,): surface_no; round: whether cylindrical; frame (n, 4, 4): Z out of the material of a flat face, along
    the axis of a cylinder; hole: whether the material is outside; boxes (n, 6).
    """

    def __init__(self, shape: Shape) -> None:
        surfaces = surfaces_of(shape)
        kind = np.asarray(shape.surfaces["recognised_kind"], dtype=str)
        known = np.isin(kind, ("plane", "cylinder")) & ~np.isnan(surfaces.x[:, 0])
        exact = np.asarray(shape.surfaces["provenance"], dtype=str) == "exact"
        self.number = np.flatnonzero(known & exact)
        at = self.number
        self.round = kind[at] == "cylinder"
        self.radius = np.where(self.round, surfaces.radius[at], 0.0)
        middle = surfaces.domain[at].reshape(-1, 2, 2).mean(axis=2)
        normal = surfaces.normals(at, middle[:, 0], middle[:, 1])
        arm = surfaces.evaluate(at, middle[:, 0], middle[:, 1]).points - surfaces.origin[at]
        out = np.einsum("nd,nd->n", normal, arm - np.einsum("nd,nd->n", arm, surfaces.z[at])[:, None] * surfaces.z[at])
        self.hole = self.round & (out < 0)
        inward = ~self.round & (np.einsum("nd,nd->n", normal, surfaces.z[at]) < 0)
        z = np.where(inward[:, None], -1.0, 1.0) * surfaces.z[at]
        self.frame = np.tile(np.eye(4), (len(at), 1, 1))
        self.frame[:, :3, :] = np.stack([surfaces.x[at], np.cross(z, surfaces.x[at]), z, surfaces.origin[at]], axis=2)
        self.boxes = np.stack([np.asarray(shape.surfaces[c], float)[at] for c in BOX], axis=1)
        self._shape = shape
        self._curves = curves_of(shape)
        self._outlines: dict[int, Polygon | None] = {}

    def outline(self, row: int) -> Polygon | None:
        """The face in its plane (x, y), or in angle and height; None where its outline does not close."""
        from shapely import Polygon

        if row not in self._outlines:
            rings = self._rings(row)
            outline = Polygon(rings[0], rings[1:]).buffer(0) if rings else None
            self._outlines[row] = outline if outline is not None and outline.area > 0 else None
        return self._outlines[row]

    def _rings(self, row: int) -> list[Floats]:
        """Loops of a face, the outer one first; none where one goes around a cylinder."""
        co, loops, curves = self._shape.coedges, self._shape.loops, self._curves
        surface, frame = self.number[row], self.frame[row]
        numbers = loops["loop_no"][loops["surface_no"] == surface]
        rings = []
        for loop in sorted(numbers.tolist()):
            points = []
            for k in np.flatnonzero((co["surface_no"] == surface) & (co["loop_no"] == loop)).tolist():
                arc = int(co["arc_no"][k])
                t = _along(curves.cuts(arc, curves.t0[arc], curves.t1[arc]), str(curves.kind[arc]))
                points.append(curves.evaluate(np.full(len(t), arc), t[::-1] if co["reversed"][k] else t)[0])
            x, y, z = ((np.concatenate(points) - frame[:3, 3]) @ frame[:3, :3]).T
            if self.round[row]:
                angle = np.unwrap(np.arctan2(y, x))
                if abs(angle[-1] - angle[0]) > np.pi:
                    return []
                rings.append(np.column_stack([angle, z]))
            else:
                rings.append(np.column_stack([x, y]))
        return rings


def _along(cuts: Floats, kind: str) -> Floats:
    """Parameters along an arc, close enough for chords."""
    if kind == "line":
        return cuts
    steps = np.ceil(np.diff(cuts) / _CHORD_RAD) if kind in ("circle", "ellipse") else np.full(len(cuts) - 1, _CHORDS)
    pieces = [np.linspace(a, b, int(n) + 1)[:-1] for a, b, n in zip(cuts[:-1], cuts[1:], steps, strict=True)]
    return np.append(np.concatenate(pieces), cuts[-1])


def _overlap(
    faces_a: _Faces, row_a: int, frame_a: Floats, faces_b: _Faces, row_b: int, frame_b: Floats, radius: float
) -> float:
    """Area that two faces have in common, mm2; of cylinders on the one of the given radius."""
    from shapely.affinity import affine_transform, translate

    a, b = faces_a.outline(row_a), faces_b.outline(row_b)
    if a is None or b is None:
        return 0.0
    to = frame_a[:3, :3].T
    turn, shift = to @ frame_b[:3, :3], to @ (frame_b[:3, 3] - frame_a[:3, 3])
    if not faces_a.round[row_a]:
        return float(a.intersection(affine_transform(b, [*turn[0, :2], *turn[1, :2], shift[0], shift[1]])).area)
    way = 1.0 if turn[2, 2] > 0 else -1.0
    there = affine_transform(b, [way, 0, 0, way, float(np.arctan2(turn[1, 0], turn[0, 0])), shift[2]])
    # The angles of either start anywhere: shift those of one by whole turns over the other's.
    first = np.ceil((a.bounds[0] - there.bounds[2]) / (2 * np.pi))
    last = np.floor((a.bounds[2] - there.bounds[0]) / (2 * np.pi))
    turns = np.arange(first, last + 1) * 2 * np.pi
    return radius * float(sum(a.intersection(translate(there, angle, 0.0)).area for angle in turns))
