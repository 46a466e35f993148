"""What a camera sees, asked of a store: against points that OpenCV projects into the picture."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest
from scipy.stats import norm

from relmodel.find.find import in_volumes
from relmodel.store import Run, Store
from tests.find.test_find import PLACES, Oracle, fill
from tests.find.test_sql_clients import rows_of
from tests.poses import pose_of
from tests.synthetic_model import SyntheticModel
from vision.cameras.cameras import (
    Camera,
    Prior,
    Rig,
    SelectionParameters,
    build_view_volume,
    perturb,
    probabilities_in_view,
    sample_poses,
    select_in_view,
)
from vision.cameras.record import record_rig

MATRIX = np.array([[420.0, 0.3, 310], [0, 425, 252], [0, 0, 1]])
NEAR, FAR = 60.0, 900.0
NEAR_TO_FAR = SelectionParameters(near_mm=NEAR, far_mm=FAR)
LENSES = {
    "barrel": [-0.28, 0.09, 0.001, -0.0008, -0.012],
    "tilted": [-0.15, 0.02, 0, 0, 0, 0, 0, 0, 0.002, 0, -0.003, 0, 0.03, -0.02],
}


def looking_around(count: int, seed: int) -> list[np.ndarray]:
    rng = np.random.default_rng(seed)
    return list(perturb(pose_of([100, -50, 30]), rng.normal(size=(count, 6)) * [250, 250, 250, 2, 2, 2]))


def points_seen(camera: Camera, world_from_camera: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Which points (n, 3) OpenCV projects into the picture, and lie between the depths."""
    rotation = world_from_camera[:3, :3].T
    local = (points - world_from_camera[:3, 3]) @ rotation.T
    between = (local[:, 2] > NEAR) & (local[:, 2] < FAR)
    # Beyond what the lens was measured for the polynomial may fold back: the rays of the picture end before.
    between &= np.hypot(local[:, 0], local[:, 1]) < camera.field_radius * local[:, 2]
    zero = np.zeros(3)
    pixels = cv2.projectPoints(local, zero, zero, camera.matrix, camera.distortion)[0].reshape(-1, 2)
    inside = (pixels > -0.5).all(axis=1) & (pixels < [camera.width - 0.5, camera.height - 0.5]).all(axis=1)
    return np.asarray(between & inside)


@pytest.mark.parametrize(("lens", "engine"), [("barrel", "duckdb"), ("tilted", "postgresql")])
def test_no_part_with_a_point_in_the_picture_is_left_out(
    lens: str, engine: str, new_store: Callable[[str], str], tmp_path: Path
) -> None:
    """In Python and in SQL, which give the same rows; a view without the lens's distortion would leave some out."""
    camera = Camera(640, 480, MATRIX, np.array(LENSES[lens]))
    rig = Rig({"only": camera}, {"only": np.eye(4)})
    model = SyntheticModel(7)
    rng = np.random.default_rng(1)
    placed = [p for name, place in PLACES.items() for p in model.placed(name, place)]
    within = np.concatenate([np.ones((1, 3)) / 2, rng.uniform(size=(40, 3))])
    clouds = []
    for part in placed:
        low, high = np.split(model.shape_boxes[part.shape], 2)
        clouds.append((low + within * (high - low)) @ part.world_from_part[:3, :3].T + part.world_from_part[:3, 3])
    poses, target = looking_around(6, 2), new_store(engine)
    with Store.open(target) as store:
        fill(store, tmp_path)
        with Run.begin(store, "inspect", {}) as run, run.write() as connection:
            record_rig(run, connection, rig)
            camera_id = int(connection.execute(store.table("camera").select()).one().id)
        lenses = camera, Camera(640, 480, MATRIX)
        views = [build_view_volume(lens, at, NEAR_TO_FAR) for lens in lenses for at in poses]
        found = in_volumes(store, views)
    statements = []
    for pose in poses:
        numbers = ", ".join(f"CAST({x!r} AS DOUBLE PRECISION)" for x in [*pose[:3].ravel().tolist(), NEAR, FAR])
        statements.append(f"SELECT path FROM parts_in_view({camera_id}, {numbers}) ORDER BY occurrence_id")  # noqa: S608
    answers = rows_of(target, statements)
    seen_at_all = missed_without = 0
    for number, (pose, answer) in enumerate(zip(poses, answers, strict=True)):
        listed = [row[0] for row in answer]
        expected, undistorted = (found["path"][found["volume_no"] == number + more] for more in (0, len(poses)))
        assert listed == expected.tolist()
        seen = {p.path for p, cloud in zip(placed, clouds, strict=True) if points_seen(camera, pose, cloud).any()}
        assert seen <= set(listed)
        seen_at_all += len(seen)
        missed_without += len(seen - set(undistorted.tolist()))
    assert seen_at_all > 20
    assert missed_without > 0


