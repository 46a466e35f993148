"""The model as the cameras of a run see it, from the run's rows: its edges by state, drawn over the pictures, and
pieces of them that show what is not as the model says."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image
from sqlalchemy import Connection

from relmodel.arrays import Bytes, Floats
from relmodel.drawing.colours import BLEND, STATES, UNEXPLAINED
from relmodel.drawing.images import read_image
from relmodel.drawing.strokes import Stroke, draw, in_colour, save_side_by_side
from relmodel.errors import InputError
from relmodel.store import Store

_MARGIN_PX, _LEAST_PX = 40, 160  # about what a crop is of, and of its side: what lies around it says where that is
_MOST_CROPS = 50


@dataclass(frozen=True)
class Edge:
    """An edge as a camera should see it: its row, points (n, 2) px along it, and the state it is drawn in, empty where
    nothing was said of it."""

    row: Any
    points: Floats
    state: str

    @property
    def number(self) -> int:
        return int(self.row.view_arc_no)


@dataclass(frozen=True)
class Seen:
    """What a camera of a run saw: the row of its picture, that in eight bits where its bytes were kept, and the edges
    of the model in it."""

    row: Any
    image: Image.Image | None
    edges: list[Edge]


def read_seen(store: Store, connection: Connection, run: int) -> list[Seen]:
    """The pictures of a run with the edges of the model, in the order of the cameras."""
    edges = read_edges(store, connection, run)
    return [
        Seen(row, None if row.bytes is None else read_image(row.bytes), edges.get(row.camera, []))
        for row in store.rows(connection, "report/pictures", run_id=run)
    ]


def read_edges(store: Store, connection: Connection, run: int) -> dict[str, list[Edge]]:
    """The edges of the model at the best pose, by camera."""
    courses = store.columns(connection, "report/model_arc_courses", run_id=run)
    number, camera = np.asarray(courses["view_arc_no"], np.int64), np.asarray(courses["camera"])
    points = np.stack([np.asarray(courses[c], float) for c in "xy"], axis=1)
    starts = np.flatnonzero(np.r_[True, (number[1:] != number[:-1]) | (camera[1:] != camera[:-1])][: len(number)])
    keys = zip(camera[starts].tolist(), number[starts].tolist(), strict=True)
    course = dict(zip(keys, np.split(points, starts[1:]), strict=False))
    states = {(r.camera, int(r.view_arc_no)): r.state for r in store.rows(connection, "report/state_arcs", run_id=run)}
    out: dict[str, list[Edge]] = defaultdict(list)
    for row in store.rows(connection, "report/model_arcs", run_id=run):
        key = row.camera, int(row.view_arc_no)
        if key in course:
            out[row.camera].append(Edge(row, course[key], states.get(key, "")))
    return out


def draw_model(canvas: Bytes, edges: Sequence[Edge], boxes: Sequence[Floats] = (), width: int = 1) -> Bytes:
    """A picture (rows, columns, 3: RGB) with edges in the colours of their states, the worst above, blends in a colour
    of their own; boxes (4, 2) px: about what the model does not account for."""
    blends = [e.points for e in edges if e.row.kind == "smooth"]
    by_state = [
        Stroke(
            [e.points for e in edges if (e.state or "undecidable") == state and e.row.kind != "smooth"], colour, width
        )
        for state, colour in reversed(STATES.items())
    ]
    return draw(canvas, [Stroke(blends, BLEND, width), *by_state, Stroke(boxes, UNEXPLAINED, width, closed=True)])


def draw_over(store: Store, connection: Connection, run: int, greys: Mapping[str, Bytes | Floats]) -> dict[str, Bytes]:
    """The pictures of an inspection, given by camera in 0..255, with the model drawn over them and what it does not
    account for (rows, columns, 3: RGB); arcs beyond the model are left out."""
    boxes: dict[str, list[Floats]] = defaultdict(list)
    for r in store.rows(connection, "result/unexplained", run_id=run):
        if not r.beyond or r.region_no is not None:
            boxes[r.camera].append(np.array([[r.u0, r.v0], [r.u1, r.v0], [r.u1, r.v1], [r.u0, r.v1]], float))
    edges = read_edges(store, connection, run)
    return {name: draw_model(in_colour(grey), edges.get(name, []), boxes[name]) for name, grey in greys.items()}


def write_overlay(path: str | Path, store: Store, run: int, greys: Mapping[str, Bytes | Floats]) -> None:
    """Write the pictures of an inspection, given by camera, side by side with the model drawn over them.

    Raises InputError where it cannot be written.
    """
    with store.read() as connection:
        drawn = draw_over(store, connection, run, greys)
    save_side_by_side(path, list(drawn.values()))


def write_crops(folder: str | Path, store: Store, run: int, greys: Mapping[str, Bytes | Floats]) -> None:
    """Write a picture of each failure of an inspection, the worst first and at most 50: what every camera shows there,
    without and with the model."""
    with store.read() as connection:
        edges, drawn = read_edges(store, connection, run), draw_over(store, connection, run, greys)
        of_item = item_edges(store, connection, run)
        failures = store.rows(connection, "report/failures", run_id=run)[:_MOST_CROPS]
    for place, row in enumerate(failures, 1):
        pieces: list[Bytes] = []
        for name, grey in greys.items():
            own = [e for e in edges.get(name, ()) if (name, e.number) in of_item[int(row.in_view_no)]]
            if own:
                u0, v0, u1, v1 = box_about(own, (grey.shape[1], grey.shape[0]))
                pieces += [in_colour(grey[v0:v1, u0:u1]), drawn[name][v0:v1, u0:u1]]
        if pieces:
            words = re.sub(r"[^A-Za-z0-9.-]+", "_", row.path)[-200:]  # a name of a file may have 255 bytes
            save_side_by_side(Path(folder) / f"{place:02d}_{row.state}_{words}.png", pieces)


def check_crops(folder: str | Path) -> None:
    """Raise InputError where the folder cannot be made, before anything is computed."""
    try:
        Path(folder).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"the folder {folder} cannot be made ({error.strerror}): name another place") from error


def item_edges(store: Store, connection: Connection, run: int) -> dict[int, set[tuple[str, int]]]:
    """Cameras and numbers of the edges that show each part and feature, by its number in view."""
    out: dict[int, set[tuple[str, int]]] = defaultdict(set)
    for r in store.rows(connection, "report/item_arcs", run_id=run):
        out[int(r.in_view_no)].add((r.camera, int(r.view_arc_no)))
    return out


def box_about(edges: Iterable[Edge], size: tuple[int, int]) -> tuple[int, int, int, int]:
    """Bounds u0 v0 u1 v1 (px, half-open) of a piece of a picture (width, height) that shows edges and what lies about
    them."""
    points = np.concatenate([e.points for e in edges])
    low, high = points.min(axis=0), points.max(axis=0)
    margin = np.maximum(_MARGIN_PX, (_LEAST_PX - (high - low)) / 2)
    u0, v0 = np.floor(low - margin).clip(0, np.array(size) - 1).astype(int).tolist()
    u1, v1 = np.ceil(high + margin).clip((u0 + 1, v0 + 1), size).astype(int).tolist()
    return u0, v0, u1, v1
