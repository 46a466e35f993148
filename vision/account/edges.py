"""The predicted edges of all cameras as samples, the edge elements along their normals, and the evidence by run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from relmodel.arrays import Bools, Floats, Ints, Rows, sum_by_group
from vision.account.account_parameters import (
    AccountParameters,
    RunParameters,
    SampleParameters,
    SideParameters,
    SupportParameters,
)
from vision.cameras.cameras import Rig
from vision.localisation.measurements import EdgeIndex
from vision.localisation.views import SMOOTH, ViewArcs
from vision.scene import Scene, StoredScene


@dataclass(frozen=True)
class Sides(Rows):
    """What lies on either side of samples along the image normal, the side of lower pixels first.

    sample (m,): those looked at; surface (m, 2): the scene's, -1 for none; normal (m, 2, 3): in the world, zero for
    none; rise (m, 2): sine of the angle by which what is seen on one side rises over the plane of the other: both are
    positive in a corner, negative on a ridge, and differ where one side occludes the other.
    """

    sample: Ints
    surface: Ints
    normal: Floats
    rise: Floats


def look_at_sides(scene: Scene, rig: Rig, world_from_rig: Floats, samples: Samples, p: SideParameters) -> Sides:
    """What a ray on each side of an edge hits first, for samples every few pixels of every run."""
    along = np.floor(np.cumsum(samples.length_px) / p.spacing_px)
    some = np.flatnonzero((np.diff(along, prepend=-1) > 0) | (np.diff(samples.run, prepend=-1) != 0))
    corner = scene.vertices[scene.triangles]
    surface = np.full((len(some), 2), -1)
    normal, point = np.zeros((2, len(some), 2, 3))
    for number, (name, camera) in enumerate(rig.cameras.items()):
        mine = np.flatnonzero(samples.camera[some] == number)
        pose = world_from_rig @ rig.rig_from_camera[name]
        direction = samples.direction[some[mine]]
        across = np.stack([-direction[:, 1], direction[:, 0]], axis=1)
        for side, step in enumerate((-p.step_px, p.step_px)):
            xy = camera.normalise(samples.pixel[some[mine]] + step * across)
            rays = np.concatenate([xy, np.ones((len(xy), 1))], axis=1) @ pose[:3, :3].T
            hit = scene.rays.nearest(pose[:3, 3], rays)
            rows, rays, hit = mine[hit >= 0], rays[hit >= 0], hit[hit >= 0]
            way = np.cross(corner[hit, 1] - corner[hit, 0], corner[hit, 2] - corner[hit, 0])
            surface[rows, side] = scene.triangle_surface[hit]
            normal[rows, side] = way / np.maximum(np.linalg.norm(way, axis=1, keepdims=True), 1e-12)
            depth = np.einsum("ni,ni->n", way, corner[hit, 0] - pose[:3, 3]) / np.einsum("ni,ni->n", way, rays)
            point[rows, side] = pose[:3, 3] + depth[:, None] * rays
    apart = point - point[:, ::-1]
    length = np.maximum(np.linalg.norm(apart, axis=2), 1e-9)
    rise = np.einsum("nki,nki->nk", apart, normal[:, ::-1]) / length
    rise[(surface < 0).any(axis=1)] = 0.0
    return Sides(some, surface, normal, rise)


@dataclass(frozen=True)
class SampleSupport:
    """What supports the samples (n,).

    found: whether an edge element lies where the sample is; weight: px that it counts, zero on the picture's border and
    where a predicted edge of other surfaces lies so near that the picture cannot tell the two apart; chance: share of
    the places nearby, off all predicted edges, where an element lies as well; contrast: grey of the strongest that was
    found, 0 for none; owner: of each row of `Nearby` the sample nearest to its element, -1 where none lies within the
    tolerance.
    """

    found: Bools
    weight: Floats
    chance: Floats
    contrast: Floats
    owner: Ints


def measure_support(samples: Samples, nearby: Nearby, p: SupportParameters) -> SampleSupport:
    """The support by the elements near samples; an element supports the predicted edges of one surface only, the
    nearest.

    Edges that share a surface, as both rims of a bore in a thin web do, may share their elements, and so may the edges
    of a part that shows little, as the head of a bolt: they are present or absent together.
    """
    n, away = len(samples.run), np.abs(nearby.offset)
    elements = int(nearby.element.max(initial=-1)) + 1
    nearest = np.full(elements, np.inf)
    np.minimum.at(nearest, nearby.element, away)
    owner = np.zeros(elements, np.int64)
    first = away <= nearest[nearby.element]
    owner[nearby.element[first]] = nearby.sample[first]
    alien = ~share_surface(samples.kin[nearby.sample], samples.kin[owner[nearby.element]])
    claimed = alien & (nearest[nearby.element] < np.minimum(away - p.tie_px, p.tolerance_px))
    own = (away <= p.tolerance_px) & ~claimed
    found = np.zeros(n, bool)
    found[nearby.sample[own]] = True
    contrast = np.zeros(n)
    np.maximum.at(contrast, nearby.sample[own], nearby.contrast[own])

    # Chance: windows as wide as the tolerance, of what no predicted edge accounts for.
    free = nearest[nearby.element] > p.tolerance_px
    chance = np.zeros(n)
    for place in p.chance_px:
        seen = np.zeros(n, bool)
        seen[nearby.sample[free & (np.abs(nearby.offset - place) <= p.tolerance_px)]] = True
        chance += seen
    taken = np.where(nearest <= p.tolerance_px, owner, -1)[nearby.element]
    return SampleSupport(found, weigh_samples(samples, p), chance / len(p.chance_px), contrast, taken)


def weigh_samples(samples: Samples, p: SupportParameters) -> Floats:
    """The px (n,) that samples count where they are found, as in `SampleSupport`: no picture is needed to say."""
    return np.where(_are_crowded(samples, p) | ~samples.inside, 0.0, samples.length_px)


def share_surface(a: Ints, b: Ints) -> Bools:
    """Whether two samples (n, 2), (n, 2) lie on one surface."""
    return np.asarray(((a[:, :, None] == b[:, None, :]) & (a[:, :, None] >= 0)).any(axis=(1, 2)))


def _are_crowded(samples: Samples, p: SupportParameters) -> Bools:
    """Which samples lie too near to a nearly parallel predicted edge of other surfaces to be distinguished from it."""
    from scipy.spatial import cKDTree

    out = np.zeros(len(samples.run), bool)
    # A third coordinate beyond any picture's size keeps the cameras apart.
    at = np.column_stack([samples.pixel, 1e6 * samples.camera])
    i, j = cKDTree(at).query_pairs(p.crowded_px, output_type="ndarray").T
    other = samples.arc[i] != samples.arc[j]
    i, j = i[other], j[other]
    parallel = np.abs(np.einsum("ni,ni->n", samples.direction[i], samples.direction[j])) > p.crowded_cosine
    i, j = i[parallel], j[parallel]
    alien = ~share_surface(samples.kin[i], samples.kin[j])
    out[i[alien]] = out[j[alien]] = True
    return out


@dataclass(frozen=True)
class Samples(Rows):
    """Samples of visible sharp arcs and silhouettes in all cameras, as columns, run by run.

    camera: number in the rig; run: counted over all cameras; view_run: as the camera's view counts it; kind: index of
    views.KINDS; arc: as views count arcs; surface (n, 2): the scene's surfaces on either side, -1 for none; kin (n, 2):
    what is present or absent together with the edge, -1 for none: its surfaces, of a part that shows little the part;
    point (n, 3): in the world; pixel, direction (n, 2): in the camera without distortion; normal (n, 2, 3): outward, of
    the two surfaces in the world; px_per_mm (n, 2): how far along the image normal (-dy, dx) the edge moves where that
    surface moves outward and the other stays, zero where the two are nearly tangent; length_px; front: how many of the
    two surfaces face the camera; inside: whether it lies where edges can be found, off the picture's border.
    """

    camera: Ints
    run: Ints
    view_run: Ints
    kind: NDArray[np.int8]
    arc: Ints
    surface: Ints
    kin: Ints
    point: Floats
    pixel: Floats
    direction: Floats
    normal: Floats
    px_per_mm: Floats
    length_px: Floats
    front: Ints
    inside: Bools

    @property
    def run_count(self) -> int:
        return int(self.run.max(initial=-1)) + 1


def collect_samples(
    stored: StoredScene,
    rig: Rig,
    bounds: Sequence[tuple[Floats, Floats]],
    world_from_rig: Floats,
    views: Mapping[str, ViewArcs],
    p: SampleParameters,
) -> Samples:
    """The samples of what cameras see at a pose; bounds: where edges can be found, by camera in the rig's order."""
    pieces: list[Samples] = []
    runs = 0
    for number, name in enumerate(rig.cameras):
        piece = _of_view(stored, rig, number, bounds[number], world_from_rig, views[name])
        kept, run = np.unique(piece.run, return_inverse=True)
        pieces.append(replace(piece, run=runs + run.ravel()))
        runs += len(kept)
    whole = Samples.stack(pieces)
    return replace(whole, kin=_find_kin(stored, whole, p))