def test_the_box_and_the_faces_of_a_view_are_those_of_its_corners(duckdb_file: Path) -> None:
    """Of a camera with more skew than any has, so that leaving it out is told."""
    skewed, poses = np.array([[420.0, 90.0, 310], [0, 425, 150], [0, 0, 1]]), looking_around(3, 4)
    with Store.open(duckdb_file) as store, Run.begin(store, "inspect", {}) as run, run.write() as connection:
        record_rig(run, connection, Rig({"only": Camera(640, 480, skewed)}, {"only": np.eye(4)}))
        camera_id = int(connection.execute(store.table("camera").select()).one().id)
    ask = f"SELECT x0, y0, z0, x1, y1, z1, half_spaces FROM aimed_view({camera_id}, {', '.join(14 * ['{}::DOUBLE'])})"  # noqa: S608
    answers = rows_of(str(duckdb_file), [ask.format(*pose[:3].ravel().tolist(), NEAR, FAR) for pose in poses])
    pixels = np.stack(np.meshgrid([-0.5, 639.5], [-0.5, 479.5], 1.0), axis=-1).reshape(-1, 3)
    corners = np.concatenate([depth * pixels @ np.linalg.inv(skewed).T for depth in (NEAR, FAR)])
    for pose, ((*box, half_spaces),) in zip(poses, answers, strict=True):
        world = corners @ pose[:3, :3].T + pose[:3, 3]
        np.testing.assert_allclose(box, [*world.min(axis=0), *world.max(axis=0)], atol=1e-6)
        normal, offset = np.split(np.reshape(half_spaces, (6, 4)), [3], axis=1)
        beneath = (offset - normal @ world.T) / np.linalg.norm(normal, axis=1)[:, None]
        assert (beneath > -1e-6).all()
        assert np.unique(beneath < 1e-6, axis=0).sum(axis=1).tolist() == [4] * 6


def test_superfluous_parts_are_counted_against_sampled_views(duckdb_file: Path, tmp_path: Path) -> None:
    camera = Camera(640, 480, MATRIX, np.array(LENSES["barrel"]))
    cameras = {"left": camera, "right": Camera(640, 480, MATRIX)}
    rig = Rig(cameras, {"left": np.eye(4), "right": pose_of([120, 0, 0])})
    with Store.open(duckdb_file) as store:
        oracle: Oracle = fill(store, tmp_path)
        prior = Prior.isotropic(looking_around(2, 5)[1], 10.0, 0.01)
        views = [
            build_view_volume(camera, pose @ rig.rig_from_camera[name], NEAR_TO_FAR)
            for pose in sample_poses(prior, NEAR_TO_FAR)
            for name, camera in rig.cameras.items()
        ]
        selected = select_in_view(store, rig, prior, NEAR_TO_FAR, level="part")
        union = set().union(*(oracle.in_view(view, "part") for view in views))
        assert selected.shown.sum() == len(union)
        assert 0 < selected.superfluous == len(selected.shown) - len(union)
        assert selected.superfluous <= 0.5 * len(selected.shown)


def test_probability_of_what_stands_at_the_edge_of_the_view() -> None:
    """A point at x, where a camera sees as far as e to the side, is in view as probably as the camera is moved by more
    than x - e: the normal distribution's tail."""
    camera = Camera(101, 101, np.array([[100.0, 0, 50], [0, 100, 50], [0, 0, 1]]), np.empty(0))
    rig = Rig({"only": camera}, {"only": np.eye(4)})
    sigma, depth = 3.0, 200.0
    covariance = np.diag([sigma**2, 1e-12, 1e-12, 1e-16, 1e-16, 1e-16])
    prior = Prior(np.eye(4), covariance)
    edge = 50.5 / 100 * depth
    x = edge + np.array([-12.0, -3, 0, 3, 12])
    found = {f"{axis}{end}": np.zeros(5) for axis in "xyz" for end in (0, 1)}
    found |= {"x0": x, "x1": x, "z0": np.full(5, depth), "z1": np.full(5, depth)}
    found |= {f"shape_{name}": values for name, values in found.items()}
    found |= {f"m{i}{j}": np.full(5, float(i == j)) for i in range(3) for j in range(4)}
    got = probabilities_in_view(rig, prior, found, SelectionParameters(near_mm=10, far_mm=1000, drawn_poses=800))
    assert np.abs(got - norm.sf((x - edge) / sigma)).max() < 0.03
