"""Pieces, their axes and their edges turned about their middle, against geometry."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from relmodel.arrays import Floats
from relmodel.geometry.transforms import rotation_matrix
from tests.vision.account.test_samples import box_samples
from tests.vision.localisation.scenes import above, box_scene, stereo_rig
from vision.account.runs import EdgeRuns
from vision.presence.displaced import (
    Aspects,
    CameraPoses,
    Displacements,
    PieceEdges,
    add_turned,
    find_axes,
    list_pieces,
    report_displacements,
)
from vision.presence.items import Items
from vision.presence.presence_parameters import DEFAULTS


def eyes() -> CameraPoses:
    rig, pose = stereo_rig(), above(10, -20, 560)
    poses = [pose @ rig.rig_from_camera[name] for name in rig.cameras]
    return CameraPoses(np.stack(poses), np.stack([camera.matrix for camera in rig.cameras.values()]))


def test_points_are_projected_and_moved_as_cameras_do() -> None:
    it, rng = eyes(), np.random.default_rng(1)
    camera, point, ways = rng.integers(0, 2, 30), rng.uniform(-80, 80, (30, 3)), rng.normal(size=(30, 2, 3))
    pixel, flow = it.project(camera, point, ways)
    rig = stereo_rig()
    for i in range(30):
        lens = list(rig.cameras.values())[camera[i]]
        at = np.linalg.inv(it.pose[camera[i]])

        def see(place: Floats) -> Floats:
            return np.asarray(lens.project((place @ at[:3, :3].T + at[:3, 3])[None])[0][0])  # noqa: B023

        np.testing.assert_allclose(pixel[i], see(point[i]))
        for k in range(2):
            numeric = (see(point[i] + 1e-5 * ways[i, k]) - see(point[i] - 1e-5 * ways[i, k])) / 2e-5
            np.testing.assert_allclose(flow[i, k], numeric, rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize("size", [(90.0, 60, 12), (12, 90, 60), (60, 12, 90)])
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_the_axes_of_a_plate_lie_in_it_and_look_ahead(size: tuple[float, float, float], sign: float) -> None:
    scene = box_scene([(np.zeros(3), np.array(size)), (np.full(3, 200.0), np.full(3, 500.0))])
    thin = int(np.argmin(size))
    found = find_axes(scene, np.array([0]), sign * (np.eye(3)[thin] + 0.3))
    np.testing.assert_allclose(found @ found.T, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(found[2], sign * np.eye(3)[thin], atol=1e-12)
    np.testing.assert_allclose(np.cross(found[2], found[0]), found[1], atol=1e-12)


def some_pieces(pieces: list[int]) -> tuple[PieceEdges, Aspects]:
    scene, samples, _ = box_samples()
    weight = np.where(np.arange(len(samples.run)) % 7 == 0, 0.0, samples.length_px)
    runs = cast(
        EdgeRuns,
        SimpleNamespace(chance=np.arange(samples.run_count) / 100, shows=1 - np.arange(samples.run_count) / 200),
    )
    edges, aspects = list_pieces(scene, np.array([0, 1]), np.array(pieces), samples, weight, runs, eyes())
    rows = np.isin(scene.surface_occurrence[samples.surface[:, 0]], pieces) & (weight > 0)
    np.testing.assert_array_equal(edges.point, samples.point[rows])
    np.testing.assert_array_equal(edges.edge, samples.run[rows])
    np.testing.assert_array_equal(edges.chance, samples.run[rows] / 100)
    np.testing.assert_array_equal(edges.shows, 1 - samples.run[rows] / 200)
    np.testing.assert_array_equal(edges.length, weight[rows])
    for number, piece in enumerate(pieces):
        own = edges.aspect == number
        assert (scene.surface_occurrence[samples.surface[rows][own, 0]] == piece).all()
        centre = np.average(edges.point[own], axis=0, weights=edges.length[own])
        np.testing.assert_allclose(aspects.centre[number], centre)
        np.testing.assert_allclose(aspects.axes[number, 2], [0, 0, 1], atol=1e-9)  # toward the cameras
    return edges, aspects


def test_pieces_are_seen_as_their_samples_are_and_few_of_many_stand_for_all() -> None:
    edges, _ = some_pieces([0, 1])
    some = edges.thin(40)
    for camera in (0, 1):
        for aspect in (0, 1):
            own = (edges.camera == camera) & (edges.aspect == aspect)
            mine = (some.camera == camera) & (some.aspect == aspect)
            assert mine.sum() == -(-own.sum() // (1 + own.sum() // 40)) <= 40
            assert some.length[mine].sum() == pytest.approx(edges.length[own].sum(), rel=0.15)


def test_a_lost_piece_is_looked_for_at_every_turn_about_its_middle() -> None:
    scene, _, _ = box_samples()
    edges, aspects = some_pieces([1])
    more, every = add_turned(scene, np.array([0, 1]), np.array([1]), edges, aspects, eyes(), DEFAULTS.parts)
    np.testing.assert_allclose(np.degrees(every.angle), np.arange(72) * 5.0)
    assert every.piece.tolist() == [1] * 72
    middle = np.array([0.0, 0, 20])
    np.testing.assert_allclose(every.centre[1:], np.tile(middle, (71, 1)), atol=1e-9)
    usual = [np.average(v, weights=edges.length) for v in (edges.chance, edges.shows)]
    for aspect in (1, 30, 71):
        mine = more.take(more.aspect == aspect)
        back = (mine.point - middle) @ rotation_matrix(np.array([0, 0, every.angle[aspect]])) + middle
        gap = np.linalg.norm(back[:, None] - scene.sample_point[None, scene.sample_arc >= 12], axis=2).min(axis=1)
        assert gap.max() < 1e-9
        np.testing.assert_allclose([mine.chance.min(), mine.shows.max()], usual)
        pose = eyes().pose
        for camera in (0, 1):
            own = mine.camera == camera
            # Of the twelve edges those three that no face toward the camera has are not there.
            eye = (pose[camera, :3, 3] - middle) @ rotation_matrix(np.array([0, 0, every.angle[aspect]])) + middle
            low, high = np.array([-50.0, -40, 0]), np.array([50.0, 40, 40])
            faces = int((eye < low).sum() + (eye > high).sum())
            assert len(np.unique(mine.edge[own])) == {1: 4, 2: 7, 3: 9}[faces]
            assert np.linalg.norm(mine.direction[own], axis=1) == pytest.approx(np.ones(own.sum()))
            assert mine.length[own].sum() > 100


def test_what_a_displaced_part_is_told_to_have_done() -> None:
    covariance = np.stack([np.diag([0.04, 0.09, 0.01]), np.eye(3)])
    it = Displacements(
        np.array([1, 3]), np.array([[3.0, -0.9, 0], [0, 0, 0]]), covariance, np.radians([10.0, 1]),
        np.radians([0.5, 2]), np.array([9.0, -1]), np.array([True, False]), np.array([False, False]),
    )  # fmt: skip
    way = np.array([3.0, -0.9]) / np.hypot(3, 0.9)
    np.testing.assert_allclose(it.sigma[0], np.sqrt(way[0] ** 2 * 0.04 + way[1] ** 2 * 0.09))
    items = cast(Items, SimpleNamespace(level=["part", "part", "feature"], occurrence=np.array([1, 3, 1])))
    found = report_displacements(items, it, DEFAULTS.states)
    assert found.what == ["displacement", "dx", "dy", "dz", "turn"]
    assert found.item.tolist() == [0] * 5
    np.testing.assert_allclose(found.value, [np.hypot(3, 0.9), 3, -0.9, 0, 10])
    np.testing.assert_allclose(found.sigma, [it.sigma[0], 0.2, 0.3, 0.1, 0.5])
    # .9 mm differ from none by 3 sigmas only, and it is not turned.
    assert found.changed.tolist() == [True, True, False, False, False]
