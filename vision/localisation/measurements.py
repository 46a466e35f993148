"""Sub-pixel edge elements beside the samples of a prediction, and what of the cameras is solved with the pose."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from relmodel.arrays import Bools, Floats, Ints, sum_by_group
from relmodel.geometry.transforms import carry, inverse, skew
from vision.cameras.cameras import Rig, perturb
from vision.localisation.hypotheses import (
    EdgePoints,
    Prediction,
    flow_in_camera,
    project_directions,
    project_with_jacobians,
)

# A camera has eleven unknowns: how far its response moves edges toward their dark side (px at a contrast of the whole
# range of grey), the principal point (px, 2), the focal length (as a share of it), a right perturbation of its place in
# the rig (t mm, r rad), and what is to be added to its first coefficient of radial distortion. The rig says how well
# each is known; what is exact stays out of the solution.

COUNT = 11
UNKNOWNS = ("response", "centre_u", "centre_v", "focal", "x", "y", "z", "rx", "ry", "rz", "radial")
RESPONSE, CENTRE, FOCAL, PLACE, RADIAL = 0, slice(1, 3), 3, slice(4, 10), 10

MIN_COSINE = 0.94  # of the greatest angle between a predicted arc and an edge element
MAX_ALONG_PX = 0.75  # along the arc between a sample and the edge element on its normal
MOST_TOLERANCE = 2.5  # sigmas of an arc's tolerance within which it is looked for
SYSTEMATIC_PX = 0.08  # what an edge's own sigma leaves out: tessellation, rounded and burred edges
TEXTURE_PX = 0.5  # by which texture displaces an edge of its own contrast; less in proportion to the contrast
RESPONSE_PX = 0.25  # at a contrast of the whole range of grey: how far a response moves edges toward their dark side
RESPONSE_SIGMA_PX = 0.25  # standard deviation of that, an unknown of each camera
ALIKE = 30.0  # edges of a camera's pictures err alike: what they show of it counts so much less beside its file
LOOSE = 0.001  # by which the file counts where the pictures are asked what they show of it
CALIBRATION_PX = 0.02  # standard deviation of each camera's principal point, two unknowns
# Usual standard deviation by which an arc's image is shifted as a whole, where all of its edges are found; the more in
# proportion, the fewer are, but for fewer than LEAST_FOUND.
ARC_SHIFT_PX = 0.06
LEAST_FOUND = 0.05
OFFSET_PX = 0.4  # standard deviation of edges about the arcs they belong to, beyond their own
Limits = tuple[float, float]  # reach along the normals and scale of the robust loss, px


@dataclass(frozen=True)
class CameraUnknowns:
    """Expected values and standard deviations (c, 11) of the cameras' own unknowns; sigma zero: exact.

    What is solved are u numbers, expected and deviation (u,), of which those of the cameras follow by `shared` (c, 11,
    u): the numbers of each camera, or where rigs took pictures from standpoints those of their cameras once, six of
    each standpoint, by `Standpoint.root`, and six of where the base of each carrier stands beside that of the first, by
    `Standpoint.sway`, of which `standpoints` and `bases` have the columns by name."""

    mean: Floats
    sigma: Floats
    expected: Floats
    deviation: Floats
    shared: Floats
    standpoints: dict[str, slice]
    bases: dict[str, slice]

    @property
    def precision(self) -> Floats:
        """Inverse variances (u,); one for what is exact, which no measurement moves."""
        return np.where(self.deviation > 0, self.deviation, 1.0) ** -2.0

    def held(self, by: float) -> Floats:
        """What is added to the precision (u,) where what the rig's file says of its cameras counts `by` times."""
        stands = min((it.start for it in self.standpoints.values()), default=self.mean.size)
        said = np.arange(len(self.expected)) < stands
        return np.where(said & ~(self.shared[:, RESPONSE] != 0).any(axis=0), (by - 1) * self.precision, 0.0)

    def of_cameras(self, solved: Floats) -> Floats:
        """The cameras' unknowns (c, 11) by what is solved (u,)."""
        return np.asarray(self.shared @ np.ravel(solved))


