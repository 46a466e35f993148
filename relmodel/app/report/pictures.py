"""What a report draws of a run: its pictures with what was found over them, and plots of its rows."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import cv2
import numpy as np
from markupsafe import Markup
from sqlalchemy import Connection

from relmodel.app.report.page import PageTable, cell
from relmodel.arrays import Floats
from relmodel.drawing.draw import (
    Edge,
    Seen,
    course,
    courses,
    data_uri,
    ellipse,
    ellipse_points,
    histogram,
    path_data,
    residual_map,
)
from relmodel.geometry.transforms import inverse, matrices, rigid, rotation_matrix, rotation_vector
from relmodel.store import Store

_ELLIPSES = 24  # a camera: as many as one still tells apart
_REGION_DETAIL_PX = 1.5


@dataclass(frozen=True)
class RunPicture:
    """A picture of a page: its camera, what it is called, its size in px, the drawing, how many things it shows."""

    camera: str
    file_name: str
    width: int
    height: int
    uri: str | None
    drawing: Markup
    ellipse_scale: float


def read_pictures(store: Store, connection: Connection, run: int, seen: Sequence[Seen]) -> list[RunPicture]:
    """A run's pictures and drawings; ids: `cN-iM` (image arc M of picture N), `cN-mM` (model arc), `cN-rM` (region)."""
    fates = _fates(store, connection, run)
    surfaces: dict[tuple[str, int], list[str]] = defaultdict(list)
    for r in store.rows(connection, "report/region_surfaces", run_id=run):
        surfaces[r.camera, int(r.region_no)].append(f"surface {r.surface_no} of {r.path}")
    spread = pose_spread(store, connection, run)
    unexplained = store.rows(connection, "report/unexplained", run_id=run)
    alien = {(r.camera, int(r.image_arc_no)) for r in unexplained if r.image_arc_no is not None}
    patches = {(r.camera, int(r.region_no)) for r in unexplained if r.region_no is not None}
    out = []
    for number, it in enumerate(seen):
        picture, name = it.row, it.row.camera
        drawn = [] if picture.extraction_id is None else _regions(store, connection, number, picture, surfaces, patches)
        drawn += [_model_arc(number, edge, fates) for edge in it.edges]
        if picture.extraction_id is not None:
            drawn += _image_arcs(store, connection, number, picture, fates, alien)
        scale = 1.0
        if name in spread:
            scale, ellipses = _ellipses(*spread[name])
            drawn += ellipses
        uri = None if it.image is None else data_uri(it.image)
        drawing = Markup("").join(drawn)
        out.append(RunPicture(name, picture.file_name, picture.width, picture.height, uri, drawing, scale))
    return out


def _path(identity: str, classes: str, data: str, title: str) -> Markup:
    return Markup('<path id="{}" class="{}" d="{}"><title>{}</title></path>').format(
        identity, classes, data, cell(title)
    )


def _fates(store: Store, connection: Connection, run: int) -> dict[tuple[str, str, int], str]:
    """What became of image arcs and model arcs, in words, by camera, `i` or `m`, and number."""
    out: dict[tuple[str, str, int], str] = {}
    for r in store.rows(connection, "report/matched", run_id=run):
        words = f"matched to the {r.kind} arc {r.view_arc_no} of {r.path}, residual {r.residual:.2f} px"
        out[r.camera, "i", int(r.image_arc_no)] = words
        out[r.camera, "m", int(r.view_arc_no)] = f"matched to image arc {r.image_arc_no}, residual {r.residual:.2f} px"
    for r in store.rows(connection, "report/rejected", run_id=run):
        near = "" if r.residual is None else f"; nearest model arc {r.view_arc_no}, residual {r.residual:.2f} px"
        out[r.camera, "i", int(r.image_arc_no)] = f"rejected: {r.reason}{near}"
    return out


