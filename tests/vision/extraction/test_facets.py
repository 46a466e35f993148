"""The facet kernels against least squares written out."""

import numpy as np
import pytest

from relmodel.arrays import Floats, Floats32
from relmodel.errors import UsageError
from vision.extraction import edges
from vision.extraction.edges import MOMENTS, gaussian_kernels, in_bands


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