def describe_unknowns(rig: Rig) -> CameraUnknowns:
    """The unknowns of a rig's cameras, in its order."""
    mean, sigma = np.zeros((2, len(rig.cameras), COUNT))
    mean[:, RESPONSE] = RESPONSE_PX
    for number, name in enumerate(rig.cameras):
        known = rig.sigma_of(name)
        sigma[number, RESPONSE] = RESPONSE_SIGMA_PX
        sigma[number, CENTRE] = max(known.centre_px, CALIBRATION_PX)
        sigma[number, FOCAL] = known.focal
        sigma[number, PLACE] = np.repeat([known.translation_mm, known.rotation], 3)
        sigma[number, RADIAL] = known.radial
    if rig.moved is None:
        each = np.eye(mean.size).reshape(*mean.shape, -1)
        return CameraUnknowns(mean, sigma, mean.ravel(), sigma.ravel(), each, {}, {})
    # The response is that of a picture, all else that of the camera wherever it stands.
    places = map(rig.standpoint_of, rig.cameras)
    own = [(rig.standpoints[it].carrier, name.removeprefix(it)) for name, it in zip(rig.cameras, places, strict=True)]
    source = np.array([[number, *[own.index(name)] * (COUNT - 1)] for number, name in enumerate(own)])
    column, at = np.unique(source * COUNT + np.arange(COUNT), return_inverse=True)
    names = list(dict.fromkeys([rig.first, *map(rig.standpoint_of, rig.cameras)]))
    carriers = list(dict.fromkeys(rig.standpoints[name].carrier for name in names))
    normal = 6 * (len(names) + len(carriers) - 1)
    shared = np.zeros((*mean.shape, len(column) + normal))
    np.put_along_axis(shared, at.reshape(*mean.shape, 1), 1.0, axis=2)
    six = [slice(start, start + 6) for start in range(len(column), len(column) + normal, 6)]
    columns, bases = dict(zip(names, six, strict=False)), dict(zip(carriers[1:], six[len(names) :], strict=True))
    for number, name in enumerate(rig.cameras):
        if (place := rig.standpoint_of(name)) == rig.first:
            continue
        first, it = rig.standpoints[rig.first], rig.standpoints[place]
        camera_from_rig = inverse(rig.rig_from_camera[name])
        camera_from_place = camera_from_rig @ inverse(first.world_from_rig) @ it.world_from_rig
        shared[number, PLACE, columns[place]] = carry(camera_from_place) @ it.root
        shared[number, PLACE, columns[rig.first]] = -carry(camera_from_rig) @ first.root
        if it.carrier in bases:
            shared[number, PLACE, bases[it.carrier]] = carry(camera_from_place) @ it.sway
    expected = np.concatenate([mean.ravel()[column], np.zeros(normal)])
    deviation = np.concatenate([sigma.ravel()[column], np.ones(normal)])
    shared *= deviation > 0  # what is exact moves nothing
    of_cameras = shared @ expected, np.sqrt(shared**2 @ deviation**2)
    return CameraUnknowns(*of_cameras, expected, deviation, shared, columns, bases)


def split_response(solved: Floats) -> tuple[Floats, float]:
    """How far (c,) responses move edges toward their dark side, of what was solved (c,), px, and the most that was
    solved toward the bright one: no response does that, outlines of rounded surfaces do, and sizes err by as much."""
    response_px = np.maximum(solved, 0.0)
    return response_px, float((response_px - solved).max(initial=0.0))


def differentiate(
    prediction: Prediction, delta: Floats, rows: Ints, pixel: Floats, normal: Floats, response: Floats, sigma: Floats
) -> Floats:
    """Derivatives (k, 11) of the predicted place along the normals (k, 2) by the unknowns of the camera that the `rows`
    (k,) of the prediction belong to; `pixel` (k, 2) where they are, `response` (k,) what moves them by its response;
    zero for what `sigma` (11,) has as exact."""
    out = np.zeros((len(rows), COUNT))
    out[:, RESPONSE] = response
    out[:, CENTRE] = normal
    if sigma[FOCAL] > 0 or sigma[RADIAL] > 0:
        away, square = _from_centre(prediction.matrix[prediction.view[rows]], pixel)
        out[:, FOCAL] = np.einsum("ni,ni->n", normal, away)
        out[:, RADIAL] = out[:, FOCAL] * square
    if (sigma[PLACE] > 0).any():
        point, flow = flow_in_camera(prediction, delta, rows)
        out[:, 4:7] = -np.einsum("ni,nij->nj", normal, flow)
        out[:, 7:10] = np.einsum("ni,nij->nj", normal, flow @ skew(point))
    return np.asarray(out * (sigma > 0))


