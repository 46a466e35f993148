"""The kernels of regions, parallels and labels against loops over pixels and elements."""

from __future__ import annotations

import numpy as np
import pytest

from relmodel.arrays import Floats32
from vision.extraction import region_kernels
from vision.extraction.topography import LABELS


def test_sums_of_regions_are_those_of_their_pixels() -> None:
    rng = np.random.default_rng(0)
    labels = np.repeat(rng.integers(-1, 5, (11, 6)), 3, axis=1).astype(np.int32)
    grey, depth = rng.uniform(0, 255, labels.shape), rng.uniform(0, 9, labels.shape).astype(np.float32)
    grey[3, 4] = 250.0
    out = np.zeros((5, 16))
    out[:, 11:13] = 1e9
    region_kernels.sums(labels, grey, depth, 250.0, out)
    for label in range(5):
        y, x = np.nonzero(labels == label)
        g = grey[y, x]
        sums = [np.ones(len(x)), x, y, x * x, x * y, y * y, g, g * g, x * g, y * g, g >= 250]
        ends = [x.min(), y.min(), x.max(), y.max(), depth[y, x].max()]
        np.testing.assert_allclose(out[label], [*(np.sum(v) for v in sums), *ends])


def test_elements_beside_are_those_of_like_turn_and_no_fainter() -> None:
    """Cells in a row, four turns, five grades; those up to two grades fainter count."""
    rng = np.random.default_rng(1)
    cell, turn, grade = rng.integers(1, 7, 80), rng.integers(0, 4, 80), rng.integers(0, 5, 80)
    alike = (np.add.outer(np.arange(4), [-1, 0, 1]).ravel() % 4 * 5).astype(np.int64)
    which, out = np.arange(0, 80, 3).astype(np.int32), np.zeros(27)
    region_kernels.parallels(
        (cell * 20).astype(np.int32), (turn * 5 + grade).astype(np.int32), np.array([-20, 0, 20]), alike, 5, which, 2,
        np.zeros(8 * 20, np.uint8), out,
    )  # fmt: skip
    for at, i in enumerate(which):
        near = (np.abs(cell - cell[i]) <= 1) & np.isin((turn - turn[i]) % 4, [0, 1, 3]) & (grade >= grade[i] - 2)
        assert out[at] == near.sum()


@pytest.mark.parametrize("noise", [0.0, 2.0])
def test_labels_are_those_of_the_extrema_along_the_axes_of_bending(noise: float) -> None:
    rng = np.random.default_rng(2)
    n = 3000
    a: Floats32 = (rng.normal(size=(10, n)) * np.array([100, 1.2, 1, 0.1, 1.2, 1, 0.1, 1, 0.1, 0.1])[:, None]).astype(
        np.float32
    )
    a[[2, 5, 7], : n // 3] *= 0.05
    a[[1, 4], : n // 6] *= 0.1
    labels, ridges = np.zeros(n, np.uint8), np.zeros((5, n), np.float32)
    region_kernels.classify(a, np.full(n, noise, np.float32), 0.6, 0.4, 0.5, 0.35, labels, ridges)
    steep, bend = max(0.6, 0.4 * noise), max(0.5, 0.35 * noise)
    checked: dict[str, int] = dict.fromkeys(LABELS, 0)
    for i in range(n):
        _, a01, a02, a03, a10, a11, a12, a20, a21, a30 = a[:, i].astype(float)
        values, axes = np.linalg.eigh(np.array([[2 * a20, a11], [a11, 2 * a02]]))
        signs, near, rows = [], [abs(np.hypot(a10, a01) - steep)], []
        for second, (r, c) in zip(values, axes.T, strict=True):
            first = a10 * r + a01 * c
            third = 3 * (a30 * r**3 + a21 * r * r * c + a12 * r * c * c + a03 * c**3)
            roots = np.roots([third, second, first])
            reach = 0.5 / max(abs(r), abs(c))
            near.append(abs(abs(second) - bend))
            if np.iscomplex(roots).any():
                continue
            step = float(np.real(roots[np.argmin(np.abs(roots))]))
            there = second + 2 * third * step
            near += [abs(abs(step) - reach), abs(abs(there) - bend)]
            if abs(step) <= reach and abs(there) > bend:
                signs.append(np.sign(there))
                rows.append((step, r, c, there))
        if min(near) < 1e-3 or abs(values[1] - values[0]) < 1e-2:
            continue
        if len(signs) == 2:
            label = "saddle" if signs[0] != signs[1] else "pit" if signs[0] > 0 else "peak"
        elif signs:
            label = "ravine" if signs[0] > 0 else "ridge"
        elif values[1] > bend and values[0] < -bend:
            label = "saddle_hill"
        elif np.abs(values).max() > bend:
            label = "concave" if values[0] < -bend else "convex"
        else:
            label = "slope" if np.hypot(a10, a01) > steep else "flat"
        assert LABELS[labels[i]] == label
        checked[label] += 1
        if label in ("ridge", "ravine"):
            step, r, c, there = rows[0]
            np.testing.assert_allclose(ridges[:2, i], [step * c, step * r], atol=2e-3)
            assert abs(ridges[2, i] * c + ridges[3, i] * r) == pytest.approx(1, abs=1e-4)
            assert ridges[4, i] == pytest.approx(there, abs=5e-3)
    assert min(checked[name] for name in checked if name not in ("inflection",)) > 3
