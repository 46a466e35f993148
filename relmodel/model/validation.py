"""Whether a model agrees with itself and with what its file says of it: findings, never a refusal by themselves.

One rule serves loading and `relmodel check`. Each coedge has a tolerance: how far its arc may lie off the surface and
end off the start of the next, mm. It is 0.01 mm or, where that is more, what the CAD kernel states for the edge and its
ends (ISO 10303-42 leaves the accuracy to the sender; the kernel calls an edge valid within its tolerance), but not more
than a tenth of a millimetre or 1e-4 of the shape. What exceeds it is a finding, and the tolerance is then what was
measured, so that `check` (`queries/check/loop_open.sql`, `arc_off_surface.sql`) lists what is worse than it was on
loading. Arcs and surfaces that were fitted to a mesh have what was measured from the first."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from relmodel.arrays import Floats, Ints
from relmodel.geometry.curves import BOX, vectors
from relmodel.geometry.surfaces import ANALYTIC_KINDS, Pcurves, distances
from relmodel.model.content_keys import row_count_or_none
from relmodel.model.measures import curves_of, pcurve_of, surfaces_of
from relmodel.model.model import Finding, Model, Part, Shape

LEAST_TOLERANCE_MM = 0.01
MOST_TOLERANCE_MM, MOST_TOLERANCE_SHARE = 0.1, 1e-4  # share: of the diagonal of the shape's box
# Some writers note the volume and area of a mesh: 0.0004 off is the worst that was seen.
VALIDATION_SHARE = 0.005
# What numbers that are equal but for round-off may differ by, mm.
_ROUND_OFF_MM = 1e-5
# Where along an arc its distance from its surfaces is measured.
_SHARES = np.linspace(0.0, 1.0, 5)
# Columns that the store has of every arc and surface.
_ALWAYS = {
    "arcs": ("t0", "t1", "length", *BOX, *(f"{end}_{c}" for end in ("start", "end") for c in "xyz")),
    "surfaces": ("area", *BOX, *(f"centroid_{c}" for c in "xyz")),
}


def is_finite(model: Model) -> bool:
    """Whether all sizes, boxes and places are numbers that a store can hold."""
    columns = (
        getattr(s, table)[name]
        for s in model.shapes
        for table, names in _ALWAYS.items()
        if row_count_or_none(getattr(s, table))
        for name in names
    )
    poses = (one.parent_from_child for assembly in model.assemblies for one in assembly.instances)
    return all(np.isfinite(np.asarray(values, float)).all() for values in (*columns, *poses))


def validated(model: Model) -> Model:
    """The model with what is found of its shapes and parts, and with the tolerances of their coedges."""
    shapes = tuple(_validated_shape(shape) for shape in model.shapes)
    parts = tuple(replace(part, findings=(*part.findings, *_of_part(part, shapes[part.shape]))) for part in model.parts)
    return replace(model, shapes=shapes, parts=parts)


def _of_part(part: Part, shape: Shape) -> list[Finding]:
    """Volume and area that the file states (validation properties of ISO 10303) and that are not the shape's."""
    area = float(np.sum(np.asarray(shape.surfaces["area"], float))) if shape.surfaces else 0.0
    found = []
    for name, value, unit in part.attributes:
        measured = {"validation volume": shape.volume, "validation area": area}.get(name)
        if measured is None or isinstance(value, str):
            continue
        bound = VALIDATION_SHARE * abs(measured)
        if not abs(value - measured) <= bound:
            what = name.removeprefix("validation ")
            said = f"the file says that the {what} of {part.name!r} is {value:.6g} {unit}, and it is {measured:.6g}"
            found.append(Finding(f"stated_{what}", said, abs(value - measured), bound, unit))
    return found


def _validated_shape(shape: Shape) -> Shape:
    if not row_count_or_none(shape.coedges):
        return shape
    try:
        gap, off = _loop_gaps(shape), _surface_gaps(shape)
    except Exception as error:  # what cannot be measured does not cost a load either
        said = f"the edges of a shape cannot be compared with its faces ({type(error).__name__}: {error})"
        unknown = np.full(row_count_or_none(shape.coedges), np.nan)
        finding = Finding("not_validated", said)
        return replace(shape, coedges=shape.coedges | {"tolerance": unknown}, findings=(*shape.findings, finding))
    bound = _bounds(shape)
    measured = np.maximum(gap, off) + _ROUND_OFF_MM
    findings = list(shape.findings)
    if shape.kind != "mesh":
        said = "the boundary of a face has a gap of {:.3g} mm, beyond its tolerance of {:.3g} mm"
        findings += _beyond("open_loop", said, gap, bound, shape)
        said = "an edge lies {:.3g} mm off its face, beyond its tolerance of {:.3g} mm"
        findings += _beyond("edge_off_face", said, off, bound, shape)
        free = sum(one == "free" for one in shape.arcs["convexity"])
        if shape.kind == "solid" and free:
            findings.append(Finding("open_solid", f"a solid is open along {free} edges", float(free), 0.0))
    coedges = shape.coedges | {"tolerance": np.where(measured > bound, measured, bound)}
    return replace(shape, coedges=coedges, findings=tuple(findings))


