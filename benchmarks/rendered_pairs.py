"""The rendered pairs of the shared data, and which arcs of both pictures show the same edge: by edge id and depth."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from scipy.spatial import cKDTree

from relmodel.arrays import Bools, Bytes, Floats, Ints, Ints32
from relmodel.geometry.transforms import apply, inverse
from vision.cameras.cameras import Camera, Rig
from vision.extraction.rows import RegionColumns
from vision.stereo.epipolar import StereoArcs
from vision.stereo.triangulate import SpaceArcs

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
    """A pair in the left camera's frame: pictures and visible edges by camera, depth map of the left (mm, 0: none)."""

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


@dataclass(frozen=True)
class Siblings:
    """How the arcs of two pictures correspond.

    agreed (left arcs, right arcs): points of the left arc that the right arc shows too; left_size, right_size: points
    of each arc; left_known, right_known: those on visible edges; real (left arcs,): whether 60 % of them are."""

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
    """Which arcs show one edge: the right passes within 3 px of the left one's points, on that edge or within 3 mm."""
    arcs = {"left": left, "right": right}
    own = {n: np.repeat(np.arange(len(a)), np.diff(a.offsets)) for n, a in arcs.items()}
    beside = {n: _edges_beside(pair.edges[n], arcs[n].points) for n in NAMES}
    on = {n: np.bincount(at, minlength=len(own[n])) > 0 for n, (at, _) in beside.items()}
    point = {n: pair.edges[n].points[sample] for n, (_, sample) in beside.items()}
    edge = {n: pair.edges[n].edge[sample] for n, (_, sample) in beside.items()}
    seen, _ = pair.rig.cameras["right"].project(apply(inverse(pair.rig.rig_from_camera["right"]), point["left"]))
    there = right.points[beside["right"][0]]
    hits = cKDTree(seen).sparse_distance_matrix(cKDTree(there), SAME_PLACE, output_type="coo_matrix")
    i, j = hits.row, hits.col
    same = edge["left"][i] == edge["right"][j]
    same |= np.linalg.norm(point["left"][i] - point["right"][j], axis=1) < SAME_PLACE
    a, b = beside["left"][0][i], beside["right"][0][j]
    a, b = a[same], b[same]
    key = np.unique(a * len(right) + own["right"][b])
    agreed = np.zeros((len(left), len(right)), np.int64)
    np.add.at(agreed, (own["left"][key // len(right)], key % len(right)), 1)
    size = {n: np.diff(arcs[n].offsets) for n in NAMES}
    known = {n: np.bincount(own[n][on[n]], minlength=len(arcs[n])) for n in NAMES}
    return Siblings(agreed, size["left"], size["right"], known["left"], known["right"])


def _edges_beside(edges: EdgePoints, points: Floats) -> tuple[Ints, Ints]:
    """The visible edges that run by each of the points (n, 2), one behind another perhaps: (point, nearest sample)."""
    distance, nearest = cKDTree(edges.uv).query(points, k=_SAMPLES, distance_upper_bound=ON_EDGE)
    at, rank = np.nonzero(np.isfinite(distance))
    sample = np.asarray(nearest)[at, rank]
    _, first = np.unique(at * (edges.edge.max() + 1) + edges.edge[sample], return_index=True)
    return at[first], sample[first]


_SAMPLES = 12  # of the edges about a point that are looked at, the nearest first


def measure_ends(pair: RenderedPair, left: StereoArcs, space: SpaceArcs, wanted: Ints) -> Floats:
    """Mahalanobis distance squared (arcs, 2) of both ends across the true edge, of the left arcs `wanted`.

    Of the sharp edges that run within 2 px of 40 % of an arc, the one that speaks best for it, at the place that is
    seen where the end is; NaN where there is none.  Across: two degrees of freedom, whatever lies along the edge."""
    edges = pair.edges["left"]
    tree, out = cKDTree(edges.uv), np.full((len(space.first), 2), np.nan)
    focal = pair.rig.cameras["left"].matrix[0, 0]
    for k in np.flatnonzero(np.isin(space.first, wanted)).tolist():
        own = left.points[left.offsets[space.first[k]] : left.offsets[space.first[k] + 1]]
        beside = [np.unique(edges.edge[hits]) for hits in tree.query_ball_point(own, ON_EDGE)]
        edge, count = np.unique(np.concatenate(beside), return_counts=True)
        for number in edge[(count >= 0.4 * len(own)) & (edge < SILHOUETTE)]:
            points = edges.points[edges.edge == number]
            for n, end in enumerate((space.start[k], space.end[k])):
                seen = np.linalg.norm(points[:, :2] / points[:, 2:] - end[:2] / end[2], axis=1) * focal
                nearest = points[np.argmin(seen)]
                about = points[np.linalg.norm(points - nearest, axis=1) < 4.0]
                if seen.min() > 2 * ON_EDGE or len(about) < 2:
                    continue
                way = np.linalg.svd(about - about.mean(axis=0))[2][0]
                across = np.linalg.svd(way[None])[2][1:]
                off = across @ (end - nearest)
                spread = across @ space.covariance[k, 3 * n : 3 * n + 3, 3 * n : 3 * n + 3] @ across.T
                out[k, n] = np.fmin(out[k, n], off @ np.linalg.solve(spread, off))
    return out


@dataclass(frozen=True)
class RegionSiblings:
    """How the regions of two pictures correspond, by pixels of the left picture that have a depth: shared (left
    regions, right regions); left_size, right_size: of each region that the other picture shows; known (left regions,):
    whether half of it has a depth."""

    shared: Floats
    left_size: Ints
    right_size: Ints
    known: Bools

    def right(self, left: Ints, right: Ints) -> Bools:
        """Whether pairs of regions are one: they share half of the smaller, as arcs do."""
        smaller = np.minimum(self.left_size[left], self.right_size[right])
        return np.asarray((self.shared[left, right] >= 0.5 * smaller) & (smaller > 0), bool)

    @property
    def possible(self) -> Bools:
        """Left regions that have a sibling of their size: one that shares half of the larger."""
        larger = np.maximum(self.left_size[:, None], self.right_size)
        return np.asarray(self.known & ((self.shared >= 0.5 * larger) & (self.shared > 0)).any(axis=1), bool)


_STEP = 3  # every third pixel each way


def find_region_siblings(pair: RenderedPair, left: RegionColumns, right: RegionColumns) -> RegionSiblings:
    """Carry the pixels of the left regions over by their depth."""
    y, x = np.mgrid[0 : pair.depth.shape[0] : _STEP, 0 : pair.depth.shape[1] : _STEP].reshape(2, -1)
    depth = pair.depth[y, x]
    y, x, depth = y[depth > 0], x[depth > 0], depth[depth > 0]
    rays = np.column_stack([x, y, np.ones(len(x))]) @ np.linalg.inv(pair.rig.cameras["left"].matrix).T
    camera = pair.rig.cameras["right"]
    seen, _ = camera.project(apply(inverse(pair.rig.rig_from_camera["right"]), rays * depth[:, None]))
    u, v = np.rint(seen).astype(np.int64).T
    inside = (u >= 0) & (v >= 0) & (u < camera.width) & (v < camera.height)
    a = _label(left, pair.depth.shape)[y, x]
    b = np.full(len(a), -1)
    b[inside] = _label(right, (camera.height, camera.width))[v[inside], u[inside]]
    sizes = [np.bincount(of[of >= 0], minlength=len(side)) for of, side in ((a[inside], left), (b, right))]
    shared = np.zeros((len(left), len(right)))
    both = (a >= 0) & (b >= 0)
    np.add.at(shared, (a[both], b[both]), 1)
    known = np.bincount(a[a >= 0], minlength=len(left)) * _STEP**2 >= 0.5 * left.area
    return RegionSiblings(shared, sizes[0], sizes[1], known)


def _label(regions: RegionColumns, shape: tuple[int, ...]) -> Ints32:
    """Label image of the regions, by their outlines, the larger ones first; -1 for none."""
    image = np.full(shape, -1, np.int32)
    for region in np.argsort(-regions.area).tolist():
        rings = [
            regions.outline[regions.ring_offsets[j] : regions.ring_offsets[j + 1]].astype(np.int32)
            for j in np.flatnonzero(regions.ring_region == region)
        ]
        cv2.drawContours(image, rings, -1, region, cv2.FILLED)
    return image
