"""Symmetries of the model: motions of the whole that carry its arcs onto its arcs, so that no picture tells the poses
apart that they lead to."""

from __future__ import annotations

from typing import Any

import numpy as np

from relmodel.arrays import Bools, Floats, Ints
from vision.localisation.align import align_with_lines
from vision.localisation.localisation_parameters import SymmetryParameters
from vision.scene.scene import Scene


def find_symmetries(scene: Scene, best: Floats, others: list[Floats], p: SymmetryParameters) -> list[Floats | None]:
    """For each pose of the rig beside the best, all (4, 4), the motion (4, 4) of the world that carries the model onto
    itself and the best pose there; None where there is none but the identity."""
    if not others:
        return []
    arcs = _Arcs(scene, p)
    return [arcs.fit(other @ np.linalg.inv(best)) for other in others]


def complete_group(motions: list[Floats], p: SymmetryParameters) -> list[Floats]:
    """All motions (4, 4) that follow from some by doing one after the other, the identity first; no more than
    `p.most`."""
    group = [np.eye(4)]
    for member in group:  # grows as it is walked
        for motion in motions:
            new = motion @ member
            if len(group) < p.most and all(np.abs(new - known).max() > p.same for known in group):
                group.append(new)
    return group


class _Arcs:
    """Samples of the model's sharp arcs, to see whether a motion carries them onto themselves."""

    def __init__(self, scene: Scene, p: SymmetryParameters) -> None:
        from scipy.spatial import cKDTree

        rows = scene.reference_samples
        rows = rows[scene.sample_cosine[rows] < np.cos(p.sharp_rad)]
        self.p, self.point, self.tangent = p, scene.sample_point[rows], scene.sample_tangent[rows]
        self.length = scene.sample_length[rows]
        self.some = np.unique(np.linspace(0, max(len(rows) - 1, 0), p.few).astype(np.int64))
        self._tree: Any = cKDTree(self._key(self.point, self.tangent))

    def fit(self, motion: Floats) -> Floats | None:
        """The symmetry (4, 4) near a motion; None where there is none."""
        if not len(self.point):
            return None
        for reach in self.p.reaches_mm:
            found, point, tangent, across = self._meet(motion, self.some, reach)
            if found.mean() < self.p.least_share:
                return None
            middle, weight = point.mean(axis=0)[None], found[None].astype(float)
            motion = align_with_lines(point[None], tangent[None], across[None], weight, middle)[0] @ motion
        every = np.arange(len(self.point))
        found, _, _, across = self._meet(motion, every, self.p.reaches_mm[-1])
        is_same = found.all() and float(np.linalg.norm(across, axis=1).max()) <= self.p.tolerance_mm
        # A pose beside the best leads back to it: the identity says nothing of the model.
        moved = self.point @ motion[:3, :3].T + motion[:3, 3] - self.point
        is_identity = float(np.linalg.norm(moved, axis=1).max()) <= 2 * self.p.tolerance_mm
        return motion if is_same and not is_identity else None

    def _meet(self, motion: Floats, rows: Ints, reach: float) -> tuple[Bools, Floats, Floats, Floats]:
        """Of samples (n,) moved: which lie on an arc that runs the same way, within a sample's stretch of it and
        `reach` mm; where they are, that arc's tangents, and what lies across it between them, (n, 3) each."""
        point = self.point[rows] @ motion[:3, :3].T + motion[:3, 3]
        turned = self.tangent[rows] @ motion[:3, :3].T
        _, nearest = self._tree.query(self._key(point, turned))
        tangent = self.tangent[nearest]
        off = point - self.point[nearest]
        distance = np.linalg.norm(off, axis=1)
        across = off - np.einsum("ni,ni->n", off, tangent)[:, None] * tangent
        parallel = np.abs(np.einsum("ni,ni->n", turned, tangent)) > self.p.parallel
        return (distance <= self.length[nearest] + reach) & parallel, point, tangent, across

    def _key(self, point: Floats, tangent: Floats) -> Floats:
        """Where (n, 9) samples lie and how they run, whichever way: where edges meet, the nearest has to run alike."""
        i, j = np.triu_indices(3)
        return np.hstack([point, self.p.alike_mm * tangent[:, i] * tangent[:, j]])