def _find_kin(stored: StoredScene, samples: Samples, p: SampleParameters) -> Ints:
    """Numbers (n, 2) of what is present or absent together with each sample: its surfaces, of small parts the part."""
    occurrence_of = stored.scene.surface_occurrence
    occurrence = occurrence_of[samples.surface[:, 0]]
    count = len(stored.occurrence_id)
    length = np.zeros(count)
    for camera in np.unique(samples.camera):
        mine = samples.camera == camera
        length = np.maximum(length, np.bincount(occurrence[mine], samples.length_px[mine], count))
    small = length[occurrence] <= p.small_part_px
    part = len(occurrence_of) + np.stack([occurrence, np.full(len(occurrence), -1 - len(occurrence_of))], axis=1)
    return np.where(small[:, None], part, samples.surface)


def _of_view(
    stored: StoredScene, rig: Rig, number: int, bounds: tuple[Floats, Floats], world_from_rig: Floats, view: ViewArcs
) -> Samples:
    name = list(rig.cameras)[number]
    pose = world_from_rig @ rig.rig_from_camera[name]
    seen, arcs = view.samples, len(stored.scene.arc_occurrence)
    silhouette = seen.arc >= arcs
    surface = np.where(
        silhouette[:, None],
        np.stack([seen.arc - arcs, np.full(len(seen.arc), -1)], axis=1),
        stored.arc_surfaces[np.where(silhouette, 0, seen.arc)],
    )
    normal = np.stack([seen.normal_a, seen.normal_b], axis=1)
    image_normal = np.stack([-seen.direction[:, 1], seen.direction[:, 0]], axis=1)
    in_camera = (seen.point - pose[:3, 3]) @ pose[:3, :3]
    way = _slide(normal, silhouette) @ pose[:3, :3]
    depth = in_camera[:, 2, None, None]
    flow = (way[..., :2] - way[..., 2:] * (in_camera[:, None, :2] / depth)) / depth
    flow = flow @ rig.cameras[name].matrix[:2, :2].T
    whole = Samples(
        camera=np.full(len(seen.arc), number),
        run=view.run,
        view_run=view.run,
        kind=view.kind[view.run],
        arc=seen.arc,
        surface=surface,
        kin=surface,
        point=seen.point,
        pixel=seen.pixel,
        direction=seen.direction,
        normal=normal,
        px_per_mm=np.einsum("nki,ni->nk", flow, image_normal),
        length_px=seen.length_px,
        front=(np.einsum("nki,ni->nk", normal, pose[:3, 3] - seen.point) > 0).sum(axis=1),
        inside=np.asarray(((seen.pixel > bounds[0] + 1) & (seen.pixel < bounds[1] - 1)).all(axis=1)),
    )
    return whole.take(whole.kind != SMOOTH)


