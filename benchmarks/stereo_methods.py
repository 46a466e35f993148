"""The methods of stereo against each other and against peers, on rendered metal and on photographs.

    RELMODEL_TEST_DATA=... python -m benchmarks.stereo_methods [--pairs A0 C1 ...]

Rendered pairs (folder bulkhead), no model and no prior: an arc that
runs along visible edges is matched rightly where its partner shows the same edge at the same place in space (see
benchmarks/rendered_pairs.py); `recall` counts every left arc with a partner of its size, level ones too.  Regions,
carried over by their depth, alike.  `held`: how often the 95 % ellipse across the true edge, of the ends of rightly
matched arcs, holds it.  `s` processor seconds a pair, beyond extraction, joins and certificate included.

Peers: LSD segments with their mean gradient-histogram descriptor (OpenCV SIFT at the middle, scale of the segment),
mutual best within the epipolar rows; SGBM of the rectified pictures, sampled at the arcs: `recall` is the share of
samples within 1 px of the true disparity, `precision` the same of those that SGBM answers.

Photographs (folder stereo_scenes): rows at which a matched arc shows a disparity, and their share within 1 px of the
true one, the nearest that is found within 1, or 2, px beside the edge: it is the surface in front that has the edge.
`possible`: rows of the left arcs at which any right arc is within 1 px of the true disparity."""

from __future__ import annotations

import argparse
import os
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from tabulate import tabulate

from benchmarks.rendered_pairs import RenderedPair, find_region_siblings, find_siblings, measure_ends, read_pair
from relmodel.arrays import Bools, Bytes, Floats, Ints
from vision.cameras.cameras import Camera, Rig
from vision.extraction.arcs import LINE
from vision.extraction.extract import extract
from vision.extraction.rows import Primitives, make_primitives
from vision.stereo.epipolar import StereoArcs, cross_rows, pack_arcs, pair_crossings, rectify
from vision.stereo.match import METHODS, StereoMatches, match_stereo
from vision.stereo.stereo_parameters import DEFAULTS

PAIRS = [f"{part}{pair}" for part, count in (("A", 8), ("B", 2), ("C", 4)) for pair in range(count)]
OPENCV: Any = cv2  # whose stubs lack parts of it
HELD = 5.99  # 95 % of chi square with two degrees of freedom


def rendered(folder: Path, names: list[str]) -> str:
    """A table: one row a method, sums over the pairs."""
    counts = {name: Counter[str]() for name in (*METHODS, "LSD with descriptors", "SGBM at arcs")}
    for name in names:
        pair = read_pair(folder / name[0] / "pairs", int(name[1:]))
        left, right = (make_primitives(extract(picture)) for picture in pair.pictures.values())
        arcs = pack_arcs(left), pack_arcs(right)
        siblings = find_siblings(pair, *arcs)
        regions = find_region_siblings(pair, left.regions, right.regions)
        for method in METHODS:
            began = time.process_time()
            found = match_stereo(pair.rig, left, right, parameters=replace(DEFAULTS, method=method))
            counts[method]["ms"] += round(1000 * (time.process_time() - began))
            counts[method].update(_judge(siblings.real, siblings.possible(), found.arc_label, siblings.right))
            of_regions = _judge(regions.known, regions.possible, found.region_label, regions.right)
            counts[method].update({f"regions {what}": count for what, count in of_regions.items()})
            matched = np.flatnonzero(siblings.real & (found.arc_label >= 0))
            good = matched[siblings.right(matched, found.arc_label[matched])]
            chi = measure_ends(pair, arcs[0], found.triangulated, good)
            counts[method].update(ends=int(np.isfinite(chi).sum()), held=int((chi < HELD).sum()))
        counts["LSD with descriptors"].update(_segments(pair))
        counts["SGBM at arcs"].update(_block_matching(pair, arcs[0]))
    header = ("method", "precision", "recall", "regions precision", "regions recall", "held", "s")
    rows = [
        [name, *(c[of] / c[to] if c[to] else None for of, to in _SHARES), c["ms"] / 1000 / len(names)]
        for name, c in counts.items()
    ]
    return tabulate(rows, header, floatfmt=("", ".3f", ".3f", ".3f", ".3f", ".3f", ".2f"))


_SHARES = (
    ("right", "matched"), ("found", "possible"), ("regions right", "regions matched"),
    ("regions found", "regions possible"), ("held", "ends"),
)  # fmt: skip


def _judge(known: Bools, possible: Bools, label: Ints, is_right: Callable[[Ints, Ints], Bools]) -> dict[str, int]:
    """How many units were matched, and rightly; how many have a sibling, and how many of these were matched so."""
    matched = np.flatnonzero(known & (label >= 0))
    right = matched[is_right(matched, label[matched])]
    return {
        "matched": len(matched),
        "right": len(right),
        "possible": int(possible.sum()),
        "found": int(possible[right].sum()),
    }


