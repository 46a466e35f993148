"""Step 1 of Pong's matcher: arcs of two pictures cross the rows of the rectified pair; rows vote for pairs of arcs."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from relmodel.arrays import Bools, Floats, Ints, Rows, count_from
from relmodel.errors import InputError
from relmodel.geometry.transforms import rigid
from vision.cameras.cameras import Camera, Rig
from vision.extraction.rows import Primitives
from vision.stereo.stereo_parameters import EpipolarParameters, RangeParameters

# Both cameras are rotated virtually to look the same way, square to the baseline, with one focal length (Fusiello,
# Trucco and Verri, Machine Vision and Applications 12, 2000). Only points are mapped, never pictures, so nothing is
# resampled, and lens distortion and toe-in cost no accuracy.

LATTICE = 32  # points across and down each view by which pairs of cameras are compared
FARTHEST = 10.0  # how far off, in the greatest distance of two cameras, they are where the axes do not meet nearer


@dataclass(frozen=True)
class RectifiedCamera:
    """One camera of the pair: `rectified_from_camera` (3, 3) turns its directions into the rectified frame."""

    camera: Camera
    rectified_from_camera: Floats

    def directions(self, pixels: Floats) -> Floats:
        """Rays (n, 3), camera frame, z = 1, of pixels (n, 2)."""
        plain = self.camera.undistort(np.asarray(pixels, float).reshape(-1, 2))
        homogeneous = np.concatenate([plain, np.ones((len(plain), 1))], axis=1)
        return np.asarray(homogeneous @ np.linalg.inv(self.camera.matrix).T)


@dataclass(frozen=True)
class Rectification:
    """The rectified pair of two `cameras` of a rig, the first and the second.

    Frame: origin at the first camera's centre, x along the baseline to the second camera, z forward, mm.  A point
    (X, Y, Z) there has the first coordinates (f X/Z, f Y/Z) and the second ones (f (X - b)/Z, f Y/Z): the same row, and
    disparity x_first - x_second = f b/Z.  `focal` f in px, `baseline` b in mm, `rig_from_rectified` (4, 4)."""

    cameras: tuple[str, str]
    first: RectifiedCamera
    second: RectifiedCamera
    focal: float
    baseline: float
    rig_from_rectified: Floats

    def points(self, view: RectifiedCamera, pixels: Floats) -> Floats:
        """Rectified coordinates (n, 2), px, of pixels (n, 2) of one of the two pictures."""
        rays = view.directions(pixels) @ view.rectified_from_camera.T
        return np.asarray(self.focal * rays[:, :2] / rays[:, 2:])

    def triangulate(self, points: Floats, disparity: Floats) -> Floats:
        """Points (n, 3) in the rig's frame, mm, of rectified points (n, 2) of the first picture and disparities."""
        z = self.focal * self.baseline / disparity
        rectified = np.stack([points[:, 0] * z / self.focal, points[:, 1] * z / self.focal, z], axis=1)
        return np.asarray(rectified @ self.rig_from_rectified[:3, :3].T + self.rig_from_rectified[:3, 3])

    def jacobian(self, points: Floats, disparity: Floats) -> Floats:
        """Derivative (n, 3, 3) of what `triangulate` gives by x, y and disparity."""
        x, y = points.T
        unit = self.baseline / disparity
        nothing = np.zeros_like(unit)
        deep = -unit / disparity
        rows = [[unit, nothing, deep * x], [nothing, unit, deep * y], [nothing, nothing, deep * self.focal]]
        return np.asarray(self.rig_from_rectified[:3, :3] @ np.array(rows).transpose(2, 0, 1))


