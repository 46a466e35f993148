"""What makes arcs, shapes, parts and assemblies the same: content keys, and sharing found again in flat files."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from relmodel.arrays import Bools, Floats, Ints, Ragged, row_count
from relmodel.errors import InputError
from relmodel.geometry.congruence import Constituents, motions, unsigned
from relmodel.geometry.curves import vectors
from relmodel.geometry.surfaces import ANALYTIC_KINDS
from relmodel.geometry.transforms import Joint
from relmodel.model.measures import curves_of, surfaces_of
from relmodel.model.model import Assembly, Attribute, Instance, Model, Shape, Table

# A content key is the first half of the SHA-256 of the thing's kind and numbers, and of the keys of what it is made of
# (a Merkle tree). Numbers enter rounded down to a grid of 1e-6 mm for lengths and 1e-9 for directions, angles and
# spline parameters, so that a kernel's round-off does not show. The grid is shifted by an irrational part of its
# spacing, since nominal dimensions (decimal millimetres, binary fractions of an inch) would otherwise fall on its
# edges.
#
# Two numbers that differ by a round-off of r still fall into two cells with probability r / spacing: one in a million
# for the 1e-12 mm of a kernel, often for a file that was written with other last digits. So numbers of a model are
# first snapped to those of the store that are near (`loading/snap.py`). A file read again gives the same numbers, and
# so the same keys.

LENGTH_QUANTUM = 1e-6  # mm
ANGLE_QUANTUM = 1e-9  # rad, components of directions, spline parameters and weights
_SHIFT = 2**-0.5
_KEY_LENGTH = 32  # hexadecimal digits
_LEAST = np.iinfo(np.int64).min
Keys = TypeVar("Keys")


@dataclass(frozen=True)
class ShapeKeys:
    """Content keys of one shape and of its rows; support keys name the unbounded surface."""

    shape: str
    arcs: list[str]
    surfaces: list[str]
    surface_supports: list[str]
    basis_arcs: list[str]
    basis_surfaces: list[str]
    basis_surface_supports: list[str]


@dataclass(frozen=True)
class ModelKeys:
    """Content keys of all of a model, in the model's order."""

    shapes: list[ShapeKeys]
    parts: list[str]
    assemblies: list[str]


def model_keys(model: Model) -> ModelKeys:
    """Keys of a model.  Raises InputError where an assembly contains itself."""
    shapes = [shape_keys(shape) for shape in model.shapes]
    parts = []
    for p in model.parts:
        faces = shapes[p.shape].surfaces
        pmi = [repr((replace(one, surfaces=()), [(faces[s], role) for s, role in one.surfaces])) for one in p.pmi]
        labels = (p.number, p.name, p.material or "", p.colour or "", *_attribute_texts(p.attributes))
        parts.append(content_key([*labels, *pmi, shapes[p.shape].shape]))
    return ModelKeys(shapes, parts, _assembly_keys(model.assemblies, parts))


def shape_keys(shape: Shape) -> ShapeKeys:
    """Keys of a shape and of its arcs and surfaces."""
    basis_arcs = _of_basis(
        lambda made: _arc_keys(shape.basis_arcs, shape.basis_arc_splines, made),
        lambda keys: _made_from_keys(shape.basis_arc_offsets, "arc_no", keys),
    )
    arcs = _arc_keys(shape.arcs, shape.arc_splines, _made_from_keys(shape.arc_offsets, "arc_no", basis_arcs))
    bare = [""] * row_count_or_none(shape.basis_surfaces)
    basis_surfaces, basis_surface_supports = _of_basis(
        lambda made: _surface_keys(shape.basis_surfaces, shape.basis_surface_splines, bare, made),
        lambda found: _made_from_keys(shape.basis_surface_swept, "surface_no", basis_arcs, found[0]),
    )
    swept = _made_from_keys(shape.surface_swept, "surface_no", basis_arcs, basis_surfaces)
    loops = _loop_keys(shape, arcs)
    surfaces, surface_supports = _surface_keys(shape.surfaces, shape.surface_splines, loops, swept)
    columns = ("name", "colour", "layer", *(name for name in ("finish",) if name in shape.surfaces))
    labels = zip(*(_texts(shape.surfaces, name) for name in columns), strict=True)
    faces = sorted("|".join((key, *label)) for key, label in zip(surfaces, labels, strict=True))
    return ShapeKeys(
        content_key([shape.kind, *faces, "arcs", *sorted(arcs)]),
        arcs,
        surfaces,
        surface_supports,
        basis_arcs,
        basis_surfaces,
        basis_surface_supports,
    )