def _bounds(shape: Shape) -> Floats:
    """What the loop gap behind each coedge (n,), and its distance from its surface, may be, mm."""
    arc = np.asarray(shape.coedges["arc_no"], np.int64)
    low, high = (np.array([fold(shape.arcs[f"{c}{i}"]) for c in "xyz"]) for i, fold in ((0, np.min), (1, np.max)))
    most = max(MOST_TOLERANCE_MM, MOST_TOLERANCE_SHARE * float(np.linalg.norm(high - low)))
    stated = np.asarray(shape.arcs.get("tolerance", np.zeros(len(shape.arcs["kind"]))), float)[arc]
    return np.asarray(np.clip(np.maximum(stated, stated[_following(shape)]), LEAST_TOLERANCE_MM, most))


def _beyond(kind: str, said: str, values: Floats, bounds: Floats, shape: Shape) -> list[Finding]:
    """A finding for each arc with a value (n,) of a coedge beyond its bound (n,), that of the worst."""
    worst: dict[int, int] = {}
    for i in np.flatnonzero(~(values <= bounds)).tolist():
        arc = int(shape.coedges["arc_no"][i])
        if arc not in worst or values[i] > values[worst[arc]]:
            worst[arc] = i
    found = []
    for arc, i in sorted(worst.items()):
        value, bound, face = float(values[i]), float(bounds[i]), int(shape.coedges["surface_no"][i])
        found.append(Finding(kind, said.format(value, bound), value, bound, "mm", face, arc))
    return found


def _following(shape: Shape) -> Ints:
    """Row of the coedge that follows each (n,) in its loop."""
    coedge_no = np.asarray(shape.coedges["coedge_no"], np.int64)
    first = np.flatnonzero(coedge_no == 0)
    following = np.arange(1, len(coedge_no) + 1)
    following[np.append(first[1:], len(coedge_no)) - 1] = first
    return following


def _loop_gaps(shape: Shape) -> Floats:
    """Distance from the end of each coedge to the start of the next one of its loop (n,), mm."""
    coedges = shape.coedges
    arc, back = coedges["arc_no"], coedges["reversed"][:, None]
    start, end = vectors(shape.arcs, "start")[arc], vectors(shape.arcs, "end")[arc]
    from_, to = np.where(back, end, start), np.where(back, start, end)
    return np.asarray(np.linalg.norm(from_[_following(shape)] - to, axis=1))


def _surface_gaps(shape: Shape) -> Floats:
    """Greatest distance of each coedge from its surface (n,), mm; 0 where a free-form face has no pcurve of it.

    An edge without length lies in a point all along its pcurve: as such the kernel takes edges of unreadable curves."""
    curves, surfaces = curves_of(shape), surfaces_of(shape)
    arc, surface = shape.coedges["arc_no"], shape.coedges["surface_no"]
    pcurves = row_count_or_none(shape.pcurves)
    pcurve = pcurve_of(shape.coedges, shape.pcurves) if pcurves else np.full(len(arc), -1)
    analytic = np.isin(surfaces.kind[surface].astype(str), ANALYTIC_KINDS)
    drawn = np.flatnonzero(pcurve >= 0)
    gaps = np.zeros(len(arc))
    for share in _SHARES:
        t = curves.t0 + share * (curves.t1 - curves.t0)
        points = curves.evaluate(np.arange(len(curves)), t)[0][arc]
        off = distances(surfaces, surface[analytic], points[analytic], np.zeros((len(points[analytic]), 2)), 0.0)
        gaps[analytic] = np.maximum(gaps[analytic], off)
        if not len(drawn):
            continue
        uv = Pcurves(shape.pcurves).evaluate(pcurve[drawn], t[arc[drawn]])[0]
        on = surfaces.evaluate(surface[drawn], uv[:, 0], uv[:, 1]).points
        gaps[drawn] = np.maximum(gaps[drawn], np.linalg.norm(on - points[drawn], axis=1))
    return gaps