def choose_pair(rig: Rig) -> tuple[str, str] | None:
    """The two cameras whose views overlap most, of those that overlap alike the first in the rig's order; None where no
    two overlap that can be rectified.

    Half of a lattice of points lies in the view of each camera, as far off as the axes of all cameras come nearest to
    each other; the overlap is the share of the points that both see.

    Raises InputError where all cameras are at one place and look the same way, as of a rig that lacks their poses."""
    names, poses = list(rig.cameras), np.array(list(rig.rig_from_camera.values()))
    if rig.moved is None and len(names) > 1 and np.allclose(poses, poses[0], rtol=0, atol=1e-6):
        rectify(rig.only(*names[:2]))  # which says what is wrong
    centre, axis = poses[:, :3, 3], poses[:, :3, 2]
    points = {name: view_lattice(rig, name, _distance_of_axes(centre, axis)) for name in names}
    # Pictures from two standpoints are no pair: where these are to each other is not known exactly.
    pairs = [(a, b) for a, b in combinations(names, 2) if rig.standpoint_of(a) == rig.standpoint_of(b)]
    overlap = {(a, b): float(sees(rig, a, points[b]).mean() + sees(rig, b, points[a]).mean()) for a, b in pairs}
    for pair in sorted((pair for pair in overlap if overlap[pair] > 0), key=lambda pair: -overlap[pair]):
        with suppress(InputError):
            rectify(rig.only(*pair))
            return pair
    return None


def _distance_of_axes(centre: Floats, axis: Floats) -> float:
    """How far (mm) cameras at `centre` (n, 3), looking along `axis` (n, 3), stand in the mean from the point nearest to
    all axes; FARTHEST where that is no nearer, or behind one."""
    farthest = FARTHEST * float(np.linalg.norm(centre[:, None] - centre, axis=2).max())
    across = np.eye(3) - axis[:, :, None] * axis[:, None, :]
    point = np.linalg.lstsq(across.sum(axis=0), np.einsum("nij,nj->i", across, centre), rcond=1e-9)[0]
    depth = ((point - centre) * axis).sum(axis=1)
    return min(float(depth.mean()), farthest) if (depth > 0).all() else farthest


def view_lattice(rig: Rig, name: str, distance: float) -> Floats:
    """Points (n, 3), rig's frame, that a camera sees at a depth, mm."""
    camera, pose = rig.cameras[name], rig.rig_from_camera[name]
    step = (np.arange(LATTICE) + 0.5) / LATTICE
    u, v = np.meshgrid(camera.width * step - 0.5, camera.height * step - 0.5)
    rays = RectifiedCamera(camera, np.eye(3)).directions(np.column_stack([u.ravel(), v.ravel()]))
    return np.asarray(distance * rays @ pose[:3, :3].T + pose[:3, 3])


def sees(rig: Rig, name: str, points: Floats) -> Bools:
    """Which points (n, 3), rig's frame, a camera sees."""
    camera, pose = rig.cameras[name], rig.rig_from_camera[name]
    pixels, front = camera.project((points - pose[:3, 3]) @ pose[:3, :3])
    return np.asarray(front & ((pixels > -0.5) & (pixels < [camera.width - 0.5, camera.height - 0.5])).all(axis=1))


def rectify(rig: Rig) -> Rectification:
    """The rectified pair of a rig of two cameras; InputError where they do not see the same side of the baseline."""
    first, second = rig.cameras
    rig_from_first, rig_from_second = rig.rig_from_camera[first], rig.rig_from_camera[second]
    base = rig_from_second[:3, 3] - rig_from_first[:3, 3]
    baseline = float(np.linalg.norm(base))
    if baseline < 1e-6:
        raise InputError(f"the cameras '{first}' and '{second}' are at one place: correct rig_from_camera in the rig")
    forward = rig_from_first[:3, 2] + rig_from_second[:3, 2]
    x = base / baseline
    z = forward - (forward @ x) * x
    z /= max(float(np.linalg.norm(z)), 1e-9)
    rig_from_rectified = rigid(np.stack([x, np.cross(z, x), z], axis=1), rig_from_first[:3, 3])
    rectified_from_rig = rig_from_rectified[:3, :3].T
    views = [
        RectifiedCamera(rig.cameras[n], rectified_from_rig @ rig.rig_from_camera[n][:3, :3]) for n in (first, second)
    ]
    if min(_compute_least_forward(view) for view in views) < _LEAST_FORWARD:
        raise InputError(
            f"the cameras '{first}' and '{second}' look along their baseline or away from each other: "
            "correct rig_from_camera in the rig, or inspect with one camera"
        )
    return Rectification(
        cameras=(first, second),
        first=views[0],
        second=views[1],
        focal=float(np.mean([view.camera.matrix[i, i] for view in views for i in (0, 1)])),
        baseline=baseline,
        rig_from_rectified=rig_from_rectified,
    )


