"""Displacements and diameters from simulated edges, against what they were simulated with."""

from __future__ import annotations

import numpy as np
import pytest

from relmodel.arrays import Floats
from tests.vision.presence.test_elements_beside import edge_points, samples_at
from vision.localisation.measurements import EdgeIndex
from vision.presence.moved import Pulls, collect_pulls, seek_moved
from vision.presence.parameters import MovedParameters, PresenceParameters
from vision.presence.samples import Samples, find_beside
from vision.presence.sizes import measure_offsets
from vision.presence.support import Support, measure_support

P = PresenceParameters()


def ring(radius: float, centre: Floats, count: int) -> tuple[Floats, Floats]:
    """Points of a circle and its unit normals outward."""
    angle = 2 * np.pi * np.arange(count) / count
    outward = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return centre + radius * outward, outward


def bore(true_radius: float, aside: Floats, noise: float) -> tuple[Samples, Support, Pulls]:
    """A bore of 40 mm radius at (100, 100), 1.2 px a mm, seen with another radius and place; px."""
    scale, centre = 1.2, np.array([100.0, 100.0])
    pixel, outward = ring(40 * scale, centre, 300)
    direction = np.stack([-outward[:, 1], outward[:, 0]], axis=1)
    image_normal = np.stack([-direction[:, 1], direction[:, 0]], axis=1)
    # A bore's surface faces the axis.
    normal = -np.concatenate([outward, np.zeros((300, 1))], axis=1)
    rate = scale * np.einsum("ni,ni->n", normal[:, :2], image_normal)
    samples = samples_at(pixel, direction, np.tile([0, 1], (300, 1)), np.zeros(300, np.int64))
    up = np.tile([0.0, 0.0, 1.0], (300, 1))
    samples = Samples(
        **{
            **samples.__dict__,
            "normal": np.stack([normal, up], axis=1),
            "px_per_mm": np.stack([rate, np.zeros(300)], axis=1),
        }
    )
    rng = np.random.default_rng(5)
    there, facing = ring(true_radius * scale, centre + scale * aside, 420)
    there = there + rng.normal(size=(420, 1)) * noise * facing
    index = EdgeIndex(edge_points(there, facing))
    beside = find_beside(samples, [index], np.zeros(1), P.samples)
    support = measure_support(samples, beside, P.support)
    return samples, support, collect_pulls(samples, beside, support, np.zeros(420, bool), P.moved)


@pytest.mark.parametrize(("radius", "aside"), [(40.0, (0.0, 0.0)), (40.6, (0.4, -0.3)), (39.2, (-0.5, 0.2))])
def test_a_bore_s_radius_and_place_are_measured(radius: float, aside: tuple[float, float]) -> None:
    samples, support, pulls = bore(radius, np.array(aside), noise=0.15)
    found = measure_offsets(samples, support, pulls, np.array([0]), np.zeros(1), np.zeros((1, 3)), P.sizes)
    assert found.closed[0]
    assert 40 - found.mm[0] == pytest.approx(radius, abs=3 * found.sigma[0])
    assert 40 - found.mm[0] == pytest.approx(radius, abs=0.1)
    assert found.shift[0] == pytest.approx([*aside, 0.0], abs=0.1)
    assert found.sigma[0] < 0.2


def test_a_bore_of_another_size_is_sought_and_found() -> None:
    samples, support, pulls = bore(34.0, np.zeros(2), noise=0.15)
    assert not support.found.any()
    sought = np.array([0])
    moved = seek_moved(samples, support, pulls, sought, 1, P.moved, P.runs, P.samples.reach_px)
    assert moved.mm[0] == pytest.approx(6.0, abs=P.moved.step_mm)
    assert moved.log_odds.sum() > 3
    assert moved.found[0, 0] > 0.95
    found = measure_offsets(samples, support, pulls, sought, moved.mm, np.zeros((1, 3)), P.sizes)
    assert found.mm[0] == pytest.approx(6.0, abs=3 * found.sigma[0])


def test_texture_moves_nothing() -> None:
    """Elements all over the place, no ring among them: the best displacement is no better than chance."""
    samples, support, _ = bore(40.0, np.zeros(2), noise=0.15)
    rng = np.random.default_rng(7)
    angle = rng.uniform(0, 2 * np.pi, 3000)
    index = EdgeIndex(edge_points(rng.uniform(20, 180, (3000, 2)), np.stack([np.cos(angle), np.sin(angle)], axis=1)))
    beside = find_beside(samples, [index], np.zeros(1), P.samples)
    support = measure_support(samples, beside, P.support)
    pulls = collect_pulls(samples, beside, support, np.zeros(3000, bool), P.moved)
    moved = seek_moved(samples, support, pulls, np.array([0]), 1, MovedParameters(), P.runs, P.samples.reach_px)
    assert moved.log_odds.sum() < 1
