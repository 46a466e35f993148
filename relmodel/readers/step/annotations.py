"""Drawn annotations of a STEP file (AP242): polylines of letters, leaders and frames, from its text.

They are kept as a supplemental part with an arc for each line.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from relmodel.arrays import Floats
from relmodel.geometry.curves import box_columns, vector_columns
from relmodel.model.model import Instance, Model, Part, Table
from relmodel.readers.splines import polyline, spline_columns
from relmodel.readers.step import supplemental as step_supplemental
from relmodel.readers.step.contained import Findings
from relmodel.readers.step.part21_instances import Instances, Reference, references

_SET, _CURVES, _MOVED = "TESSELLATED_GEOMETRIC_SET", "TESSELLATED_CURVE_SET", "REPOSITIONED_TESSELLATED_ITEM"


def with_annotations(model: Model, instances: Instances, findings: Findings) -> Model:
    """The model with the lines that its file draws, if any, as a part of their own that stands in the root."""
    poses: dict[int, Floats] = {
        curves: pose
        for number, pose in findings.each("the place of an annotation", instances.of(_SET), partial(_pose, instances))
        if pose is not None
        for curves in references(instances.parameters(number, _SET))
    }
    sets = findings.each("an annotation", instances.of(_CURVES), lambda n: _lines(instances, n, poses.get(n)))
    lines = [line * model.unit_mm for some in sets for line in some]
    if not lines:
        return model
    root = model.assemblies[model.root]
    name = f"{root.name} annotation"
    part = Part(name, name, len(model.shapes), supplemental=True)
    instance = Instance(name, "part", len(model.parts), np.eye(4))
    assemblies = list(model.assemblies)
    assemblies[model.root] = replace(root, instances=(*root.instances, instance))
    shape = step_supplemental.wire(*_arcs(lines))
    return replace(model, shapes=(*model.shapes, shape), parts=(*model.parts, part), assemblies=tuple(assemblies))


def _lines(instances: Instances, number: int, pose: Floats | None) -> list[Floats]:
    """Points (n, 3) along each line of a set of curves, in the unit of the file, moved as the set is."""
    parameters = [p for p in instances.parameters(number, _CURVES) if not isinstance(p, str)]
    if len(parameters) != 2 or not isinstance(parameters[0], Reference) or not isinstance(parameters[1], list):
        return []
    given = [p for p in instances.parameters(parameters[0], "COORDINATES_LIST") if isinstance(p, list)]
    points = _numbers(given[0], 3) if given else None
    if points is None:
        return []
    if pose is not None:
        points = points @ pose[:3, :3].T + pose[:3, 3]
    out = []
    for strip in parameters[1]:
        row = [i - 1 for i in strip if isinstance(i, int)] if isinstance(strip, list) else []
        row = [i for n, i in enumerate(row) if n == 0 or i != row[n - 1]]
        if len(row) > 1 and min(row) >= 0 and max(row) < len(points):
            line = points[row]
            step = np.linalg.norm(np.diff(line, axis=0), axis=1)
            line = line[np.append(True, step > 0)]
            if len(line) > 1:
                out.append(line)
    return out


def _pose(instances: Instances, number: int) -> tuple[int, Floats | None]:
    """A repositioned item, and where it is put (4, 4); None where it stays."""
    places = list(references(instances.parameters(number, _MOVED)))
    if not places:
        return number, None
    frame = [
        _numbers([one[-1]], 3)
        for at in list(references(instances.parameters(places[0], "AXIS2_PLACEMENT_3D")))
        if (one := instances.parameters(at, "CARTESIAN_POINT") or instances.parameters(at, "DIRECTION"))
    ]
    origin = frame[0] if frame else None
    if origin is None:
        return number, None
    z, x = (frame[i] if len(frame) > i else None for i in (1, 2))
    z = np.array([[0.0, 0, 1]]) if z is None else z / np.linalg.norm(z)
    x = np.eye(3)[[np.argmin(np.abs(z[0]))]] if x is None else x
    x = x - (x @ z.T) * z
    x /= np.linalg.norm(x)
    out = np.eye(4)
    out[:3, 0], out[:3, 1], out[:3, 2], out[:3, 3] = x[0], np.cross(z[0], x[0]), z[0], origin[0]
    return number, out


def _numbers(rows: object, width: int) -> Floats | None:
    """An array (n, width) of what the text lists; None where it is something else."""
    try:
        out = np.asarray(rows, float)
    except (TypeError, ValueError):
        return None
    return out if out.ndim == 2 and out.shape[1] == width and np.isfinite(out).all() else None


def _arcs(lines: list[Floats]) -> tuple[Table, Table]:
    """Columns of arcs and of their splines: polylines, whose parameter is the length along them."""
    count = len(lines)
    knots = [np.append(0.0, np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))) for line in lines]
    length = np.array([k[-1] for k in knots])
    none = np.full(count, np.nan)
    arcs: Table = {
        "kind": np.full(count, "polyline", object),
        "recognised_kind": np.full(count, "polyline", object),
        **vector_columns("origin", np.full((count, 3), np.nan)),
        **vector_columns("axis_x", np.full((count, 3), np.nan)),
        **vector_columns("axis_z", np.full((count, 3), np.nan)),
        "radius": none,
        "radius2": none,
        "t0": np.zeros(count),
        "t1": length,
        **vector_columns("start", np.array([line[0] for line in lines])),
        **vector_columns("end", np.array([line[-1] for line in lines])),
        "length": length,
        **box_columns(np.array([[*line.min(axis=0), *line.max(axis=0)] for line in lines])),
        "provenance": ["exact"] * count,
        "residual": none,
        "surface_a": np.full(count, -1),
        "surface_b": np.full(count, -1),
        "convexity": ["free"] * count,
        "angle": none,
    }
    drawn = [polyline(*line) for line in zip(knots, lines, strict=True)]
    return arcs, {"arc_no": np.arange(count), **spline_columns(drawn)}
