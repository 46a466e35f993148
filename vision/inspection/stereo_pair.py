"""Two pictures of a rig matched by themselves: a run of its own, without a model unless a prior is given."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from sqlalchemy import Connection

from relmodel.errors import InputError, UsageError
from relmodel.find.find import world_named
from relmodel.labelling.problem import NONE
from relmodel.store import Run, Store, digest_inputs
from vision.cameras.cameras import Rig
from vision.cameras.files import read_prior, read_rig, rig_inputs
from vision.cameras.images import describe_reading, read_pictures
from vision.cameras.record_cameras import record_rig
from vision.cameras.view_volume import select_in_view
from vision.extraction import extract as extraction
from vision.inspection.inspection_parameters import DEFAULTS, InspectionParameters
from vision.inspection.pictures import extract_pictures
from vision.scene.stored_scene import read_scene
from vision.stereo.depth_range import predict_depth_range
from vision.stereo.disparity_range import DepthRange
from vision.stereo.match import StereoMatches, check_method, match_stereo
from vision.stereo.record_stereo import record_stereo
from vision.stereo.rectification import rectify
from vision.stereo.triangulate import CURVES

KERNELS = (*extraction.KERNELS, "vision.stereo.epipolar_kernels", "relmodel.find.rtree_kernels")
PACKAGES = ("duckdb", "numba", "numpy", "opencv-python-headless", "scipy", "sqlalchemy")


@dataclass(frozen=True)
class StereoAnswer:
    """The run, what it matched, and what was taken of the pictures, a sentence each."""

    run: int
    matches: StereoMatches
    notes: list[str]

    def rows(self) -> list[dict[str, Any]]:
        """The matched arcs, then the matched regions: kind, left, right, and of arcs the curve, both ends in the rig's
        frame, mm, and the greatest standard deviation of either along any direction."""
        it, space = self.matches, self.matches.triangulated
        ends = np.stack([space.covariance[:, :3, :3], space.covariance[:, 3:, 3:]])
        sigma = np.sqrt(np.linalg.eigvalsh(ends)[..., -1].max(axis=0)) if len(space.left) else np.zeros(0)
        arcs = [
            {
                "kind": "arc", "left": left, "right": right, "curve": CURVES[curve],
                "start": start, "end": end, "sigma_mm": mm,
            }
            for left, right, curve, start, end, mm in zip(
                space.left.tolist(), space.right.tolist(), space.curve.tolist(), np.round(space.start, 3).tolist(),
                np.round(space.end, 3).tolist(), np.round(sigma, 3).tolist(), strict=True,
            )
        ]  # fmt: skip
        label = it.region_label
        regions = [
            {"kind": "region", "left": left, "right": int(label[left])} | dict.fromkeys(_OF_ARCS)
            for left in np.flatnonzero(label != NONE).tolist()
        ]
        return arcs + regions


_OF_ARCS = ("curve", "start", "end", "sigma_mm")


def match_pair(
    store: Store,
    *,
    rig: str | Path,
    left: tuple[str, str | Path],
    right: tuple[str, str | Path],
    prior: str | Path | None = None,
    world: str | None = None,
    keep_images: bool = True,
    parameters: InspectionParameters = DEFAULTS,
) -> StereoAnswer:
    """Match two pictures, each given with the name of its camera in the rig, and store the run.

    prior: a YAML file; the model of the world, seen from there, then bounds how far off things are.  Raises InputError
    for bad inputs and cameras that make no pair, and the run then ended as failed; UsageError, before anything is
    written, for methods that are none and worlds that are not there.
    """
    check_method(parameters.stereo)
    if left[0] == right[0]:
        raise UsageError(f"both pictures are given to the camera '{left[0]}': name one camera each")
    paths = {name: Path(path) for name, path in (left, right)}
    recorded = {
        "extraction": asdict(parameters.extraction),
        "stereo": asdict(parameters.stereo),
        "left": left[0],
        "keep_bounds": parameters.keep_bounds,
    }
    files = {**paths, **rig_inputs(rig)} | ({} if prior is None else {"prior": prior})
    world_name = "" if prior is None else _world(store, world)
    with Run.begin(store, "stereo", recorded, inputs=digest_inputs(files), packages=PACKAGES) as run:
        cameras = read_rig(rig).only(*paths)
        rectify(cameras, *paths)
        pictures = read_pictures(paths, cameras)
        run.step("read")
        depths = None if prior is None else _depths(store, cameras, prior, world_name, left[0], parameters)
        run.step("select")
        seen = extract_pictures(run, pictures, parameters.extraction, keep_images=keep_images)
        run.step("extract")
        one, other = (seen[name] for name in paths)
        matches = match_stereo(
            cameras, one.primitives, other.primitives, depths, parameters.stereo, (left[0], right[0])
        )
        run.step("stereo")

        def record(connection: Connection) -> None:
            record_rig(run, connection, cameras)
            record_stereo(
                run,
                connection,
                0,
                one.recorded.unit_set_id,
                other.recorded.unit_set_id,
                matches,
                keep_bound=parameters.keep_bounds,
            )
            run.finish(connection=connection, last="record")

        run.transact(record)
    return StereoAnswer(run.id, matches, describe_reading(pictures.values()))


def _world(store: Store, world: str | None) -> str:
    """The name of the world that the prior is in."""
    with store.read() as connection:
        world_id, name = world_named(store, connection, world)
    if world_id < 0:
        raise UsageError("the store holds no world: place the objects with relmodel world FILE, or leave the prior out")
    return name


def _depths(store: Store, rig: Rig, prior: str | Path, world: str, camera: str, p: InspectionParameters) -> DepthRange:
    """How far off the model is, as the prior has it."""
    believed = read_prior(prior)
    selection = select_in_view(store, rig, believed, p.selection, world=world)
    if not len(selection.shown):
        raise InputError("nothing of the world lies where the prior looks: check the prior and the world file")
    with store.read() as connection:
        world_id, _ = world_named(store, connection, world)
        stored = read_scene(store, connection, world_id, selection.occurrence_id.tolist())
    return predict_depth_range(
        stored.scene, rig, believed.world_from_rig, believed.covariance, p.stereo.depth_range, camera
    )
