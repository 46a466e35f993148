"""Where displaced parts lie, by simulated edges of two cameras, against where they were put."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from relmodel.arrays import Floats
from relmodel.geometry.transforms import rotation_matrix
from tests.poses import pose_of
from tests.vision.localisation.scenes import box_scene
from vision.account.runs import EdgeRuns
from vision.account.samples import Samples, find_nearby, measure_support
from vision.cameras.cameras import Camera, Rig
from vision.localisation.hypotheses import EdgePoints
from vision.localisation.measurements import EdgeIndex
from vision.localisation.views import find_view_arcs
from vision.presence.displaced import Displacements, find_pieces, measure_displacements
from vision.presence.presence_parameters import PresenceParameters
from vision.scene import Scene, StoredScene

P = PresenceParameters()
CAMERA = Camera(800, 600, np.array([[900.0, 0, 400], [0, 900, 300], [0, 0, 1]]))
# Both look down from a metre above, 150 mm apart.
RIG_POSE = np.array([[1.0, 0, 0, -40], [0, -1, 0, 30], [0, 0, -1, 1000], [0, 0, 0, 1]])
RIG = Rig({"left": CAMERA, "right": CAMERA}, {"left": np.eye(4), "right": pose_of([150.0, 0, 0])})


def scene(shift: Floats) -> Scene:
    """A plate of 500 by 400 mm, and on it two blocks, the second moved."""
    block = np.array([60.0, 40.0, 20.0])
    plate = (np.array([-250.0, -200.0, -30.0]), np.array([500.0, 400.0, 30.0]))
    return box_scene(
        [plate, (np.array([-150.0, -100.0, 0.0]), block), (np.array([80.0, 50.0, 0.0]) + shift, 1.5 * block)]
    )


def turned(it: Scene, angle: float) -> Scene:
    """The scene with the second block turned about the vertical through its middle."""
    rotation = rotation_matrix(np.array([[0.0, 0.0, angle]]))[0]
    vertex = np.zeros(len(it.vertices), bool)
    vertex[it.triangles[it.surface_occurrence[it.triangle_surface] == 2]] = True
    sample = it.arc_occurrence[it.sample_arc] == 2
    middle = 0.5 * (it.vertices[vertex].min(axis=0) + it.vertices[vertex].max(axis=0))
    rows = {"vertices": vertex, "vertex_normals": vertex, "sample_point": sample, "sample_tangent": sample}
    rows |= {"sample_normal_a": sample, "sample_normal_b": sample}
    changed = {}
    for name, mine in rows.items():
        values = getattr(it, name).copy()
        about = middle if name in ("vertices", "sample_point") else 0.0
        values[mine] = (values[mine] - about) @ rotation.T + about
        changed[name] = values
    return replace(it, **changed)


def measured(shift: Floats, missing: bool = False, angle: float = 0.0) -> Displacements:
    """What is measured where the second block is moved, turned or missing, and the model has it in place."""
    model, there = scene(np.zeros(3)), turned(scene(shift), angle)
    rng = np.random.default_rng(11)
    indexes: list[EdgeIndex] = []
    pieces: list[Samples] = []
    for number, name in enumerate(RIG.cameras):
        pose = RIG_POSE @ RIG.rig_from_camera[name]
        seen = find_view_arcs(there, CAMERA, pose).samples
        normal = np.stack([-seen.direction[:, 1], seen.direction[:, 0]], axis=1)
        keep = there.arc_occurrence[seen.arc] != 2 if missing else np.ones(len(seen.arc), bool)
        place = seen.pixel + 0.15 * normal * rng.normal(size=(len(normal), 1))
        count, bounds = int(keep.sum()), (np.zeros(2), np.array([800.0, 600.0]))
        indexes.append(
            EdgeIndex(EdgePoints(place[keep], normal[keep], np.full(count, 40.0), np.full(count, 0.1), *bounds, 200.0))
        )
        view = find_view_arcs(model, CAMERA, pose)
        n, runs = len(view.samples.arc), pieces[-1].run.max() + 1 if pieces else 0
        surface = np.stack([6 * model.arc_occurrence[view.samples.arc], np.full(n, -1)], axis=1)
        pieces.append(
            Samples(
                camera=np.full(n, number), run=view.run + runs, view_run=view.run, kind=np.zeros(n, np.int8),
                arc=view.samples.arc, surface=surface, kin=surface, point=view.samples.point,
                pixel=view.samples.pixel, direction=view.samples.direction, normal=np.zeros((n, 2, 3)),
                px_per_mm=np.zeros((n, 2)), length_px=view.samples.length_px,
                front=np.full(n, 2), inside=np.ones(n, bool),
            )
        )  # fmt: skip
    samples = Samples(*(np.concatenate([getattr(s, name) for s in pieces]) for name in Samples.__dataclass_fields__))
    nearby = find_nearby(samples.camera, samples.pixel, samples.direction, indexes, np.zeros(2), P.account.samples)
    stored = SimpleNamespace(scene=model, paths=["it/plate", "it/block", "it/moved"])
    support = measure_support(samples, nearby, P.account.support)
    runs = cast(
        EdgeRuns, SimpleNamespace(chance=np.full(samples.run_count, 0.05), shows=np.full(samples.run_count, 0.8))
    )
    return measure_displacements(
        cast(StoredScene, stored), RIG, RIG_POSE, indexes, np.zeros(2), samples, nearby, support, runs, P
    )


@pytest.mark.parametrize("shift", [(3.0, -2.0, 0.0), (0.0, 2.5, 0.0)])
def test_a_part_that_has_moved_is_told_by_how_much(shift: tuple[float, float, float]) -> None:
    found = measured(np.array(shift))
    assert found.occurrence[(found.far | found.turned)].tolist() == [2]
    (row,) = np.flatnonzero(found.far | found.turned)
    np.testing.assert_allclose(found.shift[row], shift, atol=0.3)
    assert (np.abs(found.shift[row] - shift) < 4 * found.shift_sigma[row]).all()
    assert found.distance[row] == pytest.approx(np.linalg.norm(shift), abs=0.3)
    assert abs(found.turn[row]) < np.radians(1)


def test_a_part_that_is_turned_is_told_by_how_much() -> None:
    """A block looks alike turned by a half more."""
    degrees = -62.0
    found = measured(np.array([1.5, -1.0, 0.0]), angle=np.radians(degrees))
    assert found.occurrence[found.turned].tolist() == [2]
    (row,) = np.flatnonzero(found.turned)
    off = (np.degrees(found.turn[row]) - degrees + 90) % 180 - 90
    assert abs(off) < 0.5
    np.testing.assert_allclose(found.shift[row], [1.5, -1.0, 0.0], atol=0.4)


def test_parts_in_place_have_not_moved() -> None:
    found = measured(np.zeros(3))
    assert 0 not in found.occurrence  # the pose hangs on the plate
    assert not (found.far | found.turned).any()
    assert (found.distance < 0.3).all()


def test_a_missing_part_lies_nowhere() -> None:
    assert not measured(np.zeros(3), missing=True).far.any()


def test_the_parts_of_an_assembly_are_one_piece() -> None:
    one = find_pieces(["it/body", "it/clip/plate", "it/clip/bolt", "it/bolt", "other"])
    assert one[1] == one[2]
    assert len(np.unique(one)) == 4
