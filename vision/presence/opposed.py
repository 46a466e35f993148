"""Flat faces of one feature that are opposite each other, and how far they can move: a rib keeps some thickness, a
pocket some width, and neither is larger than its part."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from relmodel.arrays import Floats, Ints
from vision.presence.items import Items
from vision.scene.scene import Scene


@dataclass(frozen=True)
class Opposed:
    """Pairs of faces, as columns: item: the rib, web or pocket; one, other: the scene's surfaces; mm: what is between
    them by the model; sign: whether that grows (1, material) or shrinks (-1, room) as they move outward; most: what the
    part can hold between them, mm."""

    item: Ints
    one: Ints
    other: Ints
    mm: Floats
    sign: Ints
    most: Floats

    def sizes(self, moved: Floats) -> Floats:
        """What is between the faces where surfaces (s,) lie so far outward, mm."""
        return np.asarray(self.mm + self.sign * (moved[self.one] + moved[self.other]))

    def meet(self, moved: Floats, least: float) -> Ints:
        """Pairs of surfaces (2, m), both ways, between which less than `least` mm would be left, or more than the part
        can hold."""
        size = self.sizes(moved)
        rows = np.flatnonzero((size < least) | (size > self.most))
        pairs = np.stack([self.one[rows], self.other[rows]])
        return np.concatenate([pairs, pairs[::-1]], axis=1)

    def limit(self, moved: Floats, least: float) -> tuple[Floats, Floats]:
        """How far in and out (s,) each surface can lie, mm, with those opposite where they are: `least` is left."""
        low, high = np.full(len(moved), -np.inf), np.full(len(moved), np.inf)
        bounds = np.sort(self.sign * (np.stack([np.full(len(self.mm), least), self.most]) - self.mm), axis=0)
        for surface, opposite in ((self.one, self.other), (self.other, self.one)):
            np.maximum.at(low, surface, bounds[0] - moved[opposite])
            np.minimum.at(high, surface, bounds[1] - moved[opposite])
        return low, high


def find_opposed(items: Items, scene: Scene, middle: Floats, normal: Floats) -> Opposed:
    """Opposite faces of ribs, webs and pockets; middle, normal (s, 3): of surfaces, the mean of the unit normals."""
    flat = np.linalg.norm(normal, axis=1) > 0.99
    material = np.isfinite(items.thickness)[items.member]
    rows = np.flatnonzero(flat[items.surface] & (material | (np.array(items.kind)[items.member] == "pocket")))
    pairs = [np.zeros((2, 0), np.int64)]
    for k in range(1, int(np.bincount(items.member[rows]).max(initial=1))):
        same = items.member[rows[:-k]] == items.member[rows[k:]]
        pairs.append(np.stack([rows[:-k][same], rows[k:][same]]))
    first, second = np.concatenate(pairs, axis=1)
    item, one, other = items.member[first], items.surface[first], items.surface[second]
    across = np.einsum("ni,ni->n", normal[one], middle[other] - middle[one])
    sign = np.where(material[first], 1, -1)
    facing = np.einsum("ni,ni->n", normal[one], normal[other])
    opposite = (facing < np.where(sign > 0, -0.98, -0.9999)) & (sign * across < 0)  # sides of ribs have draft
    order = np.flatnonzero(opposite)[np.lexsort((other[opposite], one[opposite], item[opposite]))]
    item, one, other = item[order], one[order], other[order]
    mm = np.where(sign[order] > 0, items.thickness[item], across[order])
    return Opposed(item, one, other, mm, sign[order], _extents(scene, one, normal[one]))


def _extents(scene: Scene, surface: Ints, normal: Floats) -> Floats:
    """How long (n,) the parts of surfaces are along directions (n, 3), by the middles of their surfaces."""
    count = len(scene.surface_occurrence)
    number = np.maximum(np.bincount(scene.triangle_surface, minlength=count), 1)
    corners = scene.vertices[scene.triangles].mean(axis=1)
    middle = np.stack([np.bincount(scene.triangle_surface, c, count) for c in corners.T], axis=1) / number[:, None]
    along = normal @ middle.T
    apart = scene.surface_occurrence[surface][:, None] != scene.surface_occurrence
    return np.asarray(np.where(apart, -np.inf, along).max(axis=1) - np.where(apart, np.inf, along).min(axis=1))
