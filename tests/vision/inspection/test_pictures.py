"""What is said of pictures before they are looked at: limits from both sides, and blur that is known."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from tests.vision.localisation.scenes import box_scene
from vision.cameras.cameras import Camera, Rig
from vision.extraction.rows import Primitives
from vision.inspection.pictures import (
    Fault,
    PictureParameters,
    Quality,
    describe,
    doubt_pictures,
    find_faults,
    in_light_of_model,
    measure_blur,
    measure_mosaic,
)
from vision.localisation.localise import Localisation
from vision.localisation.verdict import Verdict
from vision.localisation.views import Observation

LIMITS = PictureParameters()
FINE = Quality(edges=20.0, blur_px=0.8, saturated=0.01, mosaic=0.0, stale_run=None)


@pytest.mark.parametrize(
    ("quality", "words", "refuses"),
    [
        (FINE, None, False),
        (replace(FINE, stale_run=9), "camera left was given the picture that the other camera was given", True),
        (replace(FINE, stale_run=4), "camera left shows the picture of run 4, and the other camera another", True),
        (replace(FINE, edges=0.99), "camera left shows next to nothing: 0.99 edge elements", True),
        (replace(FINE, edges=1.0), None, False),
        (replace(FINE, blur_px=2.5), None, False),
        (replace(FINE, blur_px=2.6), "the picture of camera left is blurred: its edges are spread by 2.6 px", False),
        (replace(FINE, blur_px=3.6), "the picture of camera left is blurred", True),
        (replace(FINE, blur_px=float("nan")), None, False),
        (replace(FINE, mosaic=0.9), None, False),
        (replace(FINE, mosaic=1.1), "the picture of camera left is a raw Bayer mosaic", True),
        (replace(FINE, saturated=0.2), None, False),
        (replace(FINE, saturated=0.25), "the picture of camera left is overexposed: 25% of it", False),
        (replace(FINE, saturated=0.66), "the picture of camera left is overexposed: 66% of it", True),
    ],
)
def test_pictures_are_doubted_from_their_limits_on(quality: Quality, words: str | None, refuses: bool) -> None:
    found = find_faults({"left": quality, "right": FINE}, 9, LIMITS)
    if words is None:
        assert found == []
    else:
        (fault,) = found
        assert fault.camera == "left"
        assert fault.words.startswith(words)
        assert fault.refuses == refuses
    among = find_faults({"a": replace(FINE, stale_run=9), "b": FINE, "c": FINE}, 9, LIMITS)
    assert "the picture that another camera was given" in among[0].words


def test_what_refuses_a_picture_refuses_the_pose_and_is_said_first() -> None:
    verdict = Verdict("ambiguous", "two poses", 0.6, ["two poses"], 1.0, 0.1, "x")
    noted, grave = Fault("a", "blurred a little", False), Fault("b", "covered", True)
    assert doubt_pictures(verdict, [noted]) is verdict
    found = doubt_pictures(verdict, [noted, grave])
    assert (found.verdict, found.reason, found.missing) == ("refused", "covered; two poses", ["covered", "two poses"])
    assert found.posterior == 0.6


@pytest.mark.parametrize("sigma", [0.8, 1.5, 3.0])
@pytest.mark.parametrize("contrast", [60.0, 160.0])
def test_blur_is_the_sigma_of_straight_edges(sigma: float, contrast: float) -> None:
    y, x = np.mgrid[0:240, 0:320]
    board = 40 + contrast * ((x // 40 + y // 40) % 2 == 0)
    grey = gaussian_filter(board.astype(float), sigma)
    assert measure_blur(grey) == pytest.approx(sigma, abs=0.13)
    assert measure_blur(grey.T) == pytest.approx(sigma, abs=0.13)
    assert np.isnan(measure_blur(np.full((240, 320), 90.0)))


@pytest.mark.parametrize("first", [(0, 0), (0, 1), (1, 0), (1, 1)])
def test_a_mosaic_is_told_by_its_green_pixels(first: tuple[int, int]) -> None:
    """Whichever pixel is the first, of any size; slopes and edges of one pixel's width are none."""
    y, x = np.mgrid[0:101, 0:80]
    plain = 90 + 0.3 * x + 0.2 * y + 40 * (x > 33) + np.random.default_rng(1).normal(0, 2, x.shape)
    gain = np.array([[0.7, 1.0], [1.0, 0.5]])[(y + first[0]) % 2, (x + first[1]) % 2]
    assert measure_mosaic(plain) < 0.3
    assert measure_mosaic(plain * gain) == pytest.approx(plain.mean() * (1 - 0.6), rel=0.02)


def test_a_picture_is_described_by_its_pixels() -> None:
    grey = np.full((100, 200), 120.0)
    grey[:30, :100] = 255
    found = describe(grey, cast(Primitives, SimpleNamespace(elements=SimpleNamespace(x=np.zeros(50)))), 3)
    assert (found.edges, found.saturated, found.stale_run) == (2.5, 0.15, 3)


@pytest.mark.parametrize("share", [0.0, 0.25, 1.0])
def test_a_model_is_as_bright_as_the_pixels_that_show_it(share: float) -> None:
    """A plate of 200 x 160 px on a white table, white from its left end up to a share of its length."""
    scene = box_scene([(np.array([-100.0, -80.0, -2.0]), np.array([200.0, 160.0, 2.0]))])
    camera = Camera(400, 300, np.array([[500.0, 0, 199.5], [0, 500.0, 149.5], [0, 0, 1]]))
    grey = np.full((300, 400), 255.0)
    grey[70:230, 100 + round(200 * share) : 300] = 90.0
    down = np.array([[1.0, 0, 0, 0], [0, -1, 0, 0], [0, 0, -1, 500], [0, 0, 0, 1]])
    rig, seen = Rig({"a": camera}, {"a": np.eye(4)}), SimpleNamespace(pictures=["a"], greys={"a": grey})
    found = cast(Localisation, SimpleNamespace(rig=rig, best=SimpleNamespace(world_from_rig=down)))
    for whole, now in ((0.66, pytest.approx(share, abs=0.03)), (0.65, 0.65)):
        taken = {"a": replace(FINE, saturated=whole)}
        assert in_light_of_model(taken, cast(Observation, seen), scene, found, LIMITS)["a"].saturated == now
