"""Edge elements against closed-form blurred steps and discs with known noise."""

import numpy as np
import pytest
from scipy.ndimage import convolve

from relmodel.arrays import Floats, Floats32
from relmodel.errors import InputError, UsageError
from tests.vision.extraction.synthetic import step
from vision.extraction import edge_kernels, edges
from vision.extraction.edges import MOMENTS, detect_edges, estimate_noise, gaussian_kernels, in_bands
from vision.extraction.extract import extract

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
def test_one_element_for_every_row_or_column(angle: float, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(edges, "_BAND", 8 * 64)  # eight bands of eight rows
    found = detect_edges(step(angle, 0.2), 1.4)
    along = found.pixel % 64 if abs(np.sin(angle)) > abs(np.cos(angle)) else found.pixel // 64
    assert len(np.unique(along)) == len(along)
    assert np.ptp(along) == len(along) - 1 >= 40


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


def test_noise_is_counted_by_the_band_of_grey_of_every_second_row() -> None:
    grey = np.linspace(20, 235, 20)[:, None] + np.random.default_rng(0).normal(0, 4, (20, 17))
    grey[8, 3], grey[9, 5], grey[11, 7], grey[13, 2] = 0.4, 254.6, 254.4, 0.6
    grey = grey.astype(np.float32).astype(float)
    found = np.zeros((5, 40), np.int64)
    edge_kernels.high_pass_histogram(grey, np.empty((2, 17), np.float32), found)
    high = np.abs(convolve(grey, [[1, -2, 1], [-2, 4, -2], [1, -2, 1]]))
    mean = convolve(grey, np.ones((3, 3))) / 9
    expected = np.zeros((5, 40), np.int64)
    for r in range(1, 19, 2):
        for c in range(1, 16):
            band = 4 if not 0.5 < grey[r, c] < 254.5 else int(mean[r, c] * 4 / 256)
            expected[band, min(int(high[r, c] + 0.5), 39)] += 1
    np.testing.assert_array_equal(found, expected)
    assert (expected.sum(axis=1) > 0).all()


LIMITS = {"kappa": 0.8, "operator": 1.9, "shade": 4.0, "chance": 6.0, "offset": 0.7, "contrast": 20.0, "sigma": 0.15}


def test_steps_are_those_of_the_gaussian_with_the_same_derivatives() -> None:
    rng = np.random.default_rng(2)
    n = 4000
    a: Floats32 = rng.normal(0, 1, (10, n)).astype(np.float32)
    a *= np.array([100, 8, 1, 1.2, 8, 1, 1.2, 1, 1.2, 1.2], np.float32)[:, None]
    noise: Floats32 = rng.uniform(0.2, 3, n).astype(np.float32)
    covariance: Floats32 = np.array([0.002, 0.003, 0.0004, 0.0007], np.float32)
    out, seen = np.zeros((6, n), np.float32), np.zeros(n, bool)
    kappa, operator, shade, chance, offset, least, most = LIMITS.values()
    edge_kernels.steps(a, noise, covariance, kappa, operator, shade, chance, offset, least, most, out, seen)
    kinds = np.zeros(6, int)
    for i in range(n):
        _, a01, a02, a03, a10, a11, a12, a20, a21, a30 = a[:, i].astype(float)
        g = np.hypot(a10, a01)
        s, o = a10 / g, a01 / g
        second = 2 * (a20 * s * s + a11 * s * o + a02 * o * o)
        third = 6 * (a30 * s**3 + a21 * s * s * o + a12 * s * o * o + a03 * o**3)
        q = second**2 - g * third
        if third >= 0 or q < 1e-2:
            assert not (third >= 0 and seen[i])
            kinds[0] += 1
            continue
        variance, raw = g * g / q, g * second / q
        height = g * np.exp(0.5 * LIMITS["kappa"] ** 2 * second**2 / q)
        contrast = height * np.sqrt(2 * np.pi * variance)
        var_second = 4 * (0.002 * (s**4 + o**4) + 0.003 * s * s * o * o)
        var_third = 36 * (0.0004 * (s**6 + o**6) + 0.0007 * (s**4 * o * o + s * s * o**4))
        by = (g / q * (second**2 + g * third) / q, second * g / q * g / q)
        sigma = LIMITS["kappa"] * float(noise[i]) * np.sqrt(by[0] ** 2 * var_second + by[1] ** 2 * var_third)
        blur = np.sqrt(max(variance - LIMITS["operator"], 0))
        np.testing.assert_allclose(out[[0, 1, 2, 3, 5], i], [0.8 * raw, o, s, contrast, sigma], rtol=4e-3, atol=1e-4)
        np.testing.assert_allclose(out[4, i] ** 2, blur**2, rtol=5e-3, atol=5e-3)
        tests = [abs(0.8 * raw) / 0.7, 4.0 / g**2, 6.0 * float(noise[i]) ** 2 / g**2, 20.0 / contrast, sigma / 0.15]
        if min(abs(t - 1) for t in tests) > 1e-2:
            assert seen[i] == (max(tests) < 1)
            kinds[1:] += np.array(tests) > 1
    assert seen.sum() > 50
    assert (kinds > 10).all()


def test_a_step_is_as_high_as_its_bend_says() -> None:
    """By e to a power of up to .6, as where it bends most within its cell."""
    power = np.array([0.05, 0.3, 0.6])
    kappa = 1.1
    second = np.sqrt(2 * power / kappa**2)  # of a slope of 1, where q is 1: the third derivative makes up for it
    a: Floats32 = np.zeros((10, 3), np.float32)
    a[4], a[7], a[9] = 1.0, second / 2, (second**2 - 1) / 6
    out, none = np.zeros((6, 3), np.float32), np.zeros(4, np.float32)
    edge_kernels.steps(a, np.ones(3, np.float32), none, kappa, 0, 0, 0, 9, 0, 9, out, np.zeros(3, bool))
    np.testing.assert_allclose(out[3], np.sqrt(2 * np.pi) * np.exp(power), rtol=1e-5)


def test_elements_are_linked_with_the_cheapest_ahead_and_behind() -> None:
    rng = np.random.default_rng(3)
    rows, columns = 24, 30
    at = np.full((rows, columns), -1, np.int32)
    pixel = np.sort(rng.choice(rows * columns, 300, replace=False)).astype(np.int32)
    at[pixel // columns, pixel % columns] = np.arange(300)
    x, y = pixel % columns + rng.uniform(-0.5, 0.5, 300), pixel // columns + rng.uniform(-0.5, 0.5, 300)
    turn = rng.normal(0, 0.5, 300) + np.where(rng.random(300) < 0.2, np.pi, 0)
    nx, ny = np.cos(turn), np.sin(turn)
    best = np.full((2, 300), -1, np.int32)
    edge_kernels.best_links(x, y, nx, ny, pixel, at, np.array([0.6, 0.5, 2.0, 3.0]), np.full((2, 300), 1e9), best)
    for i in range(300):
        costs: list[dict[int, float]] = [{}, {}]
        for j in range(300):
            apart = np.abs([pixel[i] // columns - pixel[j] // columns, pixel[i] % columns - pixel[j] % columns])
            cosine = nx[i] * nx[j] + ny[i] * ny[j]
            if i == j or apart.max() > 2 or cosine < 0.6:
                continue
            way, tangent = np.array([x[j] - x[i], y[j] - y[i]]), np.array([-ny[i] - ny[j], nx[i] + nx[j]])
            along = way @ tangent / np.linalg.norm(way) / np.linalg.norm(tangent)
            if abs(along) >= 0.5:
                costs[int(along < 0)][j] = np.linalg.norm(way) + 2 * (1 - cosine) + 3 * (1 - abs(along))
        for side in (0, 1):
            assert best[side, i] == (min(costs[side], key=lambda j: costs[side][j]) if costs[side] else -1)
    assert (best >= 0).sum() > 200


def least_squares(window: Floats, sigma: float) -> Floats:
    k = len(window) // 2
    r, c = (axis.ravel().astype(float) for axis in np.mgrid[-k : k + 1, -k : k + 1])
    design = np.stack([r**i * c**j for i, j in MOMENTS], axis=1)
    weight = np.exp(-0.25 * (r**2 + c**2) / sigma**2)
    return np.asarray(np.linalg.lstsq(design * weight[:, None], window.ravel() * weight, rcond=None)[0])


@pytest.mark.parametrize("sigma", [1.0, 1.4, 2.0, 2.8])
def test_moments_equal_weighted_least_squares(sigma: float) -> None:
    """The monomials' coefficients by least squares, against the moments of P2 = t^2 - alpha and P3 = t^3 - beta t."""
    kernels = gaussian_kernels(sigma)
    k = kernels.radius
    t, weight = np.arange(-k, k + 1), kernels.one_d[0]
    alpha = weight @ t**2
    beta = weight @ t**4 / alpha
    for window in np.random.default_rng(1).uniform(0, 255, (3, 2 * k + 1, 2 * k + 1)):
        a = dict(zip(MOMENTS, np.sum(kernels.moments * window, axis=(1, 2)), strict=True))
        a[0, 0] -= alpha * (a[2, 0] + a[0, 2])
        a[1, 0] -= beta * a[3, 0] + alpha * a[1, 2]
        a[0, 1] -= beta * a[0, 3] + alpha * a[2, 1]
        np.testing.assert_allclose(list(a.values()), least_squares(window, sigma), atol=1e-10 * 255)


def test_covariance_is_that_of_white_noise() -> None:
    kernels = gaussian_kernels(1.4)
    size = 2 * kernels.radius + 1
    noise = np.random.default_rng(2).normal(0, 3.0, (1100, size, size))
    found = np.einsum("nrc,krc->kn", noise, kernels.moments)
    expected = 9.0 * kernels.moment_covariance
    scale = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    assert np.all(np.abs(np.cov(found) - expected) < 0.12 * scale)


@pytest.mark.parametrize("band", [40, 1000, 1 << 15])
def test_moments_of_bands_are_those_of_the_picture(band: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(edges, "_BAND", band)
    image, kernels = np.random.default_rng(3).uniform(-20, 280, (53, 37)), gaussian_kernels(1.4)
    curve = np.linspace(1.0, 2.0, 256)

    def moments_and_noise(first: int, moments: Floats32, noise: Floats32) -> tuple[int, Floats32, Floats32]:
        return first, moments, noise

    firsts, moments, noise = zip(*in_bands(image, kernels, curve, moments_and_noise), strict=True)
    assert list(firsts) == [sum(len(part) for part in noise[:i]) for i in range(len(firsts))]
    found = np.concatenate(moments, axis=1).reshape(10, 53, 37)
    padded = np.pad(image, kernels.radius, mode="symmetric")
    windows = np.lib.stride_tricks.sliding_window_view(padded, (2 * kernels.radius + 1,) * 2)
    expected = np.einsum("rcij,kij->krc", windows, kernels.moments)
    np.testing.assert_allclose(found, expected, atol=1e-4)
    level = np.clip(found[0], 0, 255).astype(int)
    np.testing.assert_allclose(np.concatenate(noise).reshape(53, 37), curve[level], rtol=1e-6)


def test_unusable_windows_are_refused() -> None:
    with pytest.raises(UsageError, match="outside"):
        gaussian_kernels(0.2)
