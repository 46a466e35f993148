"""The relational join: pairs of circles in space with pairs of the model's, and the poses of the rig that they give."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from sqlalchemy import Connection

from relmodel.arrays import Floats, Ints
from relmodel.store.database import Database
from vision.constellations.circles import Circles, Relations
from vision.constellations.constellation_parameters import JoinParameters
from vision.constellations.lines import JoinedLines


@dataclass(frozen=True)
class JoinedPairs:
    """Pairs (k, 2) of the scene's circles with the pairs (k, 2) of the model's that they are like, the rarest first;
    alike (k,): how many pairs of the model the pair of the scene is like."""

    scene: Ints
    model: Ints
    alike: Ints


def join_pairs(
    store: Database, connection: Connection, object_id: int, relations: Relations, p: JoinParameters
) -> JoinedPairs:
    """Join `Circles.relations` of circles in space with those of an object: `queries/constellations/join.sql`."""
    names = (
        "sigmas", "least_radius_mm", "least_mm", "bin_mm", "least_cosine", "most_cosine", "along", "most_of_relation",
        "most",
    )  # fmt: skip
    with store.relation(connection, "scene_relation", relations):
        joined = store.columns(
            connection, "constellations/join", object_id=object_id, **{name: getattr(p, name) for name in names}
        )
    units, circles = (np.stack([joined[f"{n}_a"], joined[f"{n}_b"]], axis=1) for n in ("unit", "circle"))
    return JoinedPairs(units.astype(np.int64), circles.astype(np.int64), joined["alike"].astype(np.int64))


def count_alike(relations: Relations, joined: JoinedPairs | JoinedLines) -> Ints:
    """How many pairs of a model (k,) each relation of a scene is like; 0 for those that were not joined."""
    a, b = (np.asarray(relations[name], np.int64) for name in ("unit_a", "unit_b"))
    size = int(max(a.max(initial=-1), b.max(initial=-1))) + 1
    alike = np.zeros((size, size), np.int64)
    alike[joined.scene[:, 0], joined.scene[:, 1]] = joined.alike
    return np.asarray(np.maximum(alike[a, b], alike[b, a]))


def solve_poses(scene: Circles, model: Circles, joined: JoinedPairs) -> Floats:
    """Poses (k, 2, 4, 4), model from scene, of joined pairs: centres fall together along their line, and the normals of
    the first circles, whose sign is open, either way.  NaN where a pair leaves the turn about its line open."""
    a, b = joined.scene.T
    c, d = joined.model.T
    here = _frames(scene.centre[b] - scene.centre[a], scene.normal[a] + _aligned(scene.normal, a, b))
    out = np.zeros((len(a), 2, 4, 4))
    out[:, :, 3, 3] = 1
    normal = model.normal[c] + _aligned(model.normal, c, d)
    for way, sign in enumerate((1.0, -1.0)):
        there = _frames(model.centre[d] - model.centre[c], sign * normal)
        rotation = there @ here.transpose(0, 2, 1)
        middle = 0.5 * (scene.centre[a] + scene.centre[b])
        out[:, way, :3, :3] = rotation
        out[:, way, :3, 3] = 0.5 * (model.centre[c] + model.centre[d]) - np.einsum("kij,kj->ki", rotation, middle)
    return out


def _aligned(normal: Floats, a: Ints, b: Ints) -> Floats:
    """The normals (k, 3) of the second circles, turned to the side of the first's, where both are nearly parallel: both
    together are surer than one.  Zero elsewhere."""
    cosine = np.einsum("ij,ij->i", normal[a], normal[b])
    return np.asarray(np.where(np.abs(cosine) > 0.9, np.sign(cosine), 0.0)[:, None] * normal[b])


def _frames(line: Floats, normal: Floats) -> Floats:
    """Axes (k, 3, 3), as columns: along the line, across both, and of the normal's part across the line; NaN where
    there is no line or no such part."""
    x = _unit(line)
    z = _unit(normal - np.einsum("ij,ij->i", normal, x)[:, None] * x)
    return np.stack([x, np.cross(z, x), z], axis=2)


def _unit(vectors: Floats) -> Floats:
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.asarray(vectors / np.where(length > 1e-9, length, np.nan))
