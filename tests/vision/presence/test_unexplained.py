"""What a drawn picture of a box shows more than the box."""

from __future__ import annotations

import numpy as np
import pytest

from relmodel.arrays import Floats
from tests.vision.localisation.scenes import box_scene
from vision.cameras.cameras import Camera, Rig
from vision.extraction.extract import extract
from vision.extraction.rows import make_primitives
from vision.localisation.hypotheses import collect_edge_points
from vision.localisation.measurements import EdgeIndex
from vision.localisation.views import find_view_arcs
from vision.presence.items import CLOSED, REGION, UnexplainedElements, find_unexplained
from vision.presence.presence_parameters import UnexplainedParameters

SIZE, FOCAL, DISTANCE = (400, 300), 500.0, 1000.0
# The upper face of a box of 400 by 280 mm, seen from straight above: 200 by 140 px in the middle of the picture.
CAMERA = Camera(*SIZE, np.array([[FOCAL, 0, 199.5], [0, FOCAL, 149.5], [0, 0, 1.0]]))
POSE = np.array([[1.0, 0, 0, 0], [0, -1, 0, 0], [0, 0, -1, DISTANCE], [0, 0, 0, 1]])


def draw(*patches: tuple[float, float, float, float], box: float = 150.0) -> Floats:
    """The box on a dark ground, and discs (x, y, radius px, grey): blurred by half a pixel, with noise."""
    import cv2

    y, x = np.mgrid[0:1200, 0:1600] / 4 - 0.375
    grey = np.where((np.abs(x - 199.5) < 100) & (np.abs(y - 149.5) < 70), box, 40.0)
    for centre_x, centre_y, radius, value in patches:
        grey[np.hypot(x - centre_x, y - centre_y) < radius] = value
    small = cv2.GaussianBlur(cv2.resize(grey, SIZE, interpolation=cv2.INTER_AREA), (0, 0), 0.6)
    return np.asarray(np.clip(small + np.random.default_rng(3).normal(size=small.shape) * 2.0, 0, 255))


def unexplained(picture: Floats) -> UnexplainedElements:
    scene = box_scene([(np.array([-200.0, -140, -50]), np.array([400.0, 280, 50]))])
    rig = Rig({"left": CAMERA}, {"left": np.eye(4)})
    seen = make_primitives(extract(picture))
    index = EdgeIndex(collect_edge_points(seen, CAMERA))
    views = {"left": find_view_arcs(scene, CAMERA, POSE)}
    return find_unexplained(scene, rig, {"left": seen}, [index], POSE, views, UnexplainedParameters())


def test_a_picture_of_the_model_leaves_nothing_unexplained() -> None:
    assert not len(unexplained(draw()).kind)


@pytest.mark.parametrize(("x", "grey", "beyond"), [(160.0, 90.0, False), (240.0, 210.0, False), (50.0, 120.0, True)])
def test_a_disc_more_is_an_unexplained_region_and_arc(x: float, grey: float, beyond: bool) -> None:
    found = unexplained(draw((x, 150.0, 12.0, grey)))
    assert sorted(found.kind.tolist()) == [CLOSED, REGION]
    np.testing.assert_array_equal(found.beyond, [beyond, beyond])
    np.testing.assert_allclose(found.box, [[x - 12, 138, x + 12, 162]] * 2, atol=1.5)
    np.testing.assert_allclose(found.length, 2 * np.pi * 12, rtol=0.15)
    assert ((found.arc >= 0) == (found.kind == CLOSED)).all()
    assert ((found.region >= 0) == (found.kind == REGION)).all()


def test_a_dark_disc_in_glare_is_unexplained_and_a_spot_of_glare_is_not() -> None:
    found = unexplained(draw((160.0, 150.0, 12.0, 60.0), box=300.0))
    assert sorted(found.kind.tolist()) == [CLOSED, REGION]
    np.testing.assert_allclose(found.box, [[148, 138, 172, 162]] * 2, atol=1.5)
    assert not len(unexplained(draw((160.0, 150.0, 12.0, 300.0))).kind)


def test_what_the_border_of_the_picture_cuts_is_told_by_the_rest() -> None:
    (region,) = np.flatnonzero((found := unexplained(draw((0.0, 150.0, 20.0, 150.0)))).kind == REGION)
    assert found.beyond[region]
    assert found.length[region] == pytest.approx(np.pi * 20, rel=0.3)


def test_a_disc_that_hardly_differs_is_texture() -> None:
    assert not (unexplained(draw((160.0, 150.0, 12.0, 146.0))).kind == REGION).any()