def _image_arcs(
    store: Store,
    connection: Connection,
    number: int,
    picture: Any,
    fates: dict[tuple[str, str, int], str],
    alien: set[tuple[str, int]],
) -> list[Markup]:
    points = store.columns(connection, "report/image_arc_courses", extraction_id=picture.extraction_id)
    drawn = courses(points["image_arc_no"], points["x"], points["y"])
    out = []
    for a in store.rows(connection, "report/image_arcs", extraction_id=picture.extraction_id):
        no = int(a.image_arc_no)
        fate = fates.get((picture.camera, "i", no), "")
        word = fate.partition(" ")[0].rstrip(":")
        ends = np.array([[a.start_x, a.start_y], [a.end_x, a.end_y]])
        data = path_data(ends) if a.kind == "line" else drawn.get(no, path_data(ends)) + ("Z" if a.closed else "")
        title = f"image arc {no} ({a.topography}, {a.kind}, {a.length:.0f} px) {fate}"
        classes = f"arc {a.kind} {word or 'unjudged'}" + (" unexplained" if (picture.camera, no) in alien else "")
        out.append(_path(f"c{number}-i{no}", classes, data, title))
    return out


def _model_arc(number: int, edge: Edge, fates: dict[tuple[str, str, int], str]) -> Markup:
    a, no = edge.row, edge.number
    of = f"arc {a.arc_no}" if a.surface_no is None else f"silhouette of surface {a.surface_no}"
    fate = fates.get((a.camera, "m", no), "not matched")
    title = f"{a.path}, {of} ({a.kind}, {a.length:.0f} px): {fate}"
    met = "met" if (a.camera, "m", no) in fates else "unmet"
    classes = f"model {a.kind} {met}" + (f" state-{edge.state}" if edge.state else "")
    return _path(f"c{number}-m{no}", classes, course(edge.points), title + (f"; {edge.state}" if edge.state else ""))


