"""The matcher on rendered brushed metal, against the exact places of visible edges in both pictures."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import pytest
from scipy.spatial import cKDTree

from relmodel.arrays import Bytes, Floats
from relmodel.geometry.transforms import apply, inverse
from vision.cameras.cameras import Camera, Rig
from vision.extraction.extract import extract
from vision.extraction.rows import make_primitives
from vision.stereo.epipolar import DepthRange, StereoArcs
from vision.stereo.match import StereoMatches, match_stereo, pack_arcs


@dataclass(frozen=True)
class Score:
    precision: float
    recall: float


def read_pair(folder: Path, pair: int) -> tuple[Rig, list[Bytes], Floats, Floats, Floats]:
    """Rig (its frame is the left camera's), pictures, pixels and depths of visible left edges, left depth map."""
    stem = f"pair_{pair:02d}"
    truth = json.loads((folder / f"{stem}_truth.json").read_text())
    names = ("left", "right")
    cameras = {n: Camera(1280, 960, np.array(truth["cameras"][n]["K"])) for n in names}
    rig = Rig(cameras, {"left": np.eye(4), "right": np.array(truth["T_left_right"])})
    pictures = [np.asarray(cv2.imread(str(folder / f"{stem}_{n}.png"), cv2.IMREAD_GRAYSCALE), np.uint8) for n in names]
    edges = np.load(folder / f"{stem}_left_edges.npz")
    depth = np.asarray(cv2.imread(str(folder / f"{stem}_left_depth.png"), cv2.IMREAD_UNCHANGED), float) / 10
    return rig, pictures, edges["uv"].astype(float), edges["z"].astype(float), depth


def depth_maps(depth: Floats, slack: float, cell: int = 16) -> DepthRange:
    """What a prior off by `slack` mm would predict: least and greatest depth about each cell."""
    from scipy.ndimage import maximum_filter, minimum_filter

    cells = depth.reshape(depth.shape[0] // cell, cell, depth.shape[1] // cell, cell)
    seen = depth[depth > 0]
    near = minimum_filter(np.where(cells > 0, cells, np.inf).min(axis=(1, 3)), 3)
    far = maximum_filter(cells.max(axis=(1, 3)), 3)
    near, far = np.where(far > 0, near, seen.min()), np.where(far > 0, far, seen.max())
    return DepthRange(near - slack, far + slack)


def score(rig: Rig, left: StereoArcs, right: StereoArcs, found: StereoMatches, uv: Floats, z: Floats) -> Score:
    """Of arcs along visible edges, not along rows: how many matches are right, and of those that have a partner of
    their size, how many found it.

    A pair is right where the right arc passes within 3 px of the place to which the left arc's edge points project, at
    half of the points of the shorter arc.
    """
    rays = np.column_stack([uv, np.ones(len(uv))]) @ np.linalg.inv(rig.cameras["left"].matrix).T
    there, _ = rig.cameras["right"].project(apply(inverse(rig.rig_from_camera["right"]), rays * z[:, None]))
    distance, index = cKDTree(uv).query(left.points, distance_upper_bound=2.0)
    nearest = np.asarray(index)
    own = np.repeat(np.arange(len(left)), np.diff(left.offsets))
    arc_of = np.repeat(np.arange(len(right)), np.diff(right.offsets))
    on_edge = np.isfinite(distance)
    close = cKDTree(right.points).query_ball_point(there[nearest[on_edge]], 3.0)
    agreed = np.zeros((len(left), len(right)), np.int64)
    for arc, hits in zip(own[on_edge].tolist(), close, strict=True):
        agreed[arc, np.unique(arc_of[hits])] += 1
    size, other = np.bincount(own, minlength=len(left)), np.bincount(arc_of, minlength=len(right))
    real = np.bincount(own[on_edge], minlength=len(left)) >= 0.6 * size
    label = found.assignment.label
    matched = np.flatnonzero(real & (label >= 0))
    good = matched[agreed[matched, label[matched]] >= 0.5 * np.minimum(size[matched], other[label[matched]])]
    possible = real & found.left_votable & np.any(agreed >= 0.5 * np.maximum(size[:, None], other), axis=1)
    return Score(len(good) / len(matched), float(np.isin(np.flatnonzero(possible), good).mean()))


@pytest.mark.data
@pytest.mark.parametrize(("part", "pair"), [("A", 0), ("A", 5), ("C", 3)])
def test_arcs_on_metal_find_their_partners(data_dir: Path, part: str, pair: int) -> None:
    rig, pictures, uv, z, depth = read_pair(data_dir / "bulkhead" / part / "pairs", pair)
    left, right = (make_primitives(extract(picture)) for picture in pictures)
    found = match_stereo(rig, left, right, depth_maps(depth, 60.0))
    got = score(rig, pack_arcs(left), pack_arcs(right), found, uv, z)
    print(f"{part}{pair}: precision {got.precision:.3f}, recall {got.recall:.3f}")
    assert found.assignment.cost == pytest.approx(found.assignment.bound, abs=1e-9)
    assert got.precision > 0.75
    assert got.recall > 0.75
