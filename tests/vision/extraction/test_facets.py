"""The facet kernels against least squares written out."""

import numpy as np
import pytest

from relmodel.arrays import Floats, Floats32
from relmodel.errors import UsageError
from vision.extraction import facets
from vision.extraction.facets import FacetKernels, facet_coefficients, gaussian_kernels, in_bands, plain_kernels

ALL_KERNELS = [plain_kernels(n) for n in (5, 7, 9, 11)] + [gaussian_kernels(s) for s in (1.0, 1.4, 2.0, 2.8)]


def least_squares(window: Floats, kernels: FacetKernels) -> Floats:
    k = kernels.radius
    r, c = (axis.ravel().astype(float) for axis in np.mgrid[-k : k + 1, -k : k + 1])
    design = np.stack([r**0, r, c, r**2, r * c, c**2, r**3, r**2 * c, r * c**2, c**3], axis=1)
    weight = np.ones(len(r)) if kernels.sigma is None else np.exp(-0.25 * (r**2 + c**2) / kernels.sigma**2)
    return np.asarray(np.linalg.lstsq(design * weight[:, None], window.ravel() * weight, rcond=None)[0])


@pytest.mark.parametrize("kernels", ALL_KERNELS)
def test_coefficients_equal_weighted_least_squares(kernels: FacetKernels) -> None:
    rng = np.random.default_rng(1)
    k = kernels.radius
    image = rng.uniform(0, 255, (2 * k + 9, 2 * k + 7))
    found = facet_coefficients(image, kernels)
    for row, column in [(k, k), (k + 3, k + 2), (k + 8, k + 6)]:
        window = image[row - k : row + k + 1, column - k : column + k + 1]
        expected = least_squares(window, kernels)
        np.testing.assert_allclose(found[:, row, column], expected, atol=1e-10 * 255)
        np.testing.assert_allclose(np.sum(kernels.coefficients * window, axis=(1, 2)), expected, atol=1e-10 * 255)


def test_plain_constants_are_those_of_the_paper() -> None:
    for size, alpha, beta in [(5, 2, 3.4), (7, 4, 7), (9, 20 / 3, 11.8), (11, 10, 17.8)]:
        kernels = plain_kernels(size)
        assert kernels.alpha == pytest.approx(alpha)
        assert kernels.beta == pytest.approx(beta)


@pytest.mark.parametrize("kernels", [plain_kernels(7), gaussian_kernels(1.4)])
def test_covariance_is_that_of_white_noise(kernels: FacetKernels) -> None:
    noise = np.random.default_rng(2).normal(0, 3.0, (400, 400))
    found = facet_coefficients(noise, kernels)[:, ::12, ::12].reshape(10, -1)
    expected = 9.0 * kernels.coefficient_covariance
    scale = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    assert np.all(np.abs(np.cov(found) - expected) < 0.12 * scale)


@pytest.mark.parametrize("band", [40, 1000, 1 << 15])
def test_moments_of_bands_are_those_of_the_picture(band: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(facets, "_BAND", band)
    image, kernels = np.random.default_rng(3).uniform(-20, 280, (53, 37)), gaussian_kernels(1.4)
    curve = np.linspace(1.0, 2.0, 256)
    order = [
        facets.MOMENTS.index(pair)
        for pair in ((0, 0), (0, 1), (0, 2), (0, 3), (1, 0), (1, 1), (1, 2), (2, 0), (2, 1), (3, 0))
    ]

    def moments_and_noise(first: int, moments: Floats32, noise: Floats32) -> tuple[int, Floats32, Floats32]:
        return first, moments.copy(), noise

    firsts, moments, noise = zip(*in_bands(image, kernels, curve, moments_and_noise), strict=True)
    assert list(firsts) == [sum(len(part) for part in noise[:i]) for i in range(len(firsts))]
    found = np.concatenate(moments, axis=1).reshape(10, 53, 37)
    padded = np.pad(image, kernels.radius, mode="symmetric")
    windows = np.lib.stride_tricks.sliding_window_view(padded, (2 * kernels.radius + 1,) * 2)
    expected = np.einsum("rcij,kij->krc", windows, kernels.moments[order])
    np.testing.assert_allclose(found, expected, atol=1e-4)
    level = np.clip(found[0], 0, 255).astype(int)
    np.testing.assert_allclose(np.concatenate(noise).reshape(53, 37), curve[level], rtol=1e-6)


def test_unusable_windows_are_refused() -> None:
    with pytest.raises(UsageError, match="take 5, 7, 9 or 11"):
        plain_kernels(6)
    with pytest.raises(UsageError, match="outside"):
        gaussian_kernels(0.2)