def _segments(pair: RenderedPair) -> dict[str, int]:
    """LSD segments of both pictures, matched by descriptors: judged as arcs."""
    began = time.process_time()
    found, described = [], []
    for picture in pair.pictures.values():
        lines = cv2.createLineSegmentDetector(0).detect(picture)[0].reshape(-1, 4).astype(float)
        lines = lines[np.hypot(lines[:, 2] - lines[:, 0], lines[:, 3] - lines[:, 1]) >= 10]
        middles, way = (lines[:, :2] + lines[:, 2:]) / 2, lines[:, 2:] - lines[:, :2]
        size = np.clip(np.hypot(*way.T) / 2, 6, 40)
        turn = np.degrees(np.arctan2(way[:, 1], way[:, 0])) % 360
        keys = [cv2.KeyPoint(*key) for key in np.column_stack([middles, size, turn]).tolist()]
        found.append(lines)
        described.append(np.asarray(OPENCV.SIFT_create().compute(picture, keys)[1], np.float64))
    rectification = rectify(pair.rig)
    views = (rectification.first, rectification.second)
    each = zip(views, found, strict=True)
    ends = [rectification.points(v, lines.reshape(-1, 2)).reshape(-1, 2, 2) for v, lines in each]
    rows = [np.sort(end[..., 1], axis=1) for end in ends]
    shared = np.minimum(rows[0][:, None, 1], rows[1][:, 1]) - np.maximum(rows[0][:, None, 0], rows[1][:, 0])
    shorter = np.minimum(rows[0][:, None, 1] - rows[0][:, None, 0], rows[1][:, 1] - rows[1][:, 0])
    moved = ends[0][..., 0].mean(axis=1)[:, None] - ends[1][..., 0].mean(axis=1)
    gap = np.linalg.norm(described[0][:, None] - described[1], axis=2)
    gap[(shared < 0.5 * shorter - 2) | (moved <= 0)] = np.inf
    label = np.argmin(gap, axis=1)
    mutual = np.argmin(gap, axis=0)[label] == np.arange(len(label))
    least = gap[np.arange(len(label)), label]
    label[~mutual | ~np.isfinite(least) | (least > 250)] = -1
    ms = round(1000 * (time.process_time() - began))
    siblings = find_siblings(pair, *(_as_arcs(lines) for lines in found))
    return {"ms": ms, **_judge(siblings.real, siblings.possible(), label, siblings.right)}


def _as_arcs(lines: Floats) -> StereoArcs:
    """Segments (n, 4) as arcs with a point a pixel."""
    counts = np.ceil(np.hypot(lines[:, 2] - lines[:, 0], lines[:, 3] - lines[:, 1])).astype(np.int64) + 1
    points = [np.linspace(line[:2], line[2:], count) for line, count in zip(lines, counts, strict=True)]
    n = len(lines)
    offsets = np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
    return StereoArcs(offsets, np.concatenate(points), np.ones(counts.sum()), np.full(n, LINE), np.ones(n), np.ones(n))


def _block_matching(pair: RenderedPair, arcs: StereoArcs) -> dict[str, int]:
    """SGBM of rectified pictures at the points of the arcs that have a depth."""
    began = time.process_time()
    rectification = rectify(pair.rig)
    camera = rectification.first.camera
    inside = arcs.points.round().astype(int).clip(0, [camera.width - 1, camera.height - 1])
    depth = pair.depth[inside[:, 1], inside[:, 0]]
    place = rectification.points(rectification.first, arcs.points)
    stretch = rectification.first.directions(arcs.points) @ rectification.first.rectified_from_camera[2]
    truth = rectification.focal * rectification.baseline / (np.maximum(depth, 1.0) * stretch)
    low = int(np.percentile(truth[depth > 0], 1)) - 32
    # One frame for both, the right picture moved by the least disparity.
    corner = np.floor(place.min(axis=0)) - 16
    size = np.ceil(place.max(axis=0) - corner).astype(int) + 16
    x, y = np.meshgrid(np.arange(size[0]) + corner[0], np.arange(size[1]) + corner[1])
    flat = []
    for view, moved, picture in zip(
        (rectification.first, rectification.second), (0, low), pair.pictures.values(), strict=True
    ):
        rays = np.column_stack([x.ravel() - moved, y.ravel(), np.full(x.size, rectification.focal)])
        seen, _ = view.camera.project(rays @ view.rectified_from_camera)
        maps = seen.astype(np.float32).reshape(*x.shape, 2)
        flat.append(np.asarray(cv2.remap(picture, maps[..., 0], maps[..., 1], cv2.INTER_LINEAR), np.uint8))
    disparity = _sgbm(flat[0], flat[1])
    u, v = (place - corner).round().astype(int).T
    known = depth > 0
    got = disparity[v[known].clip(0, size[1] - 1), u[known].clip(0, size[0] - 1)]
    told = got >= 0
    good = told & (np.abs(got + low - truth[known]) <= 1)
    return {
        "matched": int(told.sum()), "right": int(good.sum()), "found": int(good.sum()), "possible": int(known.sum()),
        "ms": round(1000 * (time.process_time() - began)),
    }  # fmt: skip