def _slide(normal: Floats, silhouette: Bools) -> Floats:
    """How an edge moves (n, 2, 3), mm, by each of its surfaces moving outward by one: along the other, which stays."""
    cosine = np.einsum("ni,ni->n", normal[:, 0], normal[:, 1])
    left = 1 - cosine**2
    steep = (left > 0.1)[:, None, None]
    slide = (normal - cosine[:, None, None] * normal[:, ::-1]) / np.maximum(left, 0.1)[:, None, None]
    return np.where(silhouette[:, None, None], normal, slide * steep)


@dataclass(frozen=True)
class Nearby:
    """Edge elements on the normals of samples, as columns, sample by sample: `first` (samples + 1,) says where each
    sample's begin.

    sample; element: index in its picture's, plus those of the cameras before; offset: px along the image normal, the
    camera's response shift taken off; contrast: grey.
    """

    first: Ints
    sample: Ints
    element: Ints
    offset: Floats
    contrast: Floats


def find_nearby(
    camera: Ints, pixel: Floats, direction: Floats, indexes: list[EdgeIndex], response_px: Floats, p: SampleParameters
) -> Nearby:
    """The elements near samples, which stand camera by camera; response_px (c,): how far each camera moves an edge of
    the whole range of grey toward its dark side."""
    from vision.account import kernels

    limits = np.array([p.reach_px, p.min_cosine, p.max_along_px])
    pieces, counts, elements = [], [], 0
    for number, index in enumerate(indexes):
        rows = np.flatnonzero(camera == number)
        edges = index.edges
        first = np.zeros(len(rows) + 1, np.int64)
        offset, element = np.zeros(0), np.zeros(0, np.int64)
        for _ in range(2):
            kernels.list_elements(
                np.ascontiguousarray(pixel[rows]), np.ascontiguousarray(direction[rows]), limits,
                edges.position, edges.normal, index.start, index.order, np.array([index.columns, index.rows]),
                edges.low, first, offset, element,
            )  # fmt: skip
            if not len(offset):
                counts.append(first[1:].copy())
                first = np.concatenate([[0], np.cumsum(first[1:])])
                offset, element = np.zeros(first[-1]), np.zeros(first[-1], np.int64)
                if not len(offset):
                    break
        sample = np.repeat(rows, counts[-1])
        along = direction[sample]
        polarity = np.sign(edges.normal[element, 1] * along[:, 0] - edges.normal[element, 0] * along[:, 1])
        contrast = np.abs(edges.contrast[element])
        # An edge is seen toward its dark side: the true one lies toward the bright.
        offset = offset + polarity * contrast / edges.grey_range * response_px[number]
        pieces.append((sample, elements + element, offset, contrast))
        elements += len(edges.position)
    columns = [np.concatenate(column) for column in zip(*pieces, strict=True)]
    first = np.concatenate([[0], np.cumsum(np.concatenate(counts))])
    return Nearby(first, *columns)


