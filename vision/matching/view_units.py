"""A predicted view as matchers see it: the visible arcs and surfaces of the model as units, drawn where the picture
should show them, with the relations among them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from relmodel.arrays import Floats, Ints
from relmodel.columns import Columns
from relmodel.store.rounding import round_columns
from vision.cameras.cameras import Camera
from vision.extraction.ellipses import fit_ellipses
from vision.extraction.relations import relate_neighbours
from vision.localisation.coverage import SurfaceMap
from vision.localisation.views import ViewArcs
from vision.matching.matching_parameters import ViewParameters
from vision.relations.relations import (
    BOUNDS,
    KINDS,
    Areas,
    Curves,
    Relations,
    find_middles,
    relate,
    relate_both_ways,
)

_DEFAULTS = ViewParameters()


@dataclass(frozen=True)
class ViewUnits:
    """Units of a view: its arcs by number, then its surfaces.

    points: columns of view_point without run and view; shift (points, 6): how the pose moves each; surface (n,): the
    scene's surface of each; visible_px (n,): how many pixels it shows; relations: columns of unit_relation without the
    set; arcs: how many units are arcs.
    """

    points: Columns
    shift: Floats
    surface: Ints
    visible_px: Floats
    relations: Columns
    arcs: int


def describe_view(
    view: ViewArcs,
    shift: Floats,
    camera: Camera,
    seen: SurfaceMap,
    p: ViewParameters = _DEFAULTS,
) -> ViewUnits:
    """Units of what a camera sees; shift (samples, 6): px by which a standard deviation of the pose along each axis of
    its covariance moves the view's samples along their normals."""
    some = _choose_samples(view, p)
    points = _points(view, some, np.linalg.norm(shift[some], axis=1), camera)
    surface, areas = _surfaces(seen, p)
    curves = _curves(points, len(view.kind), p)
    relations = Relations.stack(
        [
            relate(curves, areas, p.relations),
            _bounds(points, curves, areas, surface, seen, p),
            *_neighbours(curves, areas, surface, seen),
        ]
    )
    return ViewUnits(
        points,
        shift[some],
        surface,
        areas.area,
        round_columns(
            "unit_relation",
            {
                "kind": np.array(KINDS, object)[relations.kind],
                "unit_a": relations.a,
                "unit_b": relations.b,
                "distance": relations.distance,
                "distance_sigma": relations.distance_sigma,
                "angle": relations.angle,
                "angle_sigma": relations.angle_sigma,
            },
        ),
        len(view.kind),
    )


def _choose_samples(view: ViewArcs, p: ViewParameters) -> Ints:
    """Samples every few px along the arcs, and both ends of each."""
    step = np.floor(np.cumsum(view.samples.length_px) / p.spacing_px)
    ends = (np.diff(view.run, prepend=-1) != 0) | (np.diff(view.run, append=-1) != 0)
    return np.flatnonzero((np.diff(step, prepend=-1) > 0) | ends)


def _points(view: ViewArcs, some: Ints, sigma: Floats, camera: Camera) -> Columns:
    ideal, direction = view.samples.pixel[some], view.samples.direction[some]
    pixel = camera.distort(camera.normalise(ideal))
    ahead = camera.distort(camera.normalise(ideal + 0.5 * direction))
    back = camera.distort(camera.normalise(ideal - 0.5 * direction))
    way = ahead - back
    way /= np.maximum(np.linalg.norm(way, axis=1), 1e-12)[:, None]
    return round_columns(
        "view_point",
        {
            "view_arc_no": view.run[some],
            "point_no": np.arange(len(some)),
            "x": pixel[:, 0],
            "y": pixel[:, 1],
            "direction_x": way[:, 0],
            "direction_y": way[:, 1],
            "sigma": sigma,
        },
    )


def _curves(points: Columns, arcs: int, p: ViewParameters) -> Curves:
    run, x, y, sigma = (np.asarray(points[name]) for name in ("view_arc_no", "x", "y", "sigma"))
    offsets = np.searchsorted(run, np.arange(arcs + 1))
    # A run of one sample is a point: half a px either way makes it a curve.
    lone = np.flatnonzero(np.diff(offsets) == 1)
    at = offsets[lone]
    half = 0.5 * np.stack([np.asarray(points["direction_x"]), np.asarray(points["direction_y"])], axis=1)[at]
    x, y, sigma, run = (np.insert(c, at, c[at]) for c in (x, y, sigma, run))
    offsets = np.searchsorted(run, np.arange(arcs + 1))
    first = offsets[lone]
    x[first], y[first] = x[first] - half[:, 0], y[first] - half[:, 1]
    x[first + 1], y[first + 1] = x[first + 1] + half[:, 0], y[first + 1] + half[:, 1]
    step = np.hypot(np.diff(x), np.diff(y)) * (np.diff(run) == 0)
    length = np.bincount(run[1:], step, arcs).astype(float)
    across = np.bincount(run, sigma, arcs) / np.maximum(np.bincount(run, minlength=arcs), 1)
    counts = np.diff(offsets)
    long = np.flatnonzero(counts >= 6)
    of_long = np.isin(np.repeat(np.arange(arcs), counts), long)
    fitted = fit_ellipses(x[of_long], y[of_long], np.ones(int(of_long.sum())), counts[long])
    girth = 2 * np.pi * np.sqrt(0.5 * (fitted.major**2 + fitted.minor**2))
    bent = (length[long] >= p.least_turn * girth) & (np.sqrt(fitted.square) <= p.conic_px)  # NaN is neither
    centre_x, centre_y, centre_sigma, radius = (np.full(arcs, np.nan) for _ in range(4))
    round_ = long[bent]
    centre_x[round_], centre_y[round_] = fitted.centre_x[bent], fitted.centre_y[bent]
    centre_sigma[round_] = np.hypot(across[round_], p.conic_px) * girth[bent] / length[round_]
    circular = bent & (fitted.minor >= p.roundest * fitted.major)
    radius[long[circular]] = np.sqrt(fitted.major * fitted.minor)[circular]
    return Curves(
        offsets=offsets.astype(np.int64),
        x=x,
        y=y,
        sigma=across,
        end_sigma=np.full(arcs, p.spacing_px),
        angle_sigma=across / np.maximum(length, 1.0),
        salience=length,
        centre_x=centre_x,
        centre_y=centre_y,
        centre_sigma=centre_sigma,
        radius=radius,
        radius_sigma=centre_sigma,
    )