_LEAST_FORWARD = 0.1  # of a ray in the rectified frame: beyond it coordinates run away


def _compute_least_forward(view: RectifiedCamera) -> float:
    """Least z, in the rectified frame, of the unit rays through the corners and the middle of a picture."""
    w, h = view.camera.width - 1.0, view.camera.height - 1.0
    rays = view.directions(np.array([[0, 0], [w, 0], [0, h], [w, h], [w / 2, h / 2]]))
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    return float((rays @ view.rectified_from_camera[2]).min())


# Arcs of a picture in the rows of the rectified pair: where they cross which row, and how.


@dataclass(frozen=True)
class StereoArcs:
    """The arcs of one picture as stereo takes them: packed polylines, and columns of one row an arc.

    Arc i runs through the points offsets[i] .. offsets[i + 1] of `points` (m, 2), px.  `contrast` (m,): height of the
    step there, grey levels, positive where the bright side lies left of the walk.  Of each arc (n,): `kind`, an index
    of `vision.extraction.arcs.KINDS`; `sigma`, lateral standard deviation of the arc as a whole, px; `width`, of the
    blurred step, px."""

    offsets: Ints
    points: Floats
    contrast: Floats
    kind: Ints
    sigma: Floats
    width: Floats

    def __len__(self) -> int:
        return len(self.offsets) - 1


def pack_arcs(picture: Primitives) -> StereoArcs:
    """The arcs of a picture as stereo takes them."""
    arcs, courses = picture.arcs, picture.courses
    return StereoArcs(
        offsets=courses.offsets.astype(np.int64),
        points=courses.points,
        contrast=np.where(courses.bright_left, 1.0, -1.0) * np.repeat(arcs.contrast, np.diff(courses.offsets)),
        kind=arcs.kind.astype(np.int64),
        sigma=arcs.sigma,
        width=arcs.width,
    )


@dataclass(frozen=True)
class Crossings(Rows):
    """Where arcs cross whole rows of the rectified pair, ordered by row and x, columns of one length.

    x px; `angle` rad from the vertical (dx/dy = tan); `contrast` grey levels, positive where the right-hand side
    (greater x) is bright; `sigma` px along the row, of the arc as a whole; `position`: index of the arc's point before
    the crossing, plus the share of the way to the next."""

    arc: Ints
    row: Ints
    x: Floats
    angle: Floats
    contrast: Floats
    sigma: Floats
    position: Floats


@dataclass(frozen=True)
class RowArcs:
    """The arcs of one picture of a pair in its rectified rows.

    points (m, 2): those of the arcs, rectified px; box (arcs, 4): least and greatest x and y of each, as x0, y0, x1,
    y1; crossings: on rows that arcs of both pictures reach; extent (arcs,): how many of them each arc has."""

    arcs: StereoArcs
    points: Floats
    box: Floats
    crossings: Crossings
    extent: Ints

    @property
    def middle(self) -> Floats:
        """(arcs, 2): the middles of the boxes."""
        return np.asarray(0.5 * (self.box[:, :2] + self.box[:, 2:]))


def lay_out(
    rectification: Rectification, first: StereoArcs, second: StereoArcs, p: EpipolarParameters
) -> tuple[RowArcs, RowArcs]:
    """Both sides of a pair."""
    both = ((rectification.first, first), (rectification.second, second))
    crossed = [cross_rows(rectification, view, arcs, p.tangent_reach, p.least_rise) for view, arcs in both]
    some = all(len(c) for c in crossed)
    top, bottom = (max(c.row[0] for c in crossed), min(c.row[-1] for c in crossed)) if some else (0, -1)
    sides = []
    for (view, arcs), crossings in zip(both, crossed, strict=True):
        points = rectification.points(view, arcs.points)
        kept = crossings.take((crossings.row >= top) & (crossings.row <= bottom))
        low, high = (
            np.asarray(f.reduceat(points, arcs.offsets[:-1])) if len(arcs) else points for f in (np.minimum, np.maximum)
        )
        extent = np.bincount(kept.arc, minlength=len(arcs)).astype(np.int64)
        sides.append(RowArcs(arcs, points, np.hstack([low, high]), kept, extent))
    return sides[0], sides[1]