def _from_centre(matrix: Floats, pixel: Floats) -> tuple[Floats, Floats]:
    """How far pixels (n, 2) lie from the principal point, px (n, 2), and the square of the tangent of their angle from
    the axis (n,); matrix (n, 2, 3)."""
    away = pixel - matrix[:, :, 2]
    return away, np.asarray(((away / matrix[:, [0, 1], [0, 1]]) ** 2).sum(axis=1))


def shift_pixels(prediction: Prediction, delta: Floats, pixel: Floats, own: Floats) -> Floats:
    """How far (n, 2) px the cameras' unknowns (c, 11), all but their responses, move the samples' pixels (n, 2)."""
    of = own[prediction.view]
    away, square = _from_centre(prediction.matrix[prediction.view], pixel)
    out = of[:, CENTRE] + (of[:, FOCAL] + of[:, RADIAL] * square)[:, None] * away
    if own[:, PLACE].any():
        point, flow = flow_in_camera(prediction, delta)
        out += np.einsum("nij,nj->ni", flow, np.cross(point, of[:, 7:10]) - of[:, 4:7])
    return np.asarray(out)


def correct_rig(rig: Rig, own: Floats) -> Rig:
    """The rig as the cameras' unknowns (c, 11) say that it is."""
    cameras, poses = {}, {}
    for (name, camera), values in zip(rig.cameras.items(), own, strict=True):
        matrix = camera.matrix.copy()
        matrix[[0, 1], [0, 1]] *= 1 + values[FOCAL]
        matrix[:2, 2] += values[CENTRE]
        distortion = camera.distortion
        if values[RADIAL] != 0:  # of the pixels freed of the file's distortion, so that to first order both add up
            distortion = np.concatenate([distortion, np.zeros(max(4 - len(distortion), 0))])
            distortion[0] += values[RADIAL]
        cameras[name] = replace(camera, matrix=matrix, distortion=distortion)
        poses[name] = perturb(rig.rig_from_camera[name], values[PLACE])
    return replace(rig, cameras=cameras, rig_from_camera=poses)


class EdgeIndex:
    """Edge elements of one picture bucketed by whole pixels.  odds (n,): of each element, the log likelihood ratio of
    being an edge of the object that stereo gives its arc."""

    def __init__(self, edges: EdgePoints, odds: Floats | float = 0.0) -> None:
        self.edges = edges
        self.columns, self.rows = (np.ceil(edges.high - edges.low).astype(int) + 1).tolist()
        cell = np.rint(edges.position - edges.low).astype(np.int64)
        cell = np.clip(cell, 0, [self.columns - 1, self.rows - 1])
        bucket = cell[:, 1] * self.columns + cell[:, 0]
        self.order = np.argsort(bucket, kind="stable")
        self.start = np.searchsorted(bucket[self.order], np.arange(self.rows * self.columns + 1))
        self.strength = np.maximum(np.abs(edges.contrast), 1e-3)
        self.texture = float(np.median(self.strength)) if len(self.strength) else 1.0
        # Of edges side by side the likelier one counts, by contrast and by stereo.
        self.strength = self.strength * np.exp(odds)

    def measure(self, pixel: Floats, direction: Floats, reach: float, scale: float) -> tuple[Floats, Ints]:
        """Offsets (n,) px along the normals (-dy, dx) to the elements found (n,), -1 where there is none."""
        return self.seek(pixel, direction, (reach, scale, MIN_COSINE, MAX_ALONG_PX), self.strength)

    def seek(
        self, pixel: Floats, direction: Floats, limits: tuple[float, float, float, float], strength: Floats
    ) -> tuple[Floats, Ints]:
        """As `measure`, with `limits` of `kernels.nearest_edges`, and how much each element (e,) counts, if at all."""
        from vision.localisation import kernels

        offset, found = np.empty(len(pixel)), np.empty(len(pixel), np.int64)
        kernels.nearest_edges(
            pixel, direction, np.array(limits), self.edges.position, self.edges.normal, strength,
            self.start, self.order, np.array([self.columns, self.rows]), self.edges.low, offset, found,
        )  # fmt: skip
        return offset, found