def _surfaces(seen: SurfaceMap, p: ViewParameters) -> tuple[Ints, Areas]:
    """Surfaces that show at least `p.least_surface_px`, and the outlines of what they show."""
    import cv2

    shown = seen.surface.ravel()
    used = shown >= 0
    area = np.bincount(shown[used], seen.rays.weight.ravel()[used])
    surface = np.flatnonzero(area >= p.least_surface_px)
    weight = seen.rays.weight.ravel()[used]
    pixel = seen.rays.pixel.reshape(-1, 2)[used]
    moments = np.stack([np.bincount(shown[used], weight * pixel[:, i]) for i in (0, 1)], axis=1)[surface]
    centre = np.asarray(moments / area[surface][:, None], float)
    rings: list[npt.NDArray[np.integer]] = []
    owner: list[int] = []
    row, column = np.nonzero(seen.surface >= 0)
    order = np.argsort(seen.surface[row, column], kind="stable")
    row, column = row[order], column[order]
    bounds = np.searchsorted(seen.surface[row, column], np.stack([surface, surface + 1]))
    for number, (start, end) in enumerate(bounds.T.tolist()):
        rows, columns = row[start:end], column[start:end]
        top, left = int(rows.min()), int(columns.min())
        mask = np.zeros((int(rows.max()) - top + 1, int(columns.max()) - left + 1), np.uint8)
        mask[rows - top, columns - left] = 1
        found, _ = cv2.findContours(mask, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_SIMPLE)
        rings += [ring[:, 0, ::-1] + np.array([top, left]) for ring in found]
        owner += [number] * len(found)
    offsets = np.concatenate([[0], np.cumsum([len(ring) for ring in rings])]).astype(np.int32)
    cells = np.concatenate(rings) if rings else np.zeros((0, 2), np.int64)
    outline = seen.rays.pixel[cells[:, 0], cells[:, 1]]
    areas = Areas(
        area=area[surface].astype(float),
        centroid_x=centre[:, 0],
        centroid_y=centre[:, 1],
        sigma=np.full(len(surface), float(seen.rays.step)),
        ring_region=np.array(owner, np.int32),
        ring_offsets=offsets,
        x=outline[:, 0],
        y=outline[:, 1],
    )
    return surface, areas


def _neighbours(curves: Curves, areas: Areas, surface: Ints, seen: SurfaceMap) -> list[Relations]:
    """Surfaces that border on each other in the picture, and those that others surround."""
    number = np.full(int(seen.surface.max(initial=0)) + 2, -1, np.int32)
    number[surface] = np.arange(len(surface))
    labels = number[seen.surface]  # the last of `number` stands for none
    inside = np.ones(len(surface), bool)
    for rim in (labels[0], labels[-1], labels[:, 0], labels[:, -1]):
        inside[rim[rim >= 0]] = False
    return relate_neighbours(labels, inside, len(curves), find_middles(curves, areas), step=float(seen.rays.step))


def _bounds(
    points: Columns, curves: Curves, areas: Areas, surface: Ints, seen: SurfaceMap, p: ViewParameters
) -> Relations:
    """Arcs and the surfaces beside them, with the length of arc that borders each."""
    run = np.asarray(points["view_arc_no"])
    place = np.stack([np.asarray(points["x"]), np.asarray(points["y"])], axis=1)
    normal = np.stack([-np.asarray(points["direction_y"]), np.asarray(points["direction_x"])], axis=1)
    number = np.full(int(seen.surface.max(initial=0)) + 2, -1)
    number[surface] = np.arange(len(surface))
    count = max(len(surface), 1)
    keys = []
    for away in (p.side_px, -p.side_px):
        bordering = number[seen.surface_at(place + away * normal)]  # the last of `number` stands for none
        keys.append((run * count + bordering)[bordering >= 0])
    key, times = np.unique(np.concatenate(keys), return_counts=True)
    arc, area = key // count, key % count
    bearing, spread = find_middles(curves, areas).bearing(
        np.concatenate([arc, len(curves) + area]), np.concatenate([len(curves) + area, arc])
    )
    return relate_both_ways(BOUNDS, arc, len(curves) + area, p.spacing_px * times, p.spacing_px, bearing, spread)
