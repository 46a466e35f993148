"""Two pictures of a rig matched by themselves: a run of its own, without a model."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from sqlalchemy import Connection

from relmodel.errors import UsageError
from relmodel.labelling.problem import NONE
from relmodel.store import Run, Store
from vision.cameras.images import Pictures, describe_reading, digest_given, pictures_as_files, read_rig_with_pictures
from vision.cameras.record import record_rig
from vision.extraction import extract as extraction
from vision.inspection.inspection_parameters import DEFAULTS, InspectionParameters
from vision.inspection.pictures import extract_pictures
from vision.stereo.epipolar import rectify
from vision.stereo.match import StereoMatches, check_method, match_stereo, record_stereo
from vision.stereo.triangulate import CURVES

KERNELS = (*extraction.KERNELS, "vision.stereo.epipolar_kernels")
PACKAGES = ("duckdb", "numba", "numpy", "opencv-python-headless", "scipy", "sqlalchemy")


@dataclass(frozen=True)
class StereoAnswer:
    """The run, what it matched, and what was taken of the pictures, a sentence each."""

    run: int
    matches: StereoMatches
    notes: list[str]

    def rows(self) -> tuple[tuple[str, ...], list[tuple[Any, ...]]]:
        """Names of columns, and the matched arcs, then the matched regions: kind, the number in the picture of each
        camera under its name, and of arcs the curve, both ends in the rig's frame, mm, and the greatest standard
        deviation of either along any direction."""
        it, space = self.matches, self.matches.triangulated
        ends = np.stack([space.covariance[:, :3, :3], space.covariance[:, 3:, 3:]])
        sigma = np.sqrt(np.linalg.eigvalsh(ends)[..., -1].max(axis=0)) if len(space.first) else np.zeros(0)
        names = ("kind", *it.rectification.cameras, "curve", "start", "end", "sigma_mm")
        curves = [CURVES[curve] for curve in space.curve]
        numbers = (np.round(column, 3).tolist() for column in (space.start, space.end, sigma))
        arcs = zip(space.first.tolist(), space.second.tolist(), curves, *numbers, strict=True)
        rows: list[tuple[Any, ...]] = [("arc", *arc) for arc in arcs]
        region = np.flatnonzero(it.region_label != NONE)
        rows += [
            ("region", *pair, None, None, None, None)
            for pair in zip(region.tolist(), it.region_label[region].tolist(), strict=True)
        ]
        return names, rows


def match_pair(
    store: Store,
    *,
    rig: str | Path,
    pictures: Pictures,
    keep_images: bool = True,
    parameters: InspectionParameters = DEFAULTS,
) -> StereoAnswer:
    """Match two pictures, each of another camera of the rig, and store the run.

    Raises InputError for bad inputs and cameras that make no pair, and the run then ended as failed; UsageError, before
    anything is written, for methods that are none."""
    check_method(parameters.stereo)
    files = pictures_as_files(pictures)
    if len(files) != 2:
        raise UsageError("stereo is of two pictures: give two, each with its camera")
    recorded = {"extraction": asdict(parameters.extraction), "stereo": asdict(parameters.stereo)}
    with Run.begin(store, "stereo", recorded, inputs=digest_given(files, rig), packages=PACKAGES) as run:
        whole, read = read_rig_with_pictures(Path(rig), files)
        cameras = whole.only(*read)
        rectify(cameras)  # refuses what is no pair
        run.step("read")
        seen = extract_pictures(run, read, parameters.extraction, keep_images=keep_images)
        store.release()
        run.step("extract")
        one, other = (seen[name] for name in read)
        matches = match_stereo(cameras, one.primitives, other.primitives, parameters.stereo)
        run.step("stereo")

        def record(connection: Connection) -> None:
            record_rig(run, connection, cameras)
            record_stereo(run, connection, 0, one.recorded.unit_set_id, other.recorded.unit_set_id, matches)
            run.finish(connection=connection, last="record")

        run.transact(record)
    return StereoAnswer(run.id, matches, describe_reading(read.values()))