def row_count_or_none(table: Table) -> int:
    """Number of rows of a table, 0 where it has no column."""
    return row_count(table) if table else 0


def content_key(texts: Iterable[str]) -> str:
    """Key of a sequence of texts; where one ends and the next begins counts."""
    return hashlib.sha256("\0".join(texts).encode()).hexdigest()[:_KEY_LENGTH]


def quantised(values: npt.ArrayLike, quantum: float) -> Ints:
    """Cells of the shifted grid that the values fall into; a NaN has a cell of its own."""
    x = np.floor(np.asarray(values, float) / quantum + _SHIFT)
    return np.where(np.isnan(x), _LEAST, np.clip(np.nan_to_num(x), -9e18, 9e18).astype(np.int64))


def _numbers(table: Table, names: str) -> Floats:
    """Columns (n, k) of a table as floats, NaN for nulls and for columns that are missing."""
    n = row_count_or_none(table)
    return np.stack([np.asarray(table[c], float) if c in table else np.full(n, np.nan) for c in names.split()], axis=1)


def _texts(table: Table, name: str) -> list[str]:
    if name not in table:
        return [""] * row_count_or_none(table)
    return ["" if v is None else str(v) for v in table[name]]


def _row_keys(texts: Sequence[Sequence[str]], cells: Ints) -> list[str]:
    """Key of each row from columns of texts and from its cells (n, k)."""
    raw = np.ascontiguousarray(cells).tobytes()
    width = cells.shape[1] * 8
    return [
        hashlib.sha256("\0".join(row).encode() + b"\0\0" + raw[i * width : (i + 1) * width]).hexdigest()[:_KEY_LENGTH]
        for i, row in enumerate(zip(*texts, strict=True))
    ]


# Columns of a spline, of a curve or of a surface by u and v, and the grids of their numbers.
_SPLINE_NUMBERS = {
    **{f"{way}{name}": 1.0 for name in ("degree", "periodic") for way in ("", "u_", "v_")},
    "u_poles": 1.0,
    **{f"{way}knots": ANGLE_QUANTUM for way in ("", "u_", "v_")},
    **{f"{way}multiplicities": 1.0 for way in ("", "u_", "v_")},
    "poles": LENGTH_QUANTUM,
    "weights": ANGLE_QUANTUM,
}


def _spline_keys(splines: Table, owner: str, count: int) -> list[str]:
    """Key of the spline of each of `count` rows, empty where it has none."""
    out = [""] * count
    if not row_count_or_none(splines):
        return out
    packed: list[list[bytes]] = []
    for name, quantum in _SPLINE_NUMBERS.items():
        if name not in splines:
            continue
        column = splines[name]
        if isinstance(column, Ragged):
            cells, ends = quantised(column.values, quantum), column.offsets
        else:
            cells, ends = quantised(column, quantum), np.arange(len(column) + 1)
        raw = cells.tobytes()
        packed.append([raw[8 * a : 8 * b] for a, b in zip(ends[:-1].tolist(), ends[1:].tolist(), strict=True)])
    for row, pieces in zip(np.asarray(splines[owner]).tolist(), zip(*packed, strict=True), strict=True):
        lengths = ",".join(str(len(p)) for p in pieces)
        out[row] = hashlib.sha256(lengths.encode() + b"".join(pieces)).hexdigest()[:_KEY_LENGTH]
    return out


def _of_basis(keys_of: Callable[[dict[int, str]], Keys], made_from: Callable[[Keys], dict[int, str]]) -> Keys:
    """Keys of rows that may be made from others of the same table: again for each such level."""
    made: dict[int, str] = {}
    while True:
        found = keys_of(made)
        again = made_from(found)
        if again == made:
            return found
        made = again


def _arc_keys(arcs: Table, splines: Table, offsets: dict[int, str]) -> list[str]:
    n = row_count_or_none(arcs)
    if n == 0:
        return []
    kinds, recognised = _texts(arcs, "kind"), _texts(arcs, "recognised_kind")
    spline = [offsets.get(i, s) for i, s in enumerate(_spline_keys(splines, "arc_no", n))]
    origin, x, z = (_numbers(arcs, f"{c}_x {c}_y {c}_z") for c in ("origin", "axis_x", "axis_z"))
    radii = _numbers(arcs, "radius radius2")
    along = np.isin(kinds, ["line", "polyline"])[:, None]  # parameters that are lengths
    interval = _numbers(arcs, "t0 t1")
    cells = np.hstack(
        [
            quantised(np.hstack([origin, radii, _numbers(arcs, "start_x start_y start_z end_x end_y end_z")]), 1e-6),
            quantised(np.hstack([x, z]), ANGLE_QUANTUM),
            np.where(along, quantised(interval, LENGTH_QUANTUM), quantised(interval, ANGLE_QUANTUM)),
        ]
    )
    return _row_keys([kinds, recognised, _texts(arcs, "provenance"), spline], cells)