def cross_rows(
    rectification: Rectification, view: RectifiedCamera, arcs: StereoArcs, reach: int, least_rise: float
) -> Crossings:
    """Crossings of the arcs of one picture with the rows; see `row_crossings`."""
    points = rectification.points(view, arcs.points)
    arc, row, at = row_crossings(arcs.offsets, points[:, 0], points[:, 1], reach, least_rise)
    order = np.lexsort((at[:, 0], row))
    arc, row, at = arc[order], row[order], at[order]
    x, slope, rise, position = at.T
    # Walking down the picture (rise > 0) the left-hand side is that of greater x.
    return Crossings(
        arc=arc,
        row=row,
        x=np.ascontiguousarray(x),
        angle=np.arctan(slope),
        contrast=arcs.contrast[position.astype(np.int64)] * np.sign(rise),
        sigma=arcs.sigma[arc] / np.abs(rise),
        position=np.ascontiguousarray(position),
    )


def row_crossings(offsets: Ints, x: Floats, y: Floats, reach: int, least_rise: float) -> tuple[Ints, Ints, Floats]:
    """Where polylines cross the whole rows: (arc, row, [x, slope, rise, position]) of each crossing.

    The tangent is the chord over `reach` points to both sides, within the arc; `slope` is its dx/dy, `rise` its
    dy/length (negative where the arc runs up); crossings with |rise| below `least_rise` are left out.  `position` is
    the index of the point before the crossing plus the share of the way to the next."""
    arc = np.repeat(np.arange(len(offsets) - 1), np.diff(offsets))
    p = np.flatnonzero(arc[1:] == arc[:-1])
    a, b = np.maximum(offsets[arc[p]], p - reach), np.minimum(offsets[arc[p] + 1] - 1, p + 1 + reach)
    dx, dy = x[b] - x[a], y[b] - y[a]
    length = np.hypot(dx, dy)
    # Rows in [lower, higher): a row through a point counts once, and not at all at a turning point.
    first = np.ceil(np.minimum(y[p], y[p + 1])).astype(np.int64)
    count = np.ceil(np.maximum(y[p], y[p + 1])).astype(np.int64) - first
    count[(length == 0.0) | (np.abs(dy) < least_rise * length)] = 0
    which, row = count_from(first, count)
    p = p[which]
    t = (row - y[p]) / (y[p + 1] - y[p])
    dx, dy, length = dx[which], dy[which], length[which]
    return arc[p], row, np.column_stack([x[p] + t * (x[p + 1] - x[p]), dx / dy, dy / length, p + t])


def compress_contrast(contrast: Floats, scale: float) -> Floats:
    """Contrast on a scale on which its logarithm counts and its sign stays; steps below `scale` grey count little."""
    return np.asarray(np.arcsinh(contrast / scale))


def pair_crossings(
    first: Crossings, second: Crossings, pairs: tuple[Ints, Ints], p: EpipolarParameters
) -> tuple[Ints, Ints, Ints]:
    """Which crossings of two arcs are one: (pair, crossing of the first, of the second), ordered by the first two.

    pairs: arcs (k,) of the first and of the second picture.  Where arcs cross a row more than once, those that are most
    alike, each the best of the other, by angle and contrast."""
    row = np.concatenate([first.row, second.row])
    least = row.min(initial=0)
    rows = row.max(initial=0) - least + 1
    pair, i = _of_arcs(first.arc, pairs[0])
    other, j = _of_arcs(second.arc, pairs[1])
    key, other_key = pair * rows + first.row[i] - least, other * rows + second.row[j] - least
    order = np.argsort(other_key, kind="stable")
    j, other_key = j[order], other_key[order]
    first_at = np.searchsorted(other_key, key)
    a, at = count_from(first_at, np.searchsorted(other_key, key, side="right") - first_at)
    pair, i, j = pair[a], i[a], j[at]
    unlike = ((first.angle[i] - second.angle[j]) / p.angle_sigma) ** 2
    steps = [compress_contrast(c, p.contrast_scale) for c in (first.contrast[i], second.contrast[j])]
    unlike += ((steps[0] - steps[1]) / p.contrast_sigma) ** 2
    best = _is_least(pair * len(first) + i, unlike) & _is_least(pair * len(second) + j, unlike)
    pair, i, j = pair[best], i[best], j[best]
    order = np.lexsort((i, pair))
    return pair[order], i[order], j[order]