def _regions(
    store: Store,
    connection: Connection,
    number: int,
    picture: Any,
    surfaces: dict[tuple[str, int], list[str]],
    alien: set[tuple[str, int]],
) -> list[Markup]:
    names, order = ("region_no", "ring_no", "x", "y"), "region_no ring_no point_no"
    rows = store.select(connection, "region_outline", *names, order=order, extraction_id=picture.extraction_id)
    region, ring = (np.asarray(rows[c], np.int64) for c in ("region_no", "ring_no"))
    if not len(region):
        return []
    rings = 1 + int(ring.max())
    drawn = courses(rings * region + ring, rows["x"], rows["y"], detail=_REGION_DETAIL_PX)
    whole: dict[int, str] = defaultdict(str)
    for key, data in drawn.items():
        whole[key // rings] += data + "Z"
    out = []
    for no, data in whole.items():
        shown = surfaces.get((picture.camera, no), [])
        title = f"region {no}: " + (", ".join(shown) or "matched to no surface")
        classes = "region " + ("met" if shown else "unmet") + (" unexplained" if (picture.camera, no) in alien else "")
        out.append(_path(f"c{number}-r{no}", classes, data, title))
    return out


def pose_spread(store: Store, connection: Connection, run: int) -> dict[str, tuple[Floats, Floats]]:
    """By camera: where model points stand that measured the pose (n, 2) px, and the covariance (n, 2, 2) px2 that the
    pose's covariance gives them; some of them, spread over the picture's arcs."""
    poses = store.rows(connection, "report/pose_matrix", run_id=run)
    if not poses:
        return {}
    world_from_rig = matrices(poses[0]._mapping)
    values, vectors = np.linalg.eigh(np.reshape(poses[0].covariance, (6, 6)))
    steps = (vectors * np.sqrt(np.maximum(values, 0))).T  # one standard deviation along each principal axis
    steps = np.concatenate([np.zeros((1, 6)), steps, -steps])
    moves = rigid(rotation_matrix(steps[:, 3:]), steps[:, :3])
    measured = store.columns(connection, "report/measurements", run_id=run)
    camera = np.asarray(measured["camera"])
    world = np.stack([np.asarray(measured[f"world_{a}"], float) for a in "xyz"], axis=1)
    out = {}
    for row in store.rows(connection, "report/rig_cameras", run_id=run):
        own = np.flatnonzero(camera == row.camera)
        if not len(own):
            continue
        own = own[np.unique(np.linspace(0, len(own) - 1, _ELLIPSES).astype(np.int64))]
        camera_from_world = inverse(world_from_rig @ moves @ matrices(row._mapping))
        k = np.array([[row.fx, row.skew, row.cx], [0, row.fy, row.cy], [0, 0, 1]])
        lens = np.asarray(row.distortion, float)
        seen = (
            cv2.projectPoints(world[own], rotation_vector(m[:3, :3]), m[:3, 3], k, lens if len(lens) else None)[0]
            for m in camera_from_world
        )
        pixels = np.stack([one[:, 0] for one in seen])
        along = (pixels[1:7] - pixels[7:]) / 2
        out[row.camera] = (pixels[0], np.einsum("kni,knj->nij", along, along))
    return out


def _ellipses(at: Floats, covariance: Floats) -> tuple[float, list[Markup]]:
    """Ellipses of two standard deviations, drawn so many times larger (a power of ten) that they can be seen."""
    largest = float(np.median(2 * np.sqrt(np.linalg.eigvalsh(covariance)[:, -1])))
    scale = 10.0 ** max(0, int(np.ceil(np.log10(6 / max(largest, 1e-9)))))
    out = []
    for centre, cov in zip(at, covariance, strict=True):
        across, along = 2 * np.sqrt(np.maximum(np.linalg.eigvalsh(cov), 0))
        title = f"two sigma of the pose here: {along:.3f} px by {across:.3f} px"
        data = path_data(centre + scale * ellipse_points(cov, 2), True)
        out.append(Markup('<path class="ellipse" d="{}"><title>{}</title></path>').format(data, title))
    return scale, out


# Plots of a run's rows: how sure the pose is, how the residuals lie, what took how long.

_LONGEST_SHARE = 0.04  # of the picture's width: what the largest residuals are drawn as


def pose_plots(store: Store, connection: Connection, run: int) -> list[Markup]:
    """Error ellipses of the rig's place in the world's planes; nothing where there is no pose."""
    rows = store.rows(connection, "report/pose_matrix", run_id=run)
    if not rows:
        return []
    covariance = np.reshape(rows[0].covariance_world, (6, 6))
    planes = [
        ellipse(covariance[np.ix_((i, j), (i, j))], f"{'xyz'[i]}, {'xyz'[j]}") for i, j in ((0, 1), (0, 2), (1, 2))
    ]
    return [_figure("Where the rig may stand about the pose found, in the world's axes: one and two sigma", planes)]


def evidence_plots(store: Store, connection: Connection, run: int) -> list[Markup]:
    """Of each camera the residuals of the edge points over their sigma, and where they lie in the picture."""
    rows = store.columns(connection, "report/measurements", run_id=run)
    if not len(rows["u"]):
        return []
    camera = np.asarray(rows["camera"])
    u, v, nu, nv, sigma, weight, residual = (
        np.asarray(rows[c], float) for c in ("u", "v", "normal_u", "normal_v", "sigma", "weight", "residual")
    )
    out = []
    for row in store.rows(connection, "report/rig_cameras", run_id=run):
        own = camera == row.camera
        if not own.any():
            continue
        kept = own & (weight > 0.01)
        longest = max(float(np.quantile(np.abs(residual[kept]), 0.95)) if kept.any() else 1.0, 1e-3)
        scale = float(f"{_LONGEST_SHARE * row.width / longest:.1g}")
        lie = residual_map(
            np.stack([u, v], axis=1)[own], np.stack([nu, nv], axis=1)[own], residual[own], row.width, row.height, scale
        )
        words = f"{row.camera}: residuals of edge points over their sigma, with the normal distribution; "
        out.append(
            _figure(
                words + f"and in the picture, {scale:g} times as long",
                [histogram(residual[own] / sigma[own], weight[own]), lie],
            )
        )
    return out


def times(steps: PageTable) -> PageTable:
    """The table of steps with a bar for how long each took."""
    seconds = [r[list(steps.columns).index("seconds")] if r[0] == "step" else None for r in steps.rows]
    longest = max((s for s in seconds if s is not None), default=None)
    if not longest:
        return steps
    bar = Markup(
        '<svg class="time" viewBox="0 0 100 6" width="160" height="10" aria-hidden="true">'
        '<rect width="{:.1f}" height="6"/></svg>'
    )
    bars = ["" if s is None else bar.format(100 * s / longest) for s in seconds]
    rows = [(*r, drawn) for r, drawn in zip(steps.rows, bars, strict=True)]
    return replace(steps, columns=[*steps.columns, ""], rows=rows)


def _figure(words: str, drawings: Sequence[Any]) -> Markup:
    drawn = Markup("").join(drawings)
    return Markup('<figure class="drawn"><div class="flow">{}</div><figcaption>{}</figcaption></figure>').format(
        drawn, cell(words)
    )