def _surface_keys(
    surfaces: Table, splines: Table, loops: list[str], swept: dict[int, str]
) -> tuple[list[str], list[str]]:
    n = row_count_or_none(surfaces)
    if n == 0:
        return [], []
    kinds, recognised = _texts(surfaces, "kind"), _texts(surfaces, "recognised_kind")
    definition = _spline_keys(splines, "surface_no", n)
    definition = [swept.get(i, d) for i, d in enumerate(definition)]
    origin, x, z = (_numbers(surfaces, f"{c}_x {c}_y {c}_z") for c in ("origin", "axis_x", "axis_z"))
    radii, semi = _numbers(surfaces, "radius radius2"), _numbers(surfaces, "semi_angle")
    # Loops bound a domain; without any it is the parameter rectangle.  Facets have no function: their extent stands in.
    bare = np.array([not loop for loop in loops])[:, None]
    domain = np.where(bare, _numbers(surfaces, "u0 u1 v0 v1"), np.nan)
    facets = np.isin(kinds, ["facets"])[:, None]
    extent = np.where(facets, _numbers(surfaces, "area centroid_x centroid_y centroid_z"), np.nan)
    cells = np.hstack(
        [
            quantised(np.hstack([origin, radii, extent]), LENGTH_QUANTUM),
            quantised(np.hstack([x, z, semi, domain]), ANGLE_QUANTUM),
            np.asarray(_numbers(surfaces, "direct reversed"), np.int64),
        ]
    )
    content = _row_keys([kinds, recognised, _texts(surfaces, "provenance"), definition, loops], cells)

    def are(kind: str) -> Bools:
        return np.isin(recognised, [kind])[:, None]

    normal = unsigned(z, 1e-6)
    # A cone's apex and the side to which it opens; where the axis points away from it, turn axis and angle about.
    with np.errstate(divide="ignore", invalid="ignore"):
        apex = origin - np.where(are("cone"), radii[:, :1] / np.tan(semi), np.nan) * z
    direction = np.where(are("cone"), z * np.sign(semi), np.where(are("sphere"), np.nan, normal))
    foot = origin - np.sum(origin * z, axis=1, keepdims=True) * z  # the axis' nearest point to the frame's origin
    point = np.select([are("plane"), are("cylinder"), are("cone")], [origin * np.nan, foot, apex], origin)
    offset = np.where(are("plane"), np.sum(origin * normal, axis=1, keepdims=True), np.nan)
    radius = np.where(are("plane") | are("cone"), np.nan, radii)
    angle = np.where(are("cone"), np.abs(semi), np.nan)
    whole = np.isnan(origin[:, 0]) | ~np.isin(recognised, ["plane", "cylinder", "cone", "sphere", "torus"])
    texts = [(d or c) if w else "" for d, c, w in zip(definition, content, whole.tolist(), strict=True)]
    lengths = quantised(np.hstack([point, offset, radius]), LENGTH_QUANTUM)
    cells = np.hstack([lengths, quantised(np.hstack([direction, angle]), ANGLE_QUANTUM)])
    return content, _row_keys([recognised, texts], np.where(whole[:, None], _LEAST, cells))


def _made_from_keys(
    made: Table, owner: str, basis_arcs: list[str], basis_surfaces: Sequence[str] = ()
) -> dict[int, str]:
    """Key of what offset curves or swept surfaces are made from, by their ordinals in the column `owner`."""
    if not row_count_or_none(made):
        return {}
    arcs = np.asarray(made["basis_arc"]).tolist()
    surfaces = np.asarray(made["basis_surface"]).tolist() if "basis_surface" in made else [-1] * len(arcs)
    basis = [basis_arcs[a] if a >= 0 else basis_surfaces[s] for a, s in zip(arcs, surfaces, strict=True)]
    axis, distance = _numbers(made, "axis_x axis_y axis_z"), _numbers(made, "distance")
    cells = np.hstack([quantised(axis, ANGLE_QUANTUM), quantised(distance, LENGTH_QUANTUM)])
    return dict(zip(np.asarray(made[owner]).tolist(), _row_keys([basis], cells), strict=True))