@dataclass(frozen=True)
class EdgeAccount:
    """All that is known of the edges that cameras should see at a pose: their samples, the elements beside them, what
    supports them, what lies on their sides, and the evidence run by run, of whole runs and of runs parted where they
    turn."""

    samples: Samples
    nearby: Nearby
    support: SampleSupport
    sides: Sides
    runs: EdgeRuns
    pieces: EdgeRuns


def take_account(
    stored: StoredScene,
    rig: Rig,
    world_from_rig: Floats,
    indexes: list[EdgeIndex],
    response_px: Floats,
    views: Mapping[str, ViewArcs],
    p: AccountParameters,
) -> EdgeAccount:
    """The account of what cameras see of a scene at a pose; indexes, response_px: by camera, as `find_nearby` has them;
    views: by its name."""
    bounds = [(index.edges.low, index.edges.high) for index in indexes]
    samples = collect_samples(stored, rig, bounds, world_from_rig, views, p.samples)
    nearby = find_nearby(samples.camera, samples.pixel, samples.direction, indexes, response_px, p.samples)
    support = measure_support(samples, nearby, p.support)
    sides = look_at_sides(stored.scene, rig, world_from_rig, samples, p.sides)
    pieces = weigh_runs(part_at_turns(samples, p.runs), support, sides, p.runs)
    return EdgeAccount(samples, nearby, support, sides, weigh_runs(samples, support, sides, p.runs), pieces)


