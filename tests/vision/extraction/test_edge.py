"""The kernels of edges against the same written out pixel by pixel and pair by pair, in double precision."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import convolve

from relmodel.arrays import Floats32
from vision.extraction import edge_kernels


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
