"""What distances between circles are worth to a pose without a prior: joins with them, with others, and without.

    python -m benchmarks.distances [--pairs N] [--sets A B C] [--crowds 0 100] [--cameras both left]

Of each bulkhead in the folder that RELMODEL_TEST_DATA names the first N pairs (default: all), of both cameras or of one
alone.  A relation of two circles that stereo puts in space, or of two ellipses of one picture, is alike one of the
model in both radii, three angles and the distance of the centres.  `permuted`: each class of the model's relations has
the distance of another; `dropped`: none is asked for a distance.  `crowd`: so many foreign circles are added to the
scene, anywhere among its own, of the sizes of its own.  `right`: accepted within .1 mm and .02 degrees of the truth, at
a point 700 mm before the rig (of one picture 1 mm and .1 degrees); `found`: the truth is among the poses of the join,
within 10 mm and 2 degrees, and its median rank there; `s`: median seconds of the processor that the join takes."""

from __future__ import annotations

import argparse
import shutil
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from itertools import islice, product
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
from tabulate import tabulate

from benchmarks.trials import (
    JOINED_POSES,
    Models,
    Trial,
    compute_error,
    find_data,
    find_rank,
    inspect_trial,
    shared_bulkheads,
)
from relmodel.arrays import Ints
from relmodel.geometry.transforms import matrices
from relmodel.store import Store
from relmodel.store.bulk import fetch_columns
from vision.constellations import find_poses
from vision.constellations.elements import Circles, find_scene_circles
from vision.inspection.inspection_parameters import DEFAULTS, InspectionParameters

PERMUTE = """
UPDATE circle_relation SET distance = o.distance
FROM (SELECT object_id, class_no, row_number() OVER (PARTITION BY object_id ORDER BY class_no) AS place
    FROM circle_relation) AS r
JOIN (SELECT object_id, distance, row_number() OVER (PARTITION BY object_id ORDER BY hash(class_no + 1)) AS place
    FROM circle_relation) AS o ON o.object_id = r.object_id AND o.place = r.place
WHERE circle_relation.object_id = r.object_id AND circle_relation.class_no = r.class_no
"""
HEADERS = ("set", "cameras", "crowd", "distances", "pairs", "right", "wrong", "refused", "found", "rank", "s")
WAYS = ("true", "permuted", "dropped")
CAMERAS = {"both": ("left", "right"), "left": ("left",)}


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pairs", type=int, metavar="N")
    parser.add_argument("--sets", nargs="+", default=["A", "B", "C"], metavar="SET")
    parser.add_argument("--crowds", nargs="+", type=int, default=[0, 100], metavar="N")
    parser.add_argument("--cameras", nargs="+", default=["both", "left"], choices=CAMERAS)
    args = parser.parse_args(arguments)
    found: dict[tuple[str, str, int, str], list[dict[str, Any]]] = {}
    with tempfile.TemporaryDirectory() as folder:
        models = Models(Path(folder))
        for name in args.sets:
            for trial in islice(shared_bulkheads(find_data(), models, ("large",), name), args.pairs):
                for cameras, crowd, way in product(args.cameras, args.crowds, WAYS):
                    if cameras != "both" and crowd:
                        continue  # the crowd is one of circles in space
                    one = measure(replace(trial, prior=None), models, CAMERAS[cameras], crowd, way)
                    found.setdefault((name, cameras, crowd, way), []).append(one)
                    print(trial.name, cameras, crowd, way, one, flush=True)
    print(tabulate([(*key, *_summarise(key[1], them)) for key, them in found.items()], headers=HEADERS))
    return 0


def _summarise(cameras: str, found: list[dict[str, Any]]) -> tuple[Any, ...]:
    mm, degrees = (0.1, 0.02) if cameras == "both" else (1.0, 0.1)
    accepted = [it for it in found if it["verdict"] == "accepted"]
    right = sum(it["mm"] <= mm and it["degrees"] <= degrees for it in accepted)
    wrong = sum(it["mm"] > 20 * mm or it["degrees"] > 20 * degrees for it in accepted)
    ranks = [it["rank"] for it in found if it["rank"] is not None]
    rank = float(np.median(ranks)) if ranks else None
    refused = sum(it["verdict"] == "refused" for it in found)
    return len(found), right, wrong, refused, len(ranks), rank, float(np.median([it["s"] for it in found]))


def measure(trial: Trial, models: Models, cameras: Sequence[str], crowd: int, way: str) -> dict[str, Any]:
    """Verdict, error, rank of the truth among the poses of the join, and seconds that it takes."""
    assert trial.world_from_rig is not None
    models.open(trial.model).close()
    file = models.folder / f"{trial.model}.duckdb"
    if way == "permuted":
        source, file = file, file.with_stem(f"{file.stem}_permuted")
        if not file.exists():
            shutil.copy(source, file)
            with Store.open(file) as store, store.write() as connection:
                connection.exec_driver_sql(PERMUTE)
    seen = replace(trial, files={name: trial.files[name] for name in cameras})
    asked = {"variants": False, "keep_images": False, "full_audit": False}
    with Store.open(file) as store, _changed(crowd, way) as (parameters, seconds):
        answer = inspect_trial(store, seen, models.folder, parameters, **asked)
        with store.read() as connection:
            poses = matrices(fetch_columns(connection, JOINED_POSES, {"run": answer.run}))
    rank = find_rank(poses, trial.world_from_rig)
    mm, degrees = compute_error(answer, trial.world_from_rig)
    return {
        "verdict": answer.verdict, "mm": round(mm, 3), "degrees": round(degrees, 3), "rank": rank,
        "s": round(sum(seconds), 2),
    }  # fmt: skip


@contextmanager
def _changed(crowd: int, way: str) -> Iterator[tuple[InspectionParameters, list[float]]]:
    """Parameters with which distances are as asked, in a scene with a crowd, and the seconds that joins take inside."""
    rng, seconds = np.random.default_rng(crowd), list[float]()

    def crowded(space: Any) -> tuple[Ints, Circles]:
        arcs, own = find_scene_circles(space)
        if not crowd or not len(own):
            return arcs, own
        row = rng.integers(0, len(own), crowd)
        low, high = own.centre.min(axis=0), own.centre.max(axis=0)
        size = own.radius[row] * rng.uniform(0.8, 1.25, crowd)
        normal = own.normal[rng.integers(0, len(own), crowd)]
        more = Circles(rng.uniform(low, high, (crowd, 3)), normal, size, own.covariance[row])
        return np.concatenate([arcs, arcs[row]]), Circles.stack([own, more])

    def timed(join: Callable[..., Any]) -> Callable[..., Any]:
        def joined(*given: Any) -> Any:
            began = time.process_time()
            try:
                return join(*given)
            finally:
                seconds.append(time.process_time() - began)

        return joined

    p, far = DEFAULTS.constellations, 1e6  # mm
    if way == "dropped":
        one = replace(p.one_picture, most_mm=far, distance_mm=far)
        p = replace(p, join=replace(p.join, bin_mm=far, least_mm=far), one_picture=one)
    joins = {name: timed(getattr(find_poses, name)) for name in ("join_pairs", "join_ellipses")}
    changed: Any = joins | {"find_scene_circles": crowded}
    with patch.multiple(find_poses, **changed):
        yield replace(DEFAULTS, constellations=p), seconds


if __name__ == "__main__":
    sys.exit(main())