def weigh_lookalike(
    stored: StoredScene, it: EdgeRuns, asked: Bools, cameras: Sequence[str], p: RunParameters
) -> tuple[float, str]:
    """Log odds that the object lacks some of its asked edges (r,), as another of like outline does, against having them
    all; and, in words, the edge that says most for that."""
    rows = it.take(np.flatnonzero(asked & (it.weight_px > 0)))
    if not len(rows.camera):
        return 0.0, ""
    whole = np.zeros(len(rows.camera), np.int64)
    odds = weigh_absence(whole, rows.camera, rows.surface, rows.in_light, 1, len(cameras), p)
    worst = int(np.argmin(rows.log_odds))
    own = [stored.name_surface(surface) for surface in rows.surface[worst].tolist() if surface >= 0]
    where = f"{rows.weight_px[worst]:.0f} px of {' and '.join(own)} in the picture of {cameras[rows.camera[worst]]}"
    return float(odds[0]), where


# Evidence run by run: how likely a predicted edge shows here, and the log odds that it is there.
#
# An edge that is there either shows, and is found along nearly all of its length, or lacks contrast in this light and
# shows in part or not at all; where nothing is, as much is found by chance as nearby. The found share of a run of n
# independent stretches is beta-binomial in each case. How likely an edge shows cannot be measured at its own place,
# since a missing edge has no contrast: it is the share that edges between similar sides show elsewhere in the same
# picture.


@dataclass(frozen=True)
class EdgeRuns(Rows):
    """Predicted edges of all cameras as columns, one row a run.

    camera; view_run: as the camera's view counts it; kind; surface (r, 2); visible_px; weight_px: of it what can be
    distinguished from other edges; found: share of that which is supported; chance: share that chance supports; shows:
    probability that such an edge shows; log_odds: of there against not there; expected: what they would be in the mean
    were it there; in_light (r, k): log odds in k lights, equally likely, from one in which few edges show to one
    in which most do: the edges of a thing are seen in the same.
    """

    camera: Ints
    view_run: Ints
    kind: Ints
    surface: Ints
    visible_px: Floats
    weight_px: Floats
    found: Floats
    chance: Floats
    shows: Floats
    log_odds: Floats
    expected: Floats
    in_light: Floats


def part_at_turns(samples: Samples, p: RunParameters) -> Samples:
    """The samples with each run parted where it has turned: an edge that bends shows, or hides, in each direction by
    itself, since each faces another light."""
    angle = np.arctan2(samples.direction[:, 1], samples.direction[:, 0])
    step = np.mod(np.diff(angle, prepend=0.0) + np.pi, 2 * np.pi) - np.pi
    head = np.flatnonzero(np.diff(samples.run, prepend=-1) != 0)
    step[head] = 0.0

    def since_head(values: Floats) -> Floats:
        total = np.cumsum(values)
        before = np.append(0.0, total)[head]
        return np.asarray(total - np.repeat(before, np.diff(np.append(head, len(total)))))

    # The most so far: where an edge wavers its pieces stay whole.
    apart = 1e3 * samples.run
    turned = (np.maximum.accumulate(apart + np.abs(since_head(step))) - apart) / p.turn
    piece = np.floor(np.minimum(turned, since_head(samples.length_px) / p.stretch_px))
    parted = (np.diff(samples.run, prepend=-1) != 0) | (np.diff(piece, prepend=0) != 0)
    return replace(samples, run=np.cumsum(parted) - 1)


