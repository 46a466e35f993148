"""What a report draws of a run: its pictures with what was found over them, and plots of its rows."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from markupsafe import Markup
from sqlalchemy import Connection

from relmodel.app.report.page import PageTable, cell
from relmodel.arrays import Floats
from relmodel.drawing.draw import (
    Seen,
    course,
    data_uri,
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


def read_pictures(
    store: Store, connection: Connection, run: int, seen: Sequence[Seen], tables: Mapping[str, PageTable]
) -> list[RunPicture]:
    """A run's pictures and drawings, by the tables of its page; ids: `cN-iM` (image arc M of picture N), `cN-mM` (model
    arc), `cN-rM` (region)."""
    fates = _fates(tables)
    shown = {(r.camera, r.region_no): r.surfaces for r in store.rows(connection, "report/region_surfaces", run_id=run)}
    spread = pose_spread(store, connection, run)
    alien = {
        (r.camera, kind, no)
        for r in tables["unexplained"].rows
        for kind, no in (("i", r.image_arc_no), ("r", r.region_no))
    }
    out = []
    for number, it in enumerate(seen):
        picture = it.row
        drawn = _drawing(store, connection, number, it, fates, shown, alien)
        scale, ellipses = _ellipses(*spread[picture.camera]) if picture.camera in spread else (1.0, [])
        uri = None if it.image is None else data_uri(it.image)
        drawing = Markup("").join([*drawn, *ellipses])
        out.append(RunPicture(picture.camera, picture.file_name, picture.width, picture.height, uri, drawing, scale))
    return out


def _drawing(
    store: Store,
    connection: Connection,
    number: int,
    seen: Seen,
    fates: dict[tuple[str, str, int], str],
    surfaces: dict[tuple[str, int], str],
    alien: set[tuple[str, str, int]],
) -> list[Markup]:
    """Regions, edges of the model and arcs of a picture, each with what became of it in words."""
    drawn: list[Markup] = []
    camera, extraction = seen.row.camera, seen.row.extraction_id

    def draw(kind: str, no: int, classes: str, course: str, title: str) -> None:
        beyond = " unexplained" if (camera, kind, no) in alien else ""
        drawn.append(_PATH.format(f"c{number}-{kind}{no}", classes + beyond, course, cell(title)))

    rings: dict[int, str] = defaultdict(str)
    for r in store.rows(connection, "report/regions", extraction_id=extraction):
        rings[int(r.region_no)] += course(np.column_stack([r.x, r.y]), _REGION_DETAIL_PX) + "Z"
    for no, data in rings.items():
        met = surfaces.get((camera, no))
        draw("r", no, "region met" if met else "region unmet", data, f"region {no}: {met or 'matched to no surface'}")
    for edge in seen.edges:
        a, fate = edge.row, fates.get((camera, "m", edge.number))
        of = f"arc {a.arc_no}" if a.surface_no is None else f"silhouette of surface {a.surface_no}"
        title = f"{a.path}, {of} ({a.kind}, {a.length:.0f} px): {fate or 'not matched'}"
        classes = f"model {a.kind} {'met' if fate else 'unmet'}"
        if edge.state:
            title, classes = f"{title}; {edge.state}", f"{classes} state-{edge.state}"
        draw("m", edge.number, classes, course(edge.points), title)
    for a in store.rows(connection, "report/image_arcs", extraction_id=extraction):
        fate = fates.get((camera, "i", int(a.image_arc_no)), "")
        straight = a.kind == "line" or a.x is None
        points = [[a.start_x, a.end_x], [a.start_y, a.end_y]] if straight else [a.x, a.y]
        data = course(np.array(points, float).T) + ("Z" if a.closed and not straight else "")
        title = f"image arc {a.image_arc_no} ({a.topography}, {a.kind}, {a.length:.0f} px) {fate}"
        draw("i", int(a.image_arc_no), f"arc {a.kind} {fate.partition(' ')[0].rstrip(':') or 'unjudged'}", data, title)
    return drawn


_PATH = Markup('<path id="{}" class="{}" d="{}"><title>{}</title></path>')


def _fates(tables: Mapping[str, PageTable]) -> dict[tuple[str, str, int], str]:
    """What became of image arcs and model arcs, in words, by camera, `i` or `m`, and number."""
    out: dict[tuple[str, str, int], str] = {}
    for r in tables["matched_arc"].rows:
        words = f"matched to the {r.view_kind} arc {r.view_arc_no} of {r.path}, residual {r.residual:.2f} px"
        out[r.camera, "i", int(r.image_arc_no)] = words
        out[r.camera, "m", int(r.view_arc_no)] = f"matched to image arc {r.image_arc_no}, residual {r.residual:.2f} px"
    for r in tables["rejected_arc"].rows:
        near = "" if r.residual is None else f"; nearest model arc {r.view_arc_no}, residual {r.residual:.2f} px"
        out[r.camera, "i", int(r.image_arc_no)] = f"rejected: {r.reason}{near}"
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
    for row in store.rows(connection, "result/camera", run_id=run):
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


# Plots of a run's rows: how the residuals lie.

_LONGEST_SHARE = 0.04  # of the picture's width: what the largest residuals are drawn as
_FIGURE = Markup('<figure class="drawn"><div class="flow">{}{}</div><figcaption>{}</figcaption></figure>')


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
    for row in store.rows(connection, "result/camera", run_id=run):
        own = camera == row.camera
        if not own.any():
            continue
        kept = own & (weight > 0.01)
        longest = max(float(np.quantile(np.abs(residual[kept]), 0.95)) if kept.any() else 1.0, 1e-3)
        scale = float(f"{_LONGEST_SHARE * row.width / longest:.1g}")
        lie = residual_map(
            np.stack([u, v], axis=1)[own], np.stack([nu, nv], axis=1)[own], residual[own], row.width, row.height, scale
        )
        words = (
            f"{row.camera}: residuals of edge points over their sigma, with the normal distribution; "
            f"and in the picture, {scale:g} times as long"
        )
        out.append(_FIGURE.format(histogram(residual[own] / sigma[own], weight[own]), lie, cell(words)))
    return out