@dataclass(frozen=True)
class Measurements:
    """Edge measurements of the samples of a prediction, as columns of equal length n.

    pixel (n, 2), direction (n, 2): predicted at the pose; shift (n,) px along (-dy, dx): how far off its arc lies
    within its tolerance; offset (n,) px along (-dy, dx) to the edge element `found` (-1: none); edge_sigma (n,) px of
    that element; sigma (n,) px with the tolerance of its arc; weight (n,) of the robust loss, 0..1, zero where the
    sample is excluded; slope (n,): derivative of weight times offset by the offset; arc_shift (n,) px: standard
    deviation by which the image of its arc may be shifted as a whole; response (n,): derivative of the offset's
    prediction by its camera's response; jacobian (n, 6 + u) by the pose and what is solved of the cameras."""

    pixel: Floats
    direction: Floats
    shift: Floats
    offset: Floats
    found: Ints
    edge_sigma: Floats
    sigma: Floats
    weight: Floats
    slope: Floats
    arc_shift: Floats
    response: Floats
    jacobian: Floats


def measure(
    prediction: Prediction,
    indexes: list[EdgeIndex],
    delta: Floats,
    unknowns: CameraUnknowns,
    own: Floats,
    limits: Limits,
    votes: Bools,
) -> Measurements:
    """Edge measurements of a prediction whose pose is perturbed by `delta` (6,), given the cameras' `own` unknowns (c,
    11), and which samples vote (n,)."""
    pixel, jacobian = project_with_jacobians(prediction, delta)
    direction = project_directions(prediction, delta)
    normal = np.stack([-direction[:, 1], direction[:, 0]], axis=1)
    # Edges are looked for where the cameras' unknowns, as far as they are solved, put the arc.
    there = pixel + shift_pixels(prediction, delta, pixel, own)
    (reach, scale), wide = limits, float(prediction.tolerance_px.max(initial=0.0))
    found, offset, edge_sigma = np.full(len(pixel), -1), np.zeros(len(pixel)), np.ones(len(pixel))
    responses, by_unknown = np.zeros(len(pixel)), np.zeros((len(pixel), len(unknowns.expected)))
    for number, index in enumerate(indexes):
        rows = np.flatnonzero(prediction.view == number)
        at, along = np.ascontiguousarray(there[rows]), np.ascontiguousarray(direction[rows])
        found[rows] = index.measure(at, along, reach + 2 * wide, float(np.hypot(scale, wide)))[1]
        hit = rows[found[rows] >= 0]
        edge, edges = found[hit], index.edges
        contrast = np.abs(edges.contrast[edge])
        edge_sigma[hit] = np.sqrt(
            edges.sigma[edge] ** 2 + SYSTEMATIC_PX**2 + (TEXTURE_PX * index.texture / contrast) ** 2
        )
        response = -np.sign(np.einsum("ni,ni->n", normal[hit], edges.normal[edge])) * contrast / edges.grey_range
        by_camera = differentiate(prediction, delta, hit, pixel[hit], normal[hit], response, unknowns.sigma[number])
        responses[hit], by_unknown[hit] = by_camera[:, RESPONSE], by_camera @ unknowns.shared[number]
        away = edges.position[edge] - pixel[hit]
        offset[hit] = np.einsum("ni,ni->n", normal[hit], away) - by_camera @ own[number]
    use = (found >= 0) & votes
    shift = _find_shifts(prediction, offset, use, scale)
    weight, slope = weigh(offset, shift, use, scale)
    # A displaced arc displaces all its samples, those of a circle each way: n of them know no more than its tolerance.
    total = _sum_by_arc(prediction, weight)
    sigma = np.sqrt(edge_sigma**2 + prediction.tolerance_px**2 * total)
    # By light or a clipped edge; or another edge is taken for it, the likelier the fewer of its edges are found.
    share = total / np.maximum(_sum_by_arc(prediction, np.ones(len(total))), 1)
    arc_shift = ARC_SHIFT_PX / np.maximum(share, LEAST_FOUND)
    by_pose = np.einsum("ni,nij->nj", normal, jacobian)
    of_sample = (pixel, direction, shift, offset, found, edge_sigma, sigma, weight, slope, arc_shift, responses)
    return Measurements(*of_sample, np.concatenate([by_pose, by_unknown], axis=1))