def weigh_runs(samples: Samples, support: SampleSupport, sides: Sides, p: RunParameters) -> EdgeRuns:
    """The evidence of each run of samples."""
    count, run = samples.run_count, samples.run
    weight = np.bincount(run, support.weight, count).astype(float)

    def mean(values: Floats | Bools) -> Floats:
        return np.asarray(np.bincount(run, support.weight * values, count) / np.maximum(weight, 1e-9))

    head = np.flatnonzero(np.diff(run, prepend=-1) != 0)
    found, chance = mean(support.found), mean(support.chance)
    every = float(support.weight @ support.chance) / max(float(support.weight.sum()), 1e-9)
    chance = (chance * weight + every * p.chance_px) / (weight + p.chance_px)
    chance = np.clip(chance, p.least_chance, p.most_chance)
    surface = samples.surface[head]
    shows = _predict_shows(samples, sides, head, surface, found, weight, p)
    # A share between that of an edge that shows and that of one that does not.
    full = p.shown[0] / sum(p.shown)
    faint = 0.5 * p.partly + (1 - p.partly) * chance
    share = np.clip((shows - faint) / (full - faint), p.least_shows, p.most_shows)
    n = weight / p.stretch_px
    log_odds = compute_log_odds(found, n, chance, share, p)
    levels = (np.arange(p.levels) + 0.5) / p.levels
    grid = np.stack([_log_likelihoods(np.full(count, level), n, chance, p) for level in levels], axis=1)
    there = np.exp(_there(grid, share, p))
    odds = _compare(grid, share, p)
    # Beta-binomial likelihoods of shares lack the number of ways, which is the same for all three: weigh by it.
    ways = np.exp(_ways(levels[:, None], n))
    expected = (there * ways * odds).sum(axis=0) / np.maximum((there * ways).sum(axis=0), 1e-300)
    none = weight <= 0
    return EdgeRuns(
        camera=samples.camera[head],
        view_run=samples.view_run[head],
        kind=samples.kind[head].astype(np.int64),
        surface=surface,
        visible_px=np.bincount(run, samples.length_px, count).astype(float),
        weight_px=weight,
        found=found,
        chance=chance,
        shows=shows,
        log_odds=np.where(none, 0.0, log_odds),
        expected=np.where(none, 0.0, expected),
        in_light=np.where(none[:, None], 0.0, _in_lights(found, n, chance, share, p)),
    )


def _in_lights(found: Floats, n: Floats, chance: Floats, share: Floats, p: RunParameters) -> Floats:
    """Log odds (r, k) where the share of edges that show is a quantile of its beta distribution."""
    from scipy.special import betaincinv

    u = (np.arange(p.lights) + 0.5) / p.lights
    a, b = (p.alike_light * s[:, None] for s in (share, 1 - share))
    share_in = np.asarray(np.clip(betaincinv(a, b, u[None]), 1e-6, 1 - 1e-6), float)
    return compute_log_odds(found[:, None], n[:, None], chance[:, None], share_in, p)


def sum_in_one_light(group: Ints, in_light: Floats, count: int) -> Floats:
    """Log odds (count,) of groups of edges that a camera sees in the same light, which is not known."""
    total = np.stack([np.bincount(group, column, count) for column in in_light.T], axis=1)
    return np.asarray(np.logaddexp.reduce(total, axis=1) - np.log(in_light.shape[1]))


def weigh_absence(
    item: Ints, camera: Ints, surface: Ints, in_light: Floats, count: int, cameras: int, p: RunParameters
) -> Floats:
    """Log odds (count,) that some edges of items are not there, against all being there.

    item, camera (r,), surface (r, 2): of rows, of which those of one pair of surfaces in a picture are there or not
    together; in_light (r, k): as `EdgeRuns` has it.  What share of its edges an item would lack is not known: those of
    `missing` are as likely one as another.  So no edge that is found pays for one that should show and does not.
    """
    rows = np.column_stack([item * cameras + camera, np.sort(surface, axis=1)])
    edges, edge = np.unique(rows, axis=0, return_inverse=True)
    own = sum_by_group(edge.ravel(), in_light, len(edges))
    each = [np.logaddexp(np.log1p(-share) + own, np.log(share)) if share else own for share in (0.0, *p.missing)]
    there, *some = (sum_in_one_light(edges[:, 0], odds, count * cameras) for odds in each)
    by_share = (np.stack(some) - there).reshape(len(some), count, cameras).sum(axis=2)
    return np.asarray(np.logaddexp.reduce(by_share) - np.log(len(some)))


