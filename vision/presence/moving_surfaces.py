"""Which surfaces carry predicted edges along when they move, and by how much.

An edge moves with either of its surfaces.  Where a wall runs out into a rounded corner, the corner moves with the wall,
and its edges with it: by as much as the corner's normal looks the wall's way.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from relmodel.arrays import Floats, Ints, sum_by_group
from vision.presence.samples import Samples
from vision.scene.stored_scene import StoredScene


@dataclass(frozen=True)
class MovingSurfaces:
    """What carries samples along, as columns, sorted by surface, run and sample: sample; side: of its two surfaces the
    one through which it is carried; surface: the scene's that carries; rate: px along the image normal for each mm that
    the surface moves outward."""

    sample: Ints
    side: Ints
    surface: Ints
    rate: Floats

    def displace(self, mm: Floats, count: int) -> Floats:
        """Px (n,) by which `count` samples move where surfaces (s,) lie mm outward."""
        return np.bincount(self.sample, self.rate * mm[self.surface], count).astype(float)


def find_tangent(stored: StoredScene, least_cosine: float) -> tuple[Ints, Ints, Floats]:
    """Planes with the cylinders into which they run smoothly, as pairs (m,), (m,), and the planes' normals (m, 3) in
    the world."""
    scene, count = stored.scene, len(stored.surface_no)
    arc, arcs = scene.sample_arc, len(stored.arc_surfaces)
    mean = np.bincount(arc, scene.sample_cosine, arcs) / np.maximum(np.bincount(arc, minlength=arcs), 1)
    smooth = np.flatnonzero((mean > least_cosine) & (stored.arc_surfaces >= 0).all(axis=1))

    total, number = np.zeros((count, 3)), np.zeros(count)
    for side, normal in ((0, scene.sample_normal_a), (1, scene.sample_normal_b)):
        surface = stored.arc_surfaces[arc, side]
        there = surface >= 0
        total += sum_by_group(surface[there], normal[there], count)
        number += np.bincount(surface[there], minlength=count)
    normal = total / np.maximum(number, 1)[:, None]
    flat = np.linalg.norm(normal, axis=1) > least_cosine
    pairs = stored.arc_surfaces[smooth]
    pairs = np.unique(np.concatenate([pairs, pairs[:, ::-1]]), axis=0)
    pairs = pairs[flat[pairs[:, 0]] & np.isfinite(stored.radius[pairs[:, 1]])]
    return pairs[:, 0], pairs[:, 1], normal[pairs[:, 0]]


def find_moving_surfaces(samples: Samples, tangent: tuple[Ints, Ints, Floats]) -> MovingSurfaces:
    """The surfaces that carry each sample: its own, and the planes tangent to them, from `find_tangent`."""
    sample, side = np.nonzero(samples.surface >= 0)
    surface, rate = samples.surface[sample, side], samples.px_per_mm[sample, side]
    plane, cylinder, normal = tangent
    order = np.argsort(cylinder, kind="stable")
    plane, cylinder, normal = plane[order], cylinder[order], normal[order]
    low, high = (np.searchsorted(cylinder, surface, side=end) for end in ("left", "right"))
    length = high - low
    of = np.repeat(np.arange(len(surface)), length)
    at = np.arange(len(of)) - np.repeat(np.cumsum(length) - length, length) + np.repeat(low, length)
    turned = np.einsum("ni,ni->n", samples.normal[sample[of], side[of]], normal[at])
    columns = [
        np.concatenate(pair)
        for pair in ((sample, sample[of]), (side, side[of]), (surface, plane[at]), (rate, rate[of] * turned))
    ]
    order = np.lexsort((columns[0], samples.run[columns[0]], columns[2]))
    return MovingSurfaces(*(np.ascontiguousarray(column[order]) for column in columns))