def _of_arcs(arc: Ints, wanted: Ints) -> tuple[Ints, Ints]:
    """Crossings of each of the wanted arcs (k,): (which of the wanted, crossing)."""
    order = np.argsort(arc, kind="stable")
    first = np.searchsorted(arc[order], wanted)
    k, at = count_from(first, np.searchsorted(arc[order], wanted, side="right") - first)
    return k, order[at]


def _is_least(key: Ints, value: Floats) -> Bools:
    """Whether each value is the least of its key, one of each."""
    order = np.lexsort((value, key))
    least = np.zeros(len(key), bool)
    least[order[np.flatnonzero(np.diff(key[order], prepend=-1))]] = True
    return least


# The range of disparities to search at each place, from the pair itself.
#
# Every depth from the camera to infinity is open at first. The pairs of arcs that most rows agree on then narrow the
# range around them.


@dataclass(frozen=True)
class DisparityRange:
    """Least and greatest disparity, px: at each crossing (n, 2) and of each arc (arcs, 2) of the first picture."""

    of_crossings: Floats
    of_arcs: Floats


def estimate_range(
    rectification: Rectification, first: RowArcs, second: RowArcs, p: RangeParameters, epipolar: EpipolarParameters
) -> DisparityRange:
    """The range from the pair itself: at each place the disparities of the nearest trusted pairs of arcs, widened.

    A repeated pattern matches itself at several shifts: that is taken on which most pairs of arcs agree."""
    at = np.column_stack([first.crossings.x, first.crossings.row])
    most = rectification.focal / p.nearest_baselines

    def look(bounds: Floats) -> tuple[Floats, Floats]:
        """Places and disparities of the trusted pairs."""
        votes = vote(first, second, bounds, epipolar)
        sure = _trusted(votes, first, second, p)
        return first.middle[votes.first[sure]], votes.disparity[sure]

    def all_over(low: float, high: float) -> list[Floats]:
        return [np.tile([low, high], (len(places), 1)) for places in (at, first.middle)]

    found = DisparityRange(*all_over(0.0, most))
    ways = _clusters(look(found.of_crossings)[1], p)
    if not ways:
        return found
    pairs = [len(look(all_over(way / p.cluster_ratio, way * p.cluster_ratio)[0])[0]) for way in ways]
    way = ways[int(np.argmax(pairs))]
    least, most = way / p.widest_ratio, min(way * p.widest_ratio, most)
    found = DisparityRange(*all_over(least, most))
    for _ in range(p.rounds):
        place, disparity = look(found.of_crossings)
        if len(place) < p.neighbours:
            return found
        found = DisparityRange(*(np.clip(_around(x, place, disparity, p), least, most) for x in (at, first.middle)))
    return found


def _clusters(disparity: Floats, p: RangeParameters) -> list[float]:
    """Middles of the densest clusters of disparities, the densest first, none in another's reach."""
    log = np.sort(np.log(np.maximum(disparity, 1e-3)))
    reach = np.log(p.cluster_ratio)
    found: list[float] = []
    while len(log) and len(found) < p.ways:
        first = int(np.argmax(np.searchsorted(log, log + reach, side="right") - np.arange(len(log))))
        middle = float(log[first] + 0.5 * reach)
        found.append(float(np.exp(middle)))
        log = log[np.abs(log - middle) > reach]
    return found