def _find_shifts(prediction: Prediction, offset: Floats, use: Bools, scale: float) -> Floats:
    """How far (n,) px off its prediction each sample's arc lies, of what its tolerance leaves open: where most of the
    arc's edges agree, at the cost of the distance; zero where the model is exact."""
    tolerance = prediction.tolerance_px
    shift = np.zeros(len(offset))
    if not (use & (tolerance > 0)).any():
        return shift
    rows = np.flatnonzero(use)
    group = np.unique(prediction.image_of_arc[rows], return_inverse=True)[1].ravel()
    most = np.zeros(int(group.max()) + 1)
    np.maximum.at(most, group, tolerance[rows])
    widest = MOST_TOLERANCE
    steps = np.linspace(-widest, widest, 2 * int(np.ceil(2 * widest * most.max() / scale)) + 1)
    tried = steps[:, None] * most
    near = 1 / (1 + ((offset[rows] - tried[:, group]) / scale) ** 2)
    agreed = sum_by_group(group, (near * prediction.weight[rows]).T, len(most)).T
    gained = 0.5 * (scale / OFFSET_PX) ** 2 * agreed - 0.5 * steps[:, None] ** 2
    shift[rows] = tried[np.argmax(gained, axis=0), np.arange(len(most))][group]
    return shift


def weigh(offset: Floats, shift: Floats, use: Bools, scale: float) -> tuple[Floats, Floats]:
    """Weights (n,) of the robust loss of offsets (px) from arcs that lie `shift` (n,) px off, and the derivatives of
    weight times offset by the offset; zero where they are of no use.

    Geman and McClure's loss: an element at `scale` counts a quarter, one at three times that a hundredth."""
    far = ((offset - shift) / scale) ** 2
    return np.where(use, 1 / (1 + far) ** 2, 0.0), np.where(use, (1 - 3 * far) / (1 + far) ** 3, 0.0)


def hold_shifts(m: Measurements, prediction: Prediction) -> Measurements:
    """The measurements as errors that are independent have them: the image of an arc is shifted as a whole, so that
    however many samples it has, they know their mean no better than that.  A share of the mean is taken off offsets
    and derivatives (Fuller and Battese, 1974)."""
    group = prediction.image_of_arc
    weight = m.weight / m.sigma**2
    columns = np.concatenate([m.offset[:, None], m.jacobian], axis=1)
    known = np.bincount(group, weight)
    mean = sum_by_group(group, columns, len(known), weight) / np.maximum(known, 1e-12)[:, None]
    columns = columns - (1 - np.sqrt(share_left(m, prediction)))[:, None] * mean[group]
    return replace(m, offset=columns[:, 0], jacobian=columns[:, 1:])


def share_left(m: Measurements, prediction: Prediction) -> Floats:
    """Of what the samples (n,) of each arc's image say of their mean, the share that its shift leaves."""
    return np.asarray(1 / (1 + m.arc_shift**2 * _sum_by_arc(prediction, m.weight / m.sigma**2)))


def _sum_by_arc(prediction: Prediction, weight: Floats) -> Floats:
    """For each sample (n,) the weight that its arc's image gathers."""
    group = prediction.image_of_arc
    return np.asarray(np.bincount(group, weight)[group] if len(group) else weight)