def _loop_keys(shape: Shape, arcs: list[str]) -> list[str]:
    """Key of all trimming loops of each surface: sets of directed arcs, whichever the kernel begins with."""
    out = [""] * row_count_or_none(shape.surfaces)
    if not row_count_or_none(shape.coedges):
        return out
    surface, loop = (np.asarray(shape.coedges[c], np.int64) for c in ("surface_no", "loop_no"))
    backward = np.asarray(shape.coedges["reversed"], bool).tolist()
    arc_numbers = np.asarray(shape.coedges["arc_no"], np.int64).tolist()
    tokens = [arcs[a] + ("-" if b else "+") for a, b in zip(arc_numbers, backward, strict=True)]
    members: dict[tuple[int, int], list[str]] = {}
    for s, i, token in zip(surface.tolist(), loop.tolist(), tokens, strict=True):
        members.setdefault((s, i), []).append(token)
    of_surface: dict[int, list[str]] = {}
    for (s, _), directed in members.items():
        of_surface.setdefault(s, []).append(content_key(sorted(directed)))
    for s, loops in of_surface.items():
        out[s] = content_key(sorted(loops))
    return out


def _attribute_texts(attributes: Sequence[Attribute]) -> list[str]:
    return sorted(f"{name}={value!r} {unit or ''}" for name, value, unit in attributes)


def _assembly_keys(assemblies: Sequence[Assembly], parts: list[str]) -> list[str]:
    keys: dict[int, str] = {}
    for i in assembly_order(assemblies):
        a = assemblies[i]
        placed = np.array([e.parent_from_child[:3] for e in a.instances], float).reshape(-1, 3, 4)
        cells = np.hstack(
            [
                quantised(placed[:, :, :3], ANGLE_QUANTUM).reshape(-1, 9),
                quantised(placed[:, :, 3], LENGTH_QUANTUM).reshape(-1, 3),
            ]
        )
        rows = [(e.name, parts[e.child] if e.kind == "part" else keys[e.child], e.colour or "") for e in a.instances]
        instances = _row_keys(list(zip(*rows, strict=True)), cells) if rows else []
        keys[i] = content_key(
            [a.name, a.kind, *_attribute_texts(a.attributes), *instances, *(_joint_text(j) for j in a.joints)]
        )
    return [keys[i] for i in range(len(assemblies))]


def _joint_text(joint: Joint) -> str:
    limits = [np.nan if v is None else v for v in (joint.lower, joint.upper)]
    mimic = joint.mimic
    cells = [
        *quantised(joint.parent_from_joint[:3, 3], LENGTH_QUANTUM).tolist(),
        *quantised(joint.parent_from_joint[:3, :3], ANGLE_QUANTUM).ravel().tolist(),
        *quantised(joint.axis, ANGLE_QUANTUM).tolist(),
        *quantised(limits, LENGTH_QUANTUM if joint.kind == "prismatic" else ANGLE_QUANTUM).tolist(),
    ]
    follows = () if mimic is None else (mimic.joint, *quantised([mimic.factor, mimic.offset], ANGLE_QUANTUM).tolist())
    return repr((joint.name, joint.kind, joint.parent, joint.child, cells, follows))


def assembly_order(assemblies: Sequence[Assembly]) -> list[int]:
    """Assemblies with those that they contain before them.  Raises InputError where one contains itself."""
    from graphlib import CycleError, TopologicalSorter

    graph = {i: [e.child for e in a.instances if e.kind == "assembly"] for i, a in enumerate(assemblies)}
    try:
        return list(TopologicalSorter(graph).static_order())
    except CycleError as error:
        names = " in ".join(repr(assemblies[i].name) for i in error.args[1])
        raise InputError(f"an assembly of the file contains itself ({names}): mend the file") from error


# Shapes of a file that are one shape in several places: sharing that a flattened file has lost, found again.
#
# Their faces and edges, with kinds, areas, radii, lengths and convexities, come to lie on each other to round-off.

# Round-off of a file's digits: mm, and of the extent of a shape.
ROUND_OFF_MM = 2e-6
ROUND_OFF_SHARE = 1e-9