def _trusted(votes: Votes, first: RowArcs, second: RowArcs, p: RangeParameters) -> Bools:
    """Pairs of arcs that most of the longer one's rows vote for, more than for any other pair of either."""
    longer = np.maximum(first.extent[votes.first], second.extent[votes.second])
    best = [np.zeros(len(side.arcs), np.int64) for side in (first, second)]
    np.maximum.at(best[0], votes.first, votes.votes)
    np.maximum.at(best[1], votes.second, votes.votes)
    most = (votes.votes == best[0][votes.first]) & (votes.votes == best[1][votes.second])
    return np.asarray(most & (votes.votes >= p.least_votes) & (votes.votes >= p.least_share * longer))


def _around(at: Floats, place: Floats, disparity: Floats, p: RangeParameters) -> Floats:
    from scipy.spatial import cKDTree

    near = np.sort(disparity[cKDTree(place).query(at, p.neighbours)[1]], axis=1)
    cut = int(p.cut * p.neighbours)
    return np.column_stack([near[:, cut] - p.margin, near[:, p.neighbours - 1 - cut] + p.margin])


# Pong, Haralick and Shapiro, Pattern Recognition Letters 1989; dynamic programming along a row after Ohta and Kanade,
# PAMI 7 (1985).


@dataclass(frozen=True)
class Votes:
    """Rows that matched a crossing of arc `first` to one of arc `second`, columns, one a pair of arcs.  `disparity`:
    median over the voting rows, px."""

    first: Ints
    second: Ints
    votes: Ints
    disparity: Floats


def vote(first: RowArcs, second: RowArcs, bounds: Floats, parameters: EpipolarParameters) -> Votes:
    """Match the crossings of each row and count the votes; `bounds` (n, 2): disparities that each crossing of the first
    picture may have."""
    from scipy.ndimage import median

    a, b = first.crossings, second.crossings
    starts, columns = index_rows(a, b), [describe(c, parameters) for c in (a, b)]
    match = match_rows(starts[0], columns[0], bounds, starts[1], columns[1], parameters)
    i = np.flatnonzero(match >= 0)
    j = match[i]
    order = np.lexsort((a.row[i], b.arc[j], a.arc[i]))
    i, j = i[order], j[order]
    pair = a.arc[i] * max(len(second.arcs), 1) + b.arc[j]
    _, start, votes = np.unique(pair, return_index=True, return_counts=True)
    return Votes(
        first=a.arc[i[start]],
        second=b.arc[j[start]],
        votes=votes.astype(np.int64),
        disparity=np.asarray(median(a.x[i] - b.x[j], pair, pair[start]) if len(pair) else [], float),
    )


def index_rows(first: Crossings, second: Crossings) -> list[Ints]:
    """Where the crossings of each row begin in both, and where the last ends: (rows + 1,) each."""
    ends = [np.array([c.row[0], c.row[-1]]) for c in (first, second) if len(c)]
    span = np.concatenate([*ends, np.zeros(0, np.int64)])
    rows = np.arange(span.min(), span.max() + 2) if len(span) else np.zeros(1, np.int64)
    return [np.searchsorted(c.row, rows).astype(np.int64) for c in (first, second)]


def describe(crossings: Crossings, p: EpipolarParameters) -> Floats:
    """x, angle and compressed contrast (n, 3), as the kernels compare them."""
    return np.column_stack([crossings.x, crossings.angle, compress_contrast(crossings.contrast, p.contrast_scale)])


def match_rows(
    first_start: Ints, first: Floats, bounds: Floats, second_start: Ints, second: Floats, parameters: EpipolarParameters
) -> Ints:
    """The crossing of the second picture matched to each of the first, -1 for none.

    first, second (n, 3): x, angle and contrast of crossings, those of a row between two of first_start, second_start
    (rows + 1), by ascending x; bounds (n, 2): the disparities that each of the first may have."""
    from vision.stereo import epipolar_kernels

    most = max(int(np.diff(start).max(initial=0)) for start in (first_start, second_start))
    match, partner = np.full(len(first), -1, np.int64), np.full(len(second), -1, np.int64)
    epipolar_kernels.match_rows(
        first_start, first, bounds, second_start, second,
        parameters.angle_sigma, parameters.contrast_sigma, parameters.skip, parameters.layers,
        np.empty((2, most), np.int64), np.empty((most + 1, most + 1)), np.empty((most + 1, most + 1), np.int64),
        match, partner,
    )  # fmt: skip
    return match
