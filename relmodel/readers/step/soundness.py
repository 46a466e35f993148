"""Whether a boundary representation agrees with itself and with what its file says of it.

A file with a wrong digit often loads without an error; the arcs then leave their surfaces, the loops gape, or volume
and area are not those that its writer noted (validation properties of ISO 10303).
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from relmodel.geometry.curves import vectors
from relmodel.geometry.pcurves import Pcurves
from relmodel.geometry.surfaces import ANALYTIC_KINDS, Surfaces
from relmodel.model.measures import curves_of, surfaces_of
from relmodel.model.model import LoadedModel, Shape
from relmodel.model.trimmed_faces import pcurve_of

Array = npt.NDArray[np.float64]

# Writers close their bodies far better than this: 0.004 mm is the worst that was seen.
GAP_MM = 0.1
GAP_SHARE = 1e-4  # of the diagonal of the shape's box
# Some writers note the volume and area of a mesh: 0.0004 off is the worst that was seen.
VALIDATION_SHARE = 0.005

# Where along an arc it is held against its surfaces.
_SHARES = np.linspace(0.0, 1.0, 5)


def is_finite(model: LoadedModel) -> bool:
    """Whether all sizes and boxes are numbers that a store can hold."""
    names = ("x0", "y0", "z0", "x1", "y1", "z1")
    return all(
        np.isfinite(np.asarray(table[name], float)).all()
        for shape in model.shapes
        for table, size in ((shape.surfaces, "area"), (shape.arcs, "length"))
        for name in (size, *names)
    )


def contradiction(model: LoadedModel) -> str | None:
    """What a model of exact geometry contradicts itself in, as a clause; None where it is sound."""
    for shape in model.shapes:
        if shape.kind in ("wire", "mesh"):  # neither has loops on exact surfaces
            continue
        found = _of_shape(shape)
        if found:
            return found
    for part in model.parts:
        shape = model.shapes[part.shape]
        measured = {"validation volume": shape.volume, "validation area": float(np.sum(shape.surfaces["area"]))}
        for name, value, unit in part.attributes:
            ours = measured.get(name)
            if (
                ours is not None
                and not isinstance(value, str)
                and not abs(value - ours) <= VALIDATION_SHARE * abs(ours)
            ):
                what = name.removeprefix("validation ")
                return f"it says that the {what} of {part.name!r} is {value:.6g} {unit}, and it is {ours:.6g}"
    return None


def _of_shape(shape: Shape) -> str | None:
    low, high = (np.array([fold(shape.arcs[f"{c}{i}"]) for c in "xyz"]) for i, fold in ((0, np.min), (1, np.max)))
    bound = max(GAP_MM, GAP_SHARE * float(np.linalg.norm(high - low)))
    gap = float(_loop_gaps(shape).max(initial=0.0))
    if not gap <= bound:
        return f"the boundary of a face gapes by {gap:.3g} mm"
    gap = float(_surface_gaps(shape).max(initial=0.0))
    if not gap <= bound:
        return f"an edge leaves its surface by {gap:.3g} mm"
    free = sum(one == "free" for one in shape.arcs["convexity"])
    if shape.kind == "solid" and free:
        return f"a solid is open along {free} edges"
    return None


def _loop_gaps(shape: Shape) -> Array:
    """Distance from the end of each coedge to the start of the next one of its loop (n,), mm."""
    coedges = shape.coedges
    arc, back = coedges["arc_no"], coedges["reversed"][:, None]
    start, end = vectors(shape.arcs, "start")[arc], vectors(shape.arcs, "end")[arc]
    from_, to = np.where(back, end, start), np.where(back, start, end)
    first = np.flatnonzero(coedges["coedge_no"] == 0)
    following = np.arange(1, len(arc) + 1)
    following[np.append(first[1:], len(arc)) - 1] = first
    return np.asarray(np.linalg.norm(from_[following] - to, axis=1))


def _surface_gaps(shape: Shape) -> Array:
    """Greatest distance of each coedge from its surface (n,), mm; 0 where a free-form face has no pcurve of it.

    An edge without length lies in a point of its surface all along its pcurve: the kernel takes edges for such ones
    whose curve cannot be read.
    """
    curves, surfaces = curves_of(shape), surfaces_of(shape)
    arc, surface = shape.coedges["arc_no"], shape.coedges["surface_no"]
    pcurve = pcurve_of(shape.coedges, shape.pcurves)
    analytic = np.isin(surfaces.kind[surface].astype(str), ANALYTIC_KINDS)
    drawn = np.flatnonzero(pcurve >= 0)
    gaps = np.zeros(len(arc))
    for share in _SHARES:
        t = curves.t0 + share * (curves.t1 - curves.t0)
        points = curves.evaluate(np.arange(len(curves)), t)[0][arc]
        gaps[analytic] = np.maximum(gaps[analytic], _distance(surfaces, surface[analytic], points[analytic]))
        uv = Pcurves(shape.pcurves).evaluate(pcurve[drawn], t[arc[drawn]])[0]
        on = surfaces.evaluate(surface[drawn], uv[:, 0], uv[:, 1]).points
        gaps[drawn] = np.maximum(gaps[drawn], np.linalg.norm(on - points[drawn], axis=1))
    return gaps


def _distance(surfaces: Surfaces, row: npt.NDArray[np.int64], points: Array) -> Array:
    """Distance of the points (n, 3) from the unbounded analytic surfaces `row` (n,), mm."""
    d = points - surfaces.origin[row]
    height = np.einsum("nd,nd->n", d, surfaces.z[row])
    reach = np.linalg.norm(d - height[:, None] * surfaces.z[row], axis=1)
    radius, tube, angle = surfaces.radius[row], surfaces.radius2[row], surfaces.semi_angle[row]
    kind = surfaces.kind[row].astype(str)
    off = np.select(
        [kind == "plane", kind == "cylinder", kind == "cone", kind == "sphere"],
        [
            height,
            reach - radius,
            # Beyond the apex the radius is negative and the surface its mirror image.
            (reach - np.abs(radius + height * np.tan(angle))) * np.cos(angle),
            np.hypot(reach, height) - radius,
        ],
        # A tube wider than its ring reaches across the axis.
        np.minimum(np.abs(np.hypot(reach - radius, height) - tube), np.abs(np.hypot(reach + radius, height) - tube)),
    )
    return np.asarray(np.abs(off))
