"""Comparison of the kinds of index on the placed parts of a world."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from sqlalchemy import Connection

from relmodel.arrays import Floats
from relmodel.errors import UsageError
from relmodel.find.find import in_volume, in_volumes, world_named
from relmodel.find.kinds import KINDS, BoxIndex, build
from relmodel.find.planner import placed_parts, world_boxes
from relmodel.find.volumes import Box, Frustum, Volume, VolumeTable
from relmodel.geometry.transforms import rotation_matrix
from relmodel.progress import Progress, silent
from relmodel.store import Run, Store

# The range tree takes n log^2 n memory: some 10 kB a box at this size.
LARGEST_RANGETREE = 100_000
HITS = (0, 10, 100, 10_000)
STORE = "store"


@dataclass(frozen=True)
class Figures:
    """Times of one kind in process, or of the store by SQL, ms: medians over volumes of the latency of one volume by
    hits, of "any box here?", of one camera's view of some 100 hits, and of 1,000 volumes of 10 hits in one call."""

    kind: str
    one_ms: dict[int, float]
    view_ms: float
    thousand_ms: float
    build_ms: float | None = None
    size_mb: float | None = None
    any_ms: float | None = None

    @property
    def score(self) -> float:
        """What the recommendation weighs: the geometric mean of the query times."""
        times = [*self.one_ms.values(), self.view_ms, self.thousand_ms]
        return float(np.exp(np.mean(np.log(times + ([self.any_ms] if self.any_ms else [])))))


@dataclass(frozen=True)
class Comparison:
    """Figures of the kinds and of the store on the `parts` placed parts of a world, and the kind of least `score`."""

    world: str
    parts: int
    kinds: list[Figures]
    store: Figures
    cell_mm: float

    @property
    def recommended(self) -> str:
        return min(self.kinds, key=lambda f: f.score).kind


def compare(store: Store, world: str | None = None, progress: Progress = silent) -> Comparison:
    """Measure every kind on the newest revision of a world and store which is best: `WorldIndex.load` uses it.

    A run of kind `index` writes the attributes `index_kind` and `grid_cell_mm` of the world.  Raises UsageError where
    no world or nothing in it can be taken.
    """
    with store.read() as connection:
        world_id, name = world_named(store, connection, world)
        if world_id < 0:
            raise UsageError("the store holds no world: place the objects with relmodel world FILE")
        boxes = world_boxes(*placed_parts(store, connection, world_id))
    if not len(boxes):
        raise UsageError(f"the world {name} has no placed part: there is nothing to index")
    kinds = [k for k in KINDS if k != "rangetree" or len(boxes) <= LARGEST_RANGETREE]
    asked = {hits: _volumes(boxes, hits, 1000) for hits in HITS if hits <= 100 or hits < len(boxes)}
    views = _views(asked[100])
    from relmodel.find.grid import Grid

    with Run.begin(store, "index", {"world": name}, packages=("numba", "numpy")) as run:
        measured = []
        for done, kind in enumerate(kinds):
            progress(f"measuring {kind}", done, len(kinds) + 1)
            measured.append(_measured(kind, boxes, asked, views))
        progress("measuring the store", len(kinds), len(kinds) + 1)
        found = Comparison(name, len(boxes), measured, _of_store(store, name, asked, views), Grid(boxes).cell_mm)
        rows: dict[str, Any] = {"name": ["index_kind", "grid_cell_mm"], "unit": [None, "mm"]}
        rows |= {"value_text": [found.recommended, None], "value_number": [None, found.cell_mm]}
        rows |= {"world_id": world_id, "run_id": run.id, "source": "derived"}

        def write(connection: Connection) -> None:
            run.append(connection, "world_attribute", rows)
            run.finish(f"{found.recommended} is the best index of world {name}", connection)

        run.transact(write)
    return found


def _volumes(boxes: Floats, hits: int, count: int) -> Floats:
    """Cubes around placed parts that contain about so many boxes; for none, cubes beyond all parts."""
    rng = np.random.default_rng(0)
    centre = (boxes[:, :3] + boxes[:, 3:]) / 2
    chosen = rng.choice(centre, count)
    if hits == 0:
        beyond = chosen + 2 * (boxes[:, 3:].max(axis=0) - boxes[:, :3].min(axis=0)) + 1
        return np.concatenate([beyond, beyond], axis=1)
    place = min(hits, len(boxes)) - 1
    half = float(np.median([np.partition(np.abs(centre - p).max(axis=1), place)[place] for p in chosen[:20]]))
    return np.concatenate([chosen - half, chosen + half], axis=1)


def _views(asked: Floats) -> list[Frustum]:
    """Cameras that look at the middles of volumes, from so far that their pictures show about as much."""
    rng = np.random.default_rng(1)
    matrix = np.array([[1500.0, 0, 639.5], [0, 1500, 479.5], [0, 0, 1]])
    views = []
    for box in asked[:50]:
        pose = np.eye(4)
        pose[:3, :3] = rotation_matrix(rng.uniform(-2, 2, 3))
        away = max(1500 / 1280 * float((box[3:] - box[:3]).max()), 1.0)
        pose[:3, 3] = (box[:3] + box[3:]) / 2 - away * pose[:3, 2]
        views.append(Frustum(1280, 960, matrix, pose, away / 2, 3 * away / 2))
    return views


def _measured(kind: str, boxes: Floats, asked: dict[int, Floats], views: list[Frustum]) -> Figures:
    tables = [VolumeTable.of([view]) for view in views]
    warm: BoxIndex = build(kind, boxes[:100])  # compiles, or fetches what was compiled, outside the clock
    warm.in_boxes(asked[HITS[0]][:1])
    warm.in_volumes(tables[0])
    warm.any_in_box(asked[HITS[0]][0])
    began = time.perf_counter()
    index = build(kind, boxes)
    build_ms = 1e3 * (time.perf_counter() - began)
    one_ms = {
        hits: _median_ms([lambda box=box: index.in_boxes(box[None]) for box in volumes[:50]])  # type: ignore[misc]
        for hits, volumes in asked.items()
    }
    view_ms = _median_ms([lambda table=table: index.in_volumes(table) for table in tables])  # type: ignore[misc]
    any_ms = _median_ms([lambda box=box: index.any_in_box(box) for box in asked[10][:50]])  # type: ignore[misc]
    thousand_ms = _median_ms([lambda: index.in_boxes(asked[10])] * 3)
    return Figures(kind, one_ms, view_ms, thousand_ms, build_ms, index.nbytes / 1e6, any_ms)


def _of_store(store: Store, world: str, asked: dict[int, Floats], views: list[Frustum]) -> Figures:
    """The store's own answers, rows and all."""

    def median_ms(volumes: Sequence[Volume]) -> float:
        in_volume(store, volumes[0], world=world)
        return _median_ms([lambda one=one: in_volume(store, one, world=world) for one in volumes])  # type: ignore[misc]

    one_ms = {hits: median_ms([Box(*box) for box in volumes[:10]]) for hits, volumes in asked.items()}
    thousand = [Box(*box) for box in asked[10]]
    return Figures(STORE, one_ms, median_ms(views[:10]), _median_ms([lambda: in_volumes(store, thousand, world=world)]))


def _median_ms(calls: list[Callable[[], Any]]) -> float:
    times = []
    for call in calls:
        began = time.perf_counter()
        call()
        times.append(time.perf_counter() - began)
    return 1e3 * float(np.median(times))
