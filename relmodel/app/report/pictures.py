"""What a report draws of a run: its pictures with what was found over them."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from markupsafe import Markup
from sqlalchemy import Connection

from relmodel.app.report.page import PageTable, cell
from relmodel.drawing.draw import Seen, course, data_uri
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