def compute_log_odds(found: Floats, n: Floats, chance: Floats, share: Floats, p: RunParameters) -> Floats:
    """Log odds of there against not there for found shares of `n` independent stretches; share: of edges that show."""
    return _compare(_log_likelihoods(found, n, chance, p), share, p)


def _compare(likelihoods: Floats, share: Floats, p: RunParameters) -> Floats:
    """The log odds by log likelihoods (3, ...)."""
    there, (_, partly, nothing) = _there(likelihoods, share, p), likelihoods
    return np.asarray(there - np.logaddexp(np.log1p(-p.stray) + nothing, np.log(p.stray) + partly))


def _there(likelihoods: Floats, share: Floats, p: RunParameters) -> Floats:
    shown, partly, nothing = likelihoods
    faint = np.logaddexp(np.log(p.partly) + partly, np.log1p(-p.partly) + nothing)
    return np.asarray(np.logaddexp(np.log(share) + shown, np.log1p(-share) + faint))


def _log_likelihoods(found: Floats, n: Floats, chance: Floats, p: RunParameters) -> Floats:
    """Log likelihoods (3, r) of an edge that shows, of one that shows in part, and of chance."""
    from scipy.special import betaln

    one, by_chance = np.ones_like(chance), p.chance_count * chance
    first = np.stack([p.shown[0] * one, one, by_chance])
    second = np.stack([p.shown[1] * one, one, p.chance_count - by_chance])
    return np.asarray(betaln(first + found * n, second + (1 - found) * n) - betaln(first, second))


def _ways(found: Floats, n: Floats) -> Floats:
    from scipy.special import gammaln

    return np.asarray(gammaln(n + 1) - gammaln(found * n + 1) - gammaln((1 - found) * n + 1))


def _predict_shows(
    samples: Samples, sides: Sides, head: Ints, surface: Ints, found: Floats, weight: Floats, p: RunParameters
) -> Floats:
    """The share (r,) that runs between alike sides show elsewhere in the same picture, other edges of both of a run's
    surfaces left out."""
    count, run = len(head), samples.run[sides.sample]
    looked = np.maximum(np.bincount(run, minlength=count), 1)
    nothing = p.background * (sides.surface < 0)
    bend = p.bend * np.sign(np.where(np.abs(sides.rise) > p.flat, sides.rise, 0.0))
    columns = np.concatenate([sides.normal, nothing[..., None], bend[..., None]], axis=2).reshape(len(run), 10)
    mean = np.stack([np.bincount(run, column, count) for column in columns.T], axis=1) / looked[:, None]
    mean = mean.reshape(count, 2, 5)
    usual = float(weight @ found) / max(float(weight.sum()), 1e-9)
    out = np.full(count, usual)
    for camera in np.unique(samples.camera):
        rows = np.flatnonzero(samples.camera[head] == camera)
        here, turned = mean[rows].reshape(len(rows), 10), mean[rows][:, ::-1].reshape(len(rows), 10)
        apart = np.minimum(_squares(here, here), _squares(here, turned)) / (2 * p.alike**2)
        front = samples.front[head[rows]]
        apart += front[:, None] != front[None]
        trust = np.minimum(weight[rows], p.most_px) / p.most_px
        alike = np.exp(-apart) * trust
        i, j = np.divmod(np.arange(len(rows) ** 2), len(rows))
        same = share_surface(surface[rows][i][:, :1], surface[rows][j]) & (
            share_surface(surface[rows][i][:, 1:], surface[rows][j]) | (surface[rows][i][:, 1] < 0)
        )
        alike[same.reshape(alike.shape)] = 0.0
        out[rows] = (alike @ found[rows] + p.usual_runs * usual) / (alike.sum(axis=1) + p.usual_runs)
    return out


def _squares(a: Floats, b: Floats) -> Floats:
    """Squared distances (n, n) between rows."""
    return np.asarray(np.maximum((a**2).sum(axis=1)[:, None] + (b**2).sum(axis=1)[None] - 2 * a @ b.T, 0.0))
