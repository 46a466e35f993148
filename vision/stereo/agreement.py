"""Whether two pictures agree with what a rig's file says of their cameras, by the points that both show."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import log, pi, sqrt

import numpy as np

from relmodel.arrays import Bytes, Floats
from relmodel.geometry.transforms import inverse, skew
from vision.cameras.cameras import Camera, Rig, perturb

RATIO = 0.8  # of the distance to a point's second nearest descriptor, within which the nearest is its own (Lowe, 2004)
# Of points that are taken for one a quarter are: those lie about their epipolar lines, the others anywhere near.
TRUE_SHARE, LINE_SIGMA_PX, ANYWHERE_PX = 0.25, 0.7, 100.0
NEAR_PX = 2.0  # from its epipolar line, within which a point is counted when that is told
LEAST_POINTS = 30
LARGE = 20.0  # times as large as what pictures show, or as small, as an object is not: a close look shows a tenth
SURE = 12.0  # log odds by which points have to speak for another rig: of 14 good pairs none has more than 2
FOCAL_SHARES = np.setdiff1d(np.round(np.arange(0.9, 1.1001, 0.005), 3), [1.0])  # by which focal lengths are tried
TURNS = np.setdiff1d(np.arange(-20, 21), [0]) * 1e-3  # rad by which the second camera is tried to be turned about x


@dataclass(frozen=True)
class SharedPoints:
    """Points that two pictures show, (n, 2) px each, freed of distortion."""

    one: Floats
    other: Floats


@dataclass(frozen=True)
class Agreement:
    """How well two pictures agree with a rig: log odds of its points lying along their epipolar lines in front of both
    cameras, against anywhere; how many points there are, and the share within NEAR_PX; median distance of those from
    the first camera (mm), NaN where there is none."""

    log_odds: float
    points: int
    near: float
    distance_mm: float


def find_shared_points(greys: Mapping[str, Bytes | Floats], rig: Rig) -> SharedPoints:
    """The points that the two pictures of a rig's two cameras show, by SIFT's descriptors, nearest both ways; greys
    (rows, columns), 0 to 255, by camera."""
    import cv2

    sift, found = cv2.SIFT_create(contrastThreshold=0.01), []  # type: ignore[attr-defined]
    for name, camera in rig.cameras.items():
        points, described = sift.detectAndCompute(np.clip(greys[name], 0, 255).astype(np.uint8), None)
        pixels = np.array([point.pt for point in points], float).reshape(-1, 2)
        found.append((camera.undistort(pixels), described))
    (one, first), (other, second) = found
    if min(len(one), len(other)) < 2:
        return SharedPoints(np.zeros((0, 2)), np.zeros((0, 2)))
    matcher = cv2.BFMatcher(cv2.NORM_L2)
    back = np.array([it.trainIdx for it in matcher.match(second, first)])
    two = matcher.knnMatch(first, second, k=2)
    pairs = np.array([(a.queryIdx, a.trainIdx, a.distance, b.distance) for a, b in two])
    rows, columns = pairs[:, :2].astype(int).T
    kept = (pairs[:, 2] < RATIO * pairs[:, 3]) & (back[columns] == rows)
    return SharedPoints(one[rows[kept]], other[columns[kept]])


def measure_agreement(rig: Rig, points: SharedPoints) -> Agreement:
    """How well shared points lie along epipolar lines of two cameras (Sampson, Hartley and Zisserman 11.4)."""
    cameras, poses = list(rig.cameras.values()), list(rig.rig_from_camera.values())
    other_from_one = inverse(poses[1]) @ poses[0]
    turn, base = other_from_one[:3, :3], other_from_one[:3, 3]
    rays = [
        np.concatenate([camera.normalise(pixels), np.ones((len(pixels), 1))], axis=1)
        for camera, pixels in zip(cameras, (points.one, points.other), strict=True)
    ]
    essential = skew(base) @ turn
    slopes = rays[1] @ essential / cameras[0].matrix[0, 0], rays[0] @ essential.T / cameras[1].matrix[0, 0]
    scale = np.sqrt(sum((slope[:, :2] ** 2).sum(axis=1) for slope in slopes))
    off = np.abs(np.einsum("ni,ij,nj->n", rays[1], essential, rays[0])) / np.maximum(scale, 1e-300)
    # Depths z: z_one turn ray_one + base = z_other ray_other, by least squares.
    ways = np.stack([rays[0] @ turn.T, -rays[1]], axis=2)
    depths = np.linalg.pinv(ways) @ -base
    off = np.where((depths > 0).all(axis=1), off, np.inf)
    anywhere = (1 - TRUE_SHARE) / ANYWHERE_PX
    along = TRUE_SHARE * np.exp(-0.5 * (off / LINE_SIGMA_PX) ** 2) / (LINE_SIGMA_PX * sqrt(2 * pi))
    near = off < NEAR_PX
    distance = float(np.median(depths[near, 0])) if near.any() else float("nan")
    share = float(near.mean()) if len(near) else 0.0
    return Agreement(float(np.log(anywhere + along).sum() - len(off) * log(anywhere)), len(off), share, distance)


def doubt_rig(rig: Rig, points: SharedPoints) -> str | None:
    """How the pictures of two cameras say that the rig is, where that is surely not as its file says: a sentence."""
    stated = measure_agreement(rig, points)
    if stated.points < LEAST_POINTS:
        return None
    one, other = rig.cameras
    exchanged = rig, SharedPoints(points.other, points.one)
    inverted = replace(rig, rig_from_camera={name: inverse(pose) for name, pose in rig.rig_from_camera.items()}), points
    tried = {
        f"if {one} and {other} are each other's: exchange their pictures, or their names in the file": exchanged,
        "if its poses are camera_from_rig: invert them": inverted,
    }
    for share in FOCAL_SHARES.tolist():
        words = f"with a focal length of {other} {abs(share - 1):.1%} {'greater' if share > 1 else 'less'}"
        one_scaled = replace(rig, cameras=rig.cameras | {other: scale_focal(rig.cameras[other], share)})
        tried[f"{words}: is its picture scaled or cropped?"] = one_scaled, points
        words = f"with focal lengths {abs(share - 1):.1%} {'greater' if share > 1 else 'less'}"
        both = replace(rig, cameras={name: scale_focal(it, share) for name, it in rig.cameras.items()})
        tried[f"{words}: are the pictures scaled or cropped?"] = (both, points)
    for turn in TURNS.tolist():
        pose = perturb(rig.rig_from_camera[other], np.array([0, 0, 0, turn, 0, 0]))
        turned = replace(rig, rig_from_camera=rig.rig_from_camera | {other: pose})
        words = f"with {other} turned by {np.degrees(turn):.2f} degrees about its x axis: was it moved?"
        tried[words] = turned, points
    found = {words: measure_agreement(*of) for words, of in tried.items()}
    words, best = max(found.items(), key=lambda it: it[1].log_odds)
    if best.log_odds - stated.log_odds < SURE:
        return None
    return (
        f"of {stated.points} points that both pictures show {stated.near:.0%} lie within {NEAR_PX:g} px of where the "
        f"rig's file has them, and {best.near:.0%} would {words}"
    )


def doubt_unit(rig: Rig, points: SharedPoints, size_mm: float) -> str | None:
    """How shared points say that lengths of a rig's file are of another unit, where both pictures show next to nothing
    of what is `size_mm` large, or are far from it: a sentence."""
    found = measure_agreement(rig, points)
    wide = found.distance_mm * max(camera.width / float(camera.matrix[0, 0]) for camera in rig.cameras.values())
    if found.points < LEAST_POINTS or found.log_odds < SURE or 1 / LARGE < size_mm / wide < LARGE:
        return None
    return (
        f"by the rig's file the pictures show {wide:.3g} mm of something {found.distance_mm:.3g} mm off, where the "
        f"object is {size_mm:.0f} mm large: is the file in another unit, as cm or inches?"
    )


def scale_focal(camera: Camera, share: float) -> Camera:
    """The camera with its focal length that many times as long."""
    return replace(camera, matrix=camera.matrix * np.array([[share, share, 1], [1, share, 1], [1, 1, 1]]))
