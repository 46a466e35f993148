"""Edge elements against closed-form blurred steps and discs with known noise."""

import numpy as np
import pytest

from relmodel.errors import InputError
from tests.vision.extraction.synthetic import disc, step
from vision.extraction.edges import detect_edges, estimate_noise
from vision.extraction.extract import extract
from vision.extraction.extraction_parameters import EdgeParameters

ANGLES = np.deg2rad([0, 10, 22.5, 33, 45, 60, 80, 90, 135, 200, 290])


@pytest.mark.parametrize(("sigma", "blur"), [(1.0, 0.7), (1.4, 1.5), (2.8, 0.7)])
def test_clean_step_is_found_where_it_is(sigma: float, blur: float) -> None:
    for angle in ANGLES[::2]:
        for offset in (0.05, 0.5):
            found = detect_edges(step(angle, offset, blur=blur), sigma)
            distance = (found.x - 31.5) * np.cos(angle) + (found.y - 31.5) * np.sin(angle) - offset
            assert np.abs(distance).max() < 0.012
            # The normal points to the bright side; height and blur are the step's own.
            assert (found.nx * np.cos(angle) + found.ny * np.sin(angle)).min() > 0.9999
            np.testing.assert_allclose(found.contrast, 100.0, rtol=0.02)
            np.testing.assert_allclose(found.width, np.hypot(blur, 12**-0.5), atol=0.06)


@pytest.mark.parametrize("sigma", [1.0, 2.8])
def test_edges_are_true_up_to_near_the_border(sigma: float) -> None:
    least = 64
    for angle in ANGLES[::2]:
        for offset in (-24.0, 0.2, 24.0):
            found = detect_edges(step(angle, offset), sigma)
            distance = (found.x - 31.5) * np.cos(angle) + (found.y - 31.5) * np.sin(angle) - offset
            assert np.abs(distance).max(initial=0.0) < 0.02
            row, column = np.divmod(found.pixel, 64)
            least = min(least, *(int(place.min(initial=64)) for place in (row, column, 63 - row, 63 - column)))
    assert least == np.ceil(2.5 * sigma)


@pytest.mark.parametrize("angle", ANGLES[::3])
def test_one_element_for_every_row_or_column(angle: float) -> None:
    found = detect_edges(step(angle, 0.2), 1.4)
    along = found.pixel % 64 if abs(np.sin(angle)) > abs(np.cos(angle)) else found.pixel // 64
    assert len(np.unique(along)) == len(along)
    assert np.ptp(along) == len(along) - 1 >= 40


@pytest.mark.parametrize(("snr", "limit"), [(40, 0.04), (10, 0.13), (5, 0.25)])
def test_predicted_sigma_is_the_scatter(snr: float, limit: float) -> None:
    rng = np.random.default_rng(3)
    distances, sigmas = [], []
    for angle in ANGLES:
        image = step(angle, 0.2, (96, 96)) + rng.normal(0, 100.0 / snr, (96, 96))
        found = detect_edges(image, 1.4, EdgeParameters(min_contrast=40))
        distance = (found.x - 47.5) * np.cos(angle) + (found.y - 47.5) * np.sin(angle) - 0.2
        near = np.abs(distance) < 1.5
        distances.append(distance[near])
        sigmas.append(found.sigma[near])
    distance, sigma = np.concatenate(distances), np.concatenate(sigmas)
    scatter = float(np.sqrt(np.mean(distance**2)))
    assert abs(distance.mean()) < 0.02
    assert scatter < limit
    assert float(np.sqrt(np.mean(sigma**2))) == pytest.approx(scatter, rel=0.2)


def test_noise_is_measured_beside_edges() -> None:
    rng = np.random.default_rng(4)
    image = np.where(step(0.4, 0.0, (256, 256)) > 110, 180.0, 60.0)
    noisy = image + rng.normal(0, np.where(image > 110, 6.0, 3.0))
    curve = estimate_noise(noisy)
    assert curve[60] == pytest.approx(3.0, rel=0.08)
    assert curve[180] == pytest.approx(6.0, rel=0.08)


def test_pure_noise_gives_few_elements() -> None:
    image = 120 + np.random.default_rng(5).normal(0, 5.0, (200, 200))
    assert len(detect_edges(image, 1.4)) < 0.002 * image.size


def test_disc_is_a_closed_ring_of_elements() -> None:
    image = disc(60.3, 58.8, 30.0, (120, 120))
    found = detect_edges(image, 1.4)
    radius = np.hypot(found.x - 60.3, found.y - 58.8)
    # Smoothing and blur together pull a curved edge in by S^2 / 2R.
    assert radius.mean() - 30.0 == pytest.approx(-(1.4**2 + 0.7**2) / 60.0, abs=0.005)
    assert np.all((60.3 - found.x) * found.nx + (58.8 - found.y) * found.ny > 0)


def test_sixteen_bits_give_what_eight_bits_give() -> None:
    image = step(0.3, 0.1)
    deep = detect_edges(np.round(image * 257).astype(np.uint16))
    np.testing.assert_allclose(deep.x, detect_edges(image).x, atol=0.01)


def test_border_constant_and_wrong_images() -> None:
    assert len(detect_edges(np.zeros((5, 5), np.uint8))) == 0
    assert len(detect_edges(np.full((80, 80), 255, np.uint8))) == 0
    with pytest.raises(InputError, match="not a grey image"):
        detect_edges(np.zeros((4, 4, 3)))
    with pytest.raises(InputError, match="not finite"):
        detect_edges(np.full((40, 40), np.nan))
    for what, said in ((np.full((9, 9), 1 + 2j), "complex128"), (np.full((9, 9), "a"), "give numbers")):
        with pytest.raises(InputError, match=said):
            detect_edges(what)
    for beyond in (np.inf, -np.inf, 1e30, 65535.0):
        image = np.full((40, 40), 100.0)
        image[7, 9] = beyond
        with pytest.raises(InputError, match=r"finite|give grey"):
            detect_edges(image)


def test_the_same_picture_in_any_form_of_array() -> None:
    """Byte order, strides, read-only memory, whole numbers of any width, one bit."""
    grey = np.round(step(0.5, 0.2))
    two = np.where(grey > 110, 255.0, 0.0)
    fixed = grey.copy()
    fixed.flags.writeable = False
    forms = [
        *(grey.astype(kind) for kind in (np.uint8, np.int16, np.int64, np.float32, ">f8")),
        *((grey * 257).astype(kind) for kind in ("<u2", ">u2")),
        np.asfortranarray(grey),
        np.repeat(grey, 2, axis=1)[:, ::2],
        fixed,
        grey.tolist(),
    ]
    found = extract(grey)
    for form in forms:
        np.testing.assert_array_equal(extract(form).arcs.x, found.arcs.x)
    np.testing.assert_array_equal(detect_edges(two > 100).x, detect_edges(two).x)