def _sgbm(left: Bytes, right: Bytes) -> Floats:
    """Disparities from 0 to 255 px, negative where there is none."""
    matcher = OPENCV.StereoSGBM_create(
        0, 256, 5, 8 * 25, 32 * 25, 1, 0, 10, 100, 2, OPENCV.STEREO_SGBM_MODE_SGBM_3WAY
    )  # fmt: skip
    return np.asarray(matcher.compute(left, right), float) / 16


def photographs(folder: Path) -> str:
    """Rectified pairs without calibration: a focal length is made up, which changes no disparity."""
    rows = []
    for name in ("cones", "teddy"):
        pictures = [
            np.asarray(cv2.imread(str(folder / name / f"im{n}.png"), cv2.IMREAD_GRAYSCALE), np.uint8) for n in (2, 6)
        ]
        truth = np.asarray(cv2.imread(str(folder / name / "disp2.pgm"), cv2.IMREAD_UNCHANGED), float) / 4
        height, width = pictures[0].shape
        camera = Camera(width, height, np.array([[500.0, 0, (width - 1) / 2], [0, 500.0, (height - 1) / 2], [0, 0, 1]]))
        apart = np.eye(4)
        apart[0, 3] = 100.0
        rig = Rig({"left": camera, "right": camera}, {"left": np.eye(4), "right": apart})
        left, right = (make_primitives(extract(picture)) for picture in pictures)
        for method in METHODS:
            began = time.process_time()
            found = match_stereo(rig, left, right, parameters=replace(DEFAULTS, method=method))
            seconds = time.process_time() - began
            rows.append([name, method, *_samples(found, left, right, truth), seconds])
    header = ("scene", "method", "possible", "samples", "1 px beside", "2 px beside", "s")
    return tabulate(rows, header, floatfmt=("", "", "", "", ".3f", ".3f", ".2f"))


def _samples(found: StereoMatches, left: Primitives, right: Primitives, truth: Floats) -> tuple[int, int, float, float]:
    """Rows that could show a disparity within 1 px of the true one; those that do show one, where the truth is known;
    their share within 1 px of the true one, 1 px and 2 px beside."""
    space, rectification, p = found.triangulated, found.rectification, found.parameters.epipolar
    arcs = [pack_arcs(picture) for picture in (left, right)]
    a, b = (
        cross_rows(rectification, view, own, p.tangent_reach, p.least_rise)
        for view, own in zip((rectification.first, rectification.second), arcs, strict=True)
    )

    def off(at: Ints, disparity: Floats, beside: int) -> Floats:
        x, y = arcs[0].points[a.position[at].astype(np.int64)].round().astype(int).T
        best = np.full(len(at), np.inf)
        for dx in range(-beside, beside + 1):
            true = truth[y.clip(0, truth.shape[0] - 1), (x + dx).clip(0, truth.shape[1] - 1)]
            best = np.where(true > 0, np.minimum(best, np.abs(disparity - true)), best)
        return best

    _, i, j = pair_crossings(a, b, (space.first, space.second), p)
    narrow, wide = (off(i, a.x[i] - b.x[j], beside) for beside in (1, 2))
    known = np.isfinite(narrow)
    k, m = np.nonzero(a.row[:, None] == b.row)
    near = np.abs(a.angle[k] - b.angle[m]) < 2 * p.angle_sigma
    k, m = k[near], m[near]
    possible = len(np.unique(k[off(k, a.x[k] - b.x[m], 1) <= 1]))
    return possible, int(known.sum()), float(np.mean(narrow[known] <= 1)), float(np.mean(wide[known] <= 1))


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--pairs", nargs="*", default=PAIRS, choices=PAIRS)
    args = parser.parse_args()
    data = Path(os.environ["RELMODEL_TEST_DATA"])
    print(rendered(data / "bulkhead", args.pairs), end="\n\n")
    print(photographs(data / "stereo_scenes"))


if __name__ == "__main__":
    main()
