"""The rendered pairs of the shared data, and which arcs of both pictures show the same edge: by edge id and depth."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from scipy.ndimage import maximum_filter, minimum_filter
from scipy.spatial import cKDTree

from relmodel.arrays import Bools, Bytes, Floats, Ints
from relmodel.geometry.transforms import apply, inverse
from vision.cameras.cameras import Camera, Rig
from vision.stereo.crossings import StereoArcs
from vision.stereo.epipolar import DepthRange

NAMES = ("left", "right")
ON_EDGE = 2.0  # px from an arc's point to a visible edge that it lies on
SAME_PLACE = 3.0  # px between an arc's point and where the other picture's edge point should be seen, and mm in space
SILHOUETTE = 10_000  # edge ids from here on are outlines of curved faces, elsewhere on the face in each picture


@dataclass(frozen=True)
class EdgePoints:
    """Visible edge samples of one picture: uv (n, 2) px, points (n, 3) mm in the rig's frame, edge id (n,)."""

    uv: Floats
    points: Floats
    edge: Ints


@dataclass(frozen=True)
class RenderedPair:
    """A pair whose rig frame is the left camera's: pictures and visible edges by camera, depth map of the left one
    (mm, 0 for nothing)."""

    rig: Rig
    pictures: dict[str, Bytes]
    edges: dict[str, EdgePoints]
    depth: Floats


def read_pair(folder: Path, pair: int) -> RenderedPair:
    """Pair number `pair` of a folder of rendered pairs."""
    stem = f"pair_{pair:02d}"
    truth = json.loads((folder / f"{stem}_truth.json").read_text())
    cameras = {n: Camera(1280, 960, np.array(truth["cameras"][n]["K"])) for n in NAMES}
    rig = Rig(cameras, {"left": np.eye(4), "right": np.array(truth["T_left_right"])})
    edges = {}
    for n in NAMES:
        e = np.load(folder / f"{stem}_{n}_edges.npz")
        uv, z = e["uv"].astype(float), e["z"].astype(float)
        rays = np.column_stack([uv, np.ones(len(uv))]) @ np.linalg.inv(cameras[n].matrix).T
        edges[n] = EdgePoints(uv, apply(rig.rig_from_camera[n], rays * z[:, None]), e["edge_id"].astype(np.int64))
    return RenderedPair(
        rig=rig,
        pictures={
            n: np.asarray(cv2.imread(str(folder / f"{stem}_{n}.png"), cv2.IMREAD_GRAYSCALE), np.uint8) for n in NAMES
        },
        edges=edges,
        depth=np.asarray(cv2.imread(str(folder / f"{stem}_left_depth.png"), cv2.IMREAD_UNCHANGED), float) / 10,
    )


def depth_maps(depth: Floats, slack: float, cell: int = 16) -> DepthRange:
    """What a prior off by `slack` mm would predict: least and greatest depth about each cell."""
    cells = depth.reshape(depth.shape[0] // cell, cell, depth.shape[1] // cell, cell)
    seen = depth[depth > 0]
    near = minimum_filter(np.where(cells > 0, cells, np.inf).min(axis=(1, 3)), 3)
    far = maximum_filter(cells.max(axis=(1, 3)), 3)
    near, far = np.where(far > 0, near, seen.min()), np.where(far > 0, far, seen.max())
    return DepthRange(near - slack, far + slack)


@dataclass(frozen=True)
class Siblings:
    """How the arcs of two pictures correspond.

    agreed (left arcs, right arcs): points of the left arc that the right arc shows too; left_size, right_size: points
    of each arc; left_known, right_known: those that lie on visible edges; real (left arcs,): whether 60 % of them do.
    """

    agreed: Ints
    left_size: Ints
    right_size: Ints
    left_known: Ints
    right_known: Ints

    @property
    def real(self) -> Bools:
        return np.asarray(self.left_known >= 0.6 * self.left_size, bool)

    def right(self, left: Ints, right: Ints) -> Bools:
        """Whether pairs of arcs show the same edge, at half of what is known of the shorter one."""
        shorter = np.minimum(self.left_known[left], self.right_known[right])
        return np.asarray((self.agreed[left, right] >= 0.5 * shorter) & (shorter > 0), bool)

    def possible(self, longer: bool = True) -> Bools:
        """Left arcs on edges that have a sibling: one that shares half of the longer arc, or else of the shorter."""
        size = (np.maximum if longer else np.minimum)(self.left_size[:, None], self.right_size)
        shared = (self.agreed >= 0.5 * size) & (self.agreed > 0)
        return np.asarray(self.real & shared.any(axis=1), bool)


def find_siblings(pair: RenderedPair, left: StereoArcs, right: StereoArcs) -> Siblings:
    """Which arcs show the same edge: the right arc passes within 3 px of where the left one's edge points are seen, on
    the same edge or within 3 mm of it."""
    arcs = {"left": left, "right": right}
    own = {n: np.repeat(np.arange(len(a)), np.diff(a.offsets)) for n, a in arcs.items()}
    distance, nearest = {}, {}
    for n in NAMES:
        d, i = cKDTree(pair.edges[n].uv).query(arcs[n].points, distance_upper_bound=ON_EDGE)
        distance[n], nearest[n] = np.asarray(d), np.where(np.isfinite(d), i, 0)
    on = {n: np.isfinite(d) for n, d in distance.items()}
    point = {n: pair.edges[n].points[nearest[n]] for n in NAMES}
    edge = {n: pair.edges[n].edge[nearest[n]] for n in NAMES}
    seen, _ = pair.rig.cameras["right"].project(apply(inverse(pair.rig.rig_from_camera["right"]), point["left"]))
    i = np.flatnonzero(on["left"])
    j = np.flatnonzero(on["right"])
    hits = cKDTree(seen[i]).sparse_distance_matrix(cKDTree(right.points[j]), SAME_PLACE, output_type="coo_matrix")
    a, b = i[hits.row], j[hits.col]
    same = edge["left"][a] == edge["right"][b]
    same |= np.linalg.norm(point["left"][a] - point["right"][b], axis=1) < SAME_PLACE
    a, b = a[same], b[same]
    key = np.unique(a * len(right) + own["right"][b])
    agreed = np.zeros((len(left), len(right)), np.int64)
    np.add.at(agreed, (own["left"][key // len(right)], key % len(right)), 1)
    size = {n: np.diff(arcs[n].offsets) for n in NAMES}
    known = {n: np.bincount(own[n][on[n]], minlength=len(arcs[n])) for n in NAMES}
    return Siblings(agreed, size["left"], size["right"], known["left"], known["right"])
