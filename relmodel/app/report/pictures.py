"""What a report draws of a run: its pictures with what was found over them, and plots of its rows."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from markupsafe import Markup
from sqlalchemy import Connection

from relmodel.app.report.page import PageTable, cell
from relmodel.drawing.draw import (
    Seen,
    course,
    data_uri,
    histogram,
    residual_map,
)
from relmodel.store import Store

_REGION_DETAIL_PX = 1.5


@dataclass(frozen=True)
class RunPicture:
    """A picture of a page: its row, of `report/pictures`; its address, None where it was not kept; what is drawn."""

    row: Any
    uri: str | None
    drawing: Markup


def read_pictures(
    store: Store, connection: Connection, run: int, seen: Sequence[Seen], tables: Mapping[str, PageTable]
) -> list[RunPicture]:
    """A run's pictures and drawings, by the tables of its page; ids: `cN-iM` (image arc M of picture N), `cN-mM` (model
    arc), `cN-rM` (region)."""
    fates = _fates(tables)
    shown = {(r.camera, r.region_no): r.surfaces for r in store.rows(connection, "report/region_surfaces", run_id=run)}
    alien = {
        (r.camera, kind, no)
        for r in tables["unexplained"].rows
        for kind, no in (("i", r.image_arc_no), ("r", r.region_no))
    }
    drawings = [_drawing(store, connection, n, it, fates, shown, alien) for n, it in enumerate(seen)]
    return [
        RunPicture(it.row, None if it.image is None else data_uri(it.image), Markup("").join(drawn))
        for it, drawn in zip(seen, drawings, strict=True)
    ]


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
        title = f"{a.sentence}; {fate}" if fate else a.sentence
        classes = f"model {a.kind} {'met' if a.rule == 'found' else 'unmet'}"
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
