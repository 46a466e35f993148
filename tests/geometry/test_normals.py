"""Normals at points against the cross product of the partial derivatives there."""

from __future__ import annotations

import numpy as np

from relmodel.geometry.surfaces import Surfaces, normals_at


def surfaces(count: int, seed: int) -> Surfaces:
    """Analytic surfaces in any frame, either hand, either sense."""
    rng = np.random.default_rng(seed)
    z = rng.normal(size=(count, 3))
    z /= np.linalg.norm(z, axis=1, keepdims=True)
    x = np.cross(z, rng.normal(size=(count, 3)))
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    origin = rng.uniform(-100, 100, (count, 3))
    frame = {
        f"{n}_{c}": v[:, i] for n, v in (("origin", origin), ("axis_x", x), ("axis_z", z)) for i, c in enumerate("xyz")
    }
    return Surfaces(
        {
            "kind": [("plane", "cylinder", "cone", "sphere", "torus")[i % 5] for i in range(count)],
            **frame,
            "direct": rng.random(count) < 0.5,
            "reversed": rng.random(count) < 0.5,
            "radius": rng.uniform(10, 50, count),
            "radius2": rng.uniform(1, 9, count),
            "semi_angle": rng.uniform(0.1, 1.4, count) * rng.choice([-1, 1], count),
            "u0": np.zeros(count),
            "u1": np.full(count, 6.0),
            "v0": np.full(count, -1.0),
            "v1": np.ones(count),
        }
    )


def test_normals_are_across_the_partial_derivatives() -> None:
    given = surfaces(400, 1)
    rng = np.random.default_rng(2)
    u, v = rng.uniform(0, 6, 400), rng.uniform(-1.5, 1.5, 400)
    v[np.arange(400) % 15 == 2] *= 200  # beyond the apex of a cone
    at = given.evaluate(np.arange(400), u, v)
    truth = np.cross(at.by_u, at.by_v)
    truth *= np.where(given.reversed, -1, 1)[:, None] / np.linalg.norm(truth, axis=1, keepdims=True)
    assert np.abs(normals_at(given, np.arange(400), at.points) - truth).max() < 1e-9


def test_what_a_point_does_not_tell_is_left_open() -> None:
    given = surfaces(5, 3)
    cone, torus = np.array([2]), np.array([4])
    apex = given.evaluate(cone, [0.3], -given.radius[cone] / np.sin(given.semi_angle[cone])).points
    assert np.isnan(normals_at(given, cone, apex)).all()
    given.radius2[4] = given.radius[4] + 1  # crosses itself
    assert np.isnan(normals_at(given, torus, given.evaluate(torus, [0.3], [0.2]).points)).all()
