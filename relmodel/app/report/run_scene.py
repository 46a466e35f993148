"""The scene of an inspection in three dimensions: the placed parts, the cameras where they were thought and found."""

from __future__ import annotations

from typing import Any

import numpy as np
from sqlalchemy import Connection

from relmodel.app.report.pictures import pose_matrix
from relmodel.arrays import Floats
from relmodel.drawing.scene import MOST_PARTS, Lines, camera_lines, ellipsoid_lines, place_parts, scene
from relmodel.geometry.transforms import matrices
from relmodel.store import Store

LEGEND = (("in view", "seen"), ("cameras found", "pose"), ("prior, two sigma", "prior"), ("chosen", "chosen"))
_DEPTH = 0.3  # of the way to what the cameras look at, for the pyramids that stand for them
_NO_DEPTH_MM = 1000.0  # where nothing was measured


def run_scene(store: Store, connection: Connection, run: int) -> tuple[dict[str, Any] | None, dict[int, int]]:
    """The scene, None where the run was no inspection, and which of its parts each occurrence is."""
    priors = store.rows(connection, "report/prior_matrix", run_id=run)
    if not priors:
        return None, {}
    rows = store.columns(connection, "report/scene_parts", run_id=run, most=MOST_PARTS)
    colours = ["seen" if it else "plain" for it in rows["in_view"]]
    shape_id = np.asarray(rows["shape_id"], np.int64)
    shapes, parts, kept = place_parts(store, connection, shape_id, rows["path"], matrices(rows), colours)
    lines, views = _cameras(store, connection, run, priors[0])
    part_of = {int(rows["id"][row]): i for i, row in enumerate(kept)}
    seen_from = next(
        (p for p in (priors[0], *store.rows(connection, "report/pose_matrix", run_id=run)) if p.m00 is not None), None
    )
    back = np.array([0.0, 0.0, 1.0]) if seen_from is None else -pose_matrix(seen_from)[:3, 2]
    return scene(shapes, parts, lines, views, back=back), part_of


def _cameras(store: Store, connection: Connection, run: int, prior: Any) -> tuple[list[Lines], list[dict[str, Any]]]:
    """Pyramids of the cameras at the prior and at the pose found, ellipsoids about the rig; what cameras see."""
    poses = store.rows(connection, "report/pose_matrix", run_id=run)
    cameras = store.rows(connection, "report/rig_cameras", run_id=run)
    mean = store.rows(connection, "report/look", run_id=run)[0]
    lines: list[Lines] = []
    views = []
    rigs = [("prior", prior), *[("pose", p) for p in poses]]
    for colour, row in [(colour, row) for colour, row in rigs if row.covariance is not None]:
        world_from_rig = pose_matrix(row)
        depth = _NO_DEPTH_MM
        if mean.x is not None:
            depth = float(np.linalg.norm(np.array([mean.x, mean.y, mean.z]) - world_from_rig[:3, 3]))
        at: list[float] = []
        for camera in cameras:
            world_from_camera = world_from_rig @ pose_matrix(camera)
            matrix = camera_matrix(camera)
            at += camera_lines(world_from_camera, matrix, camera.width, camera.height, _DEPTH * depth)
            if colour == "pose" or not poses:
                views.append(view(camera, world_from_camera, depth, camera.camera))
        rotation = world_from_rig[:3, :3]
        covariance = rotation @ np.reshape(row.covariance, (6, 6))[:3, :3] @ rotation.T
        at += ellipsoid_lines(world_from_rig[:3, 3], covariance, 2.0)
        lines.append({"colour": colour, "at": at})
    return lines, views


def view(camera: Any, world_from_camera: Floats, depth: float, name: str, *, aside: bool = False) -> dict[str, Any]:
    """What a camera sees, for the script: slopes of half the picture across and down, fx fy cx cy, and the first eight
    coefficients of its lens; aside: one that is not offered to look through."""
    return {
        "name": name,
        "aside": aside,
        "m": world_from_camera[:3].ravel().tolist(),
        "slope": [camera.width / camera.fx / 2, camera.height / camera.fy / 2],
        "depth": depth,
        "k": [camera.fx, camera.fy, camera.cx, camera.cy],
        "lens": [*map(float, camera.distortion), *[0.0] * 8][:8],
    }


def finding_views(store: Store, connection: Connection, run: int) -> list[dict[str, Any]]:
    """What the cameras of one of several runs see, for the model beside the pictures of its findings."""
    return [
        view(camera, pose_matrix(pose) @ pose_matrix(camera), _NO_DEPTH_MM, view_name(run, camera.camera), aside=True)
        for pose in store.rows(connection, "report/pose_matrix", run_id=run)
        for camera in store.rows(connection, "report/rig_cameras", run_id=run)
    ]


def view_name(run: int, camera: str) -> str:
    """The name of a view among those of several runs."""
    return f"run {run} {camera}"


def camera_matrix(camera: Any) -> Floats:
    """(3, 3), px."""
    return np.array([[camera.fx, camera.skew, camera.cx], [0, camera.fy, camera.cy], [0, 0, 1.0]])