def share(model: Model) -> Model:
    """The model in which parts of congruent shapes have the first of these, placed by the motion.

    The frame of such a part becomes that of the first; shapes that no part has any more are dropped."""
    of, motion, like = _classes(model.shapes)
    if np.array_equal(of, np.arange(len(of))):
        return model
    left = np.unique(of)
    number = {int(shape): i for i, shape in enumerate(left)}

    def moved(one: Instance) -> Instance:
        if one.kind != "part":
            return one
        return replace(one, parent_from_child=one.parent_from_child @ motion[model.parts[one.child].shape])

    assemblies = tuple(replace(a, instances=tuple(map(moved, a.instances))) for a in model.assemblies)
    parts = []
    for part in model.parts:
        pmi = part.pmi
        if part.shape in like:
            there = {theirs: ours for ours, theirs in reversed(list(enumerate(like[part.shape].tolist())))}
            pmi = tuple(replace(p, surfaces=tuple((there[s], role) for s, role in p.surfaces)) for p in pmi)
        parts.append(replace(part, pmi=pmi, shape=number[int(of[part.shape])]))
    shapes = tuple(model.shapes[i] for i in left.tolist())
    return replace(model, shapes=shapes, parts=tuple(parts), assemblies=assemblies)


def _classes(shapes: Sequence[Shape]) -> tuple[Ints, Floats, dict[int, Ints]]:
    """The first shape that each (n,) is congruent to, the motions (n, 4, 4) from there, and of a shape that is not
    itself the first which of its faces each face of the first is."""
    of, motion = np.arange(len(shapes)), np.tile(np.eye(4), (len(shapes), 1, 1))
    like: dict[int, Ints] = {}
    firsts: dict[tuple[str, ...], list[int]] = {}
    elements: dict[int, Constituents] = {}
    for i, shape in enumerate(shapes):
        if not shape.surfaces or not shape.arcs or "fitted" in shape.surfaces["provenance"]:
            continue
        # What must be the same to the last digit: kinds, names and colours of faces, kinds and convexities of edges.
        alike = firsts.setdefault((shape.kind, *sorted(_face_kinds(shape)), *sorted(_edge_kinds(shape))), [])
        for first in alike:
            for k in (first, i):
                if k not in elements:
                    elements[k] = _elements(shapes[k])
            within = ROUND_OFF_MM + ROUND_OFF_SHARE * elements[first].extent
            found = next(motions(elements[first], elements[i], within, 20 * within), None)
            if found is not None:
                of[i], motion[i], like[i] = first, found[0], found[1][: len(shapes[first].surfaces["kind"])]
                break
        else:
            alike.append(i)
    return of, motion, like


def _elements(shape: Shape) -> Constituents:
    """Faces, then edges, of a shape."""
    s, a = shape.surfaces, shape.arcs
    surfaces, curves = surfaces_of(shape), curves_of(shape)
    n = len(surfaces)
    centroid, area = vectors(s, "centroid"), np.asarray(s["area"], float)
    # A free-form face has more to it than its area and its boundary: a point amid its domain.
    amid = surfaces.evaluate(np.arange(n), *surfaces.domain.reshape(-1, 2, 2).mean(axis=2).T).points
    amid[np.isin(surfaces.kind.astype(str), ANALYTIC_KINDS)] = np.nan
    amid = np.where(np.isnan(amid), centroid, amid)
    middle = curves.evaluate(np.arange(len(curves)), (curves.t0 + curves.t1) / 2)[0]
    length = np.asarray(a["length"], float)
    points = np.concatenate(
        [np.stack([centroid, amid, amid], axis=1), np.stack([middle, vectors(a, "start"), vectors(a, "end")], axis=1)]
    )
    sizes = np.concatenate(
        [
            np.column_stack([np.sqrt(area), surfaces.radius, surfaces.radius2]),
            np.column_stack([length, curves.radius, curves.radius2]),
        ]
    )
    weight = np.zeros((len(points), 3))
    weight[:n, 0], weight[:n, 1], weight[n:, 2] = area, area**2, length
    return Constituents([*_face_kinds(shape), *_edge_kinds(shape)], np.nan_to_num(sizes), points, weight)


def _face_kinds(shape: Shape) -> list[str]:
    s = shape.surfaces
    labels = [s[c] for c in ("kind", "name", "colour", "layer", "finish") if c in s]
    return ["face|" + "|".join(map(str, row)) for row in zip(*labels, strict=True)]


def _edge_kinds(shape: Shape) -> list[str]:
    return ["edge|" + "|".join(row) for row in zip(shape.arcs["kind"], shape.arcs["convexity"], strict=True)]
