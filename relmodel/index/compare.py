"""The kinds of index held against each other on the placed parts of a world."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from relmodel.errors import UsageError
from relmodel.index.find import BOX_COLUMNS, world_named
from relmodel.index.kinds import KINDS, BoxIndex, build
from relmodel.store import Run, Store, sql

Floats = npt.NDArray[np.float64]

# The range tree takes n log^2 n room: some 10 kB a box at this size.
LARGEST_RANGETREE = 100_000
HITS = (0, 10, 100)


@dataclass(frozen=True)
class KindFigures:
    """Times of one kind, ms: medians over volumes of the latency of one volume by hits, of "any box here?", and of
    1,000 volumes of 10 hits in one call."""

    kind: str
    build_ms: float
    size_mb: float
    one_ms: dict[int, float]
    any_ms: float
    thousand_ms: float

    @property
    def score(self) -> float:
        """What the recommendation weighs: the geometric mean of the query times."""
        return float(np.exp(np.mean(np.log([*self.one_ms.values(), self.any_ms, self.thousand_ms]))))


@dataclass(frozen=True)
class Comparison:
    """Figures of the kinds on the `parts` placed parts of a world, and the kind of least `score`."""

    world: str
    parts: int
    figures: list[KindFigures]
    cell_mm: float

    @property
    def recommended(self) -> str:
        return min(self.figures, key=lambda f: f.score).kind


def compare(store: Store, world: str | None = None) -> Comparison:
    """Measure every kind on the newest revision of a world and store which is best: `WorldIndex.load` uses it.

    A run of kind `index` writes the attributes `index_kind` and `grid_cell_mm` of the world.  Raises UsageError where
    no world or nothing in it can be taken.
    """
    with store.read() as connection:
        world_id, name = world_named(store, connection, world)
        if world_id < 0:
            raise UsageError("the store holds no world: place the objects with relmodel world FILE")
        columns = store.columns(connection, "index_parts", world_id=world_id)
        known = store.rows(connection, "index_choice", world_id=world_id)
    boxes = np.stack([columns[c] for c in BOX_COLUMNS], axis=1).astype(float)
    if not len(boxes):
        raise UsageError(f"the world {name} has no placed part: there is nothing to index")
    kinds = [k for k in KINDS if k != "rangetree" or len(boxes) <= LARGEST_RANGETREE]
    asked = {hits: _volumes(boxes, hits, 1000) for hits in HITS}
    from relmodel.index.grid import Grid

    found = Comparison(name, len(boxes), [_measured(k, boxes, asked) for k in kinds], Grid(boxes).cell_mm)
    with Run.begin(store, "index", {"world": name}, packages=("numba", "numpy")) as run, run.write() as connection:
        if known:
            change = {"world_id": world_id, "kind": found.recommended, "grid_cell_mm": found.cell_mm}
            connection.execute(sql.query("index_choice_change"), change)
        else:
            rows: dict[str, Any] = {"name": ["index_kind", "grid_cell_mm"], "unit": [None, "mm"]}
            rows |= {"value_text": [found.recommended, None], "value_number": [None, found.cell_mm]}
            run.append(connection, "world_attribute", {"world_id": world_id, "source": "derived", **rows})
        run.end("ok", f"{found.recommended} is the best index of world {name}", connection)
    return found


def _volumes(boxes: Floats, hits: int, count: int) -> Floats:
    """Cubes around placed parts that hold about so many boxes; around places beyond all where that is none."""
    rng = np.random.default_rng(0)
    centre = (boxes[:, :3] + boxes[:, 3:]) / 2
    chosen = rng.choice(centre, count)
    if hits == 0:
        beyond = chosen + 2 * (boxes[:, 3:].max(axis=0) - boxes[:, :3].min(axis=0)) + 1
        return np.concatenate([beyond, beyond], axis=1)
    place = min(hits, len(boxes)) - 1
    half = float(np.median([np.partition(np.abs(centre - p).max(axis=1), place)[place] for p in chosen[:20]]))
    return np.concatenate([chosen - half, chosen + half], axis=1)


def _measured(kind: str, boxes: Floats, asked: dict[int, Floats]) -> KindFigures:
    warm: BoxIndex = build(kind, boxes[:100])  # compiles, or fetches what was compiled, outside the clock
    warm.in_boxes(asked[HITS[0]][:1])
    warm.any_in_box(asked[HITS[0]][0])
    began = time.perf_counter()
    index = build(kind, boxes)
    build_ms = 1e3 * (time.perf_counter() - began)
    one_ms = {
        hits: _median_ms([lambda box=box: index.in_boxes(box[None]) for box in volumes[:50]])  # type: ignore[misc]
        for hits, volumes in asked.items()
    }
    any_ms = _median_ms([lambda box=box: index.any_in_box(box) for box in asked[10][:50]])  # type: ignore[misc]
    thousand_ms = _median_ms([lambda: index.in_boxes(asked[10])] * 3)
    return KindFigures(kind, build_ms, index.nbytes / 1e6, one_ms, any_ms, thousand_ms)


def _median_ms(calls: list[Callable[[], Any]]) -> float:
    times = []
    for call in calls:
        began = time.perf_counter()
        call()
        times.append(time.perf_counter() - began)
    return 1e3 * float(np.median(times))
