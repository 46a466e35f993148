"""The predicted edges of all cameras as samples, what supports them, and the edge elements along their normals."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from relmodel.arrays import Bools, Floats, Ints, Rows
from vision.account.account_parameters import SampleParameters, SideParameters, SupportParameters
from vision.cameras.cameras import Rig
from vision.localisation.measurements import EdgeIndex
from vision.localisation.views import SMOOTH, ViewArcs
from vision.scene import Scene, StoredScene

_NEIGHBOURS = 8  # samples that an element is held against


@dataclass(frozen=True)
class Sides(Rows):
    """What lies on either side of samples along the image normal, the side of lower pixels first.

    sample (m,): those looked at; surface (m, 2): the scene's, -1 for none; normal (m, 2, 3): in the world, zero for
    none; rise (m, 2): sine of the angle by which what is seen on one side rises over the plane of the other: both are
    positive in a corner, negative on a ridge, and differ where one side occludes the other."""

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
    found, 0 for none; owner: of each row of `Nearby` the sample nearest to its element, -1 where none lies near."""

    found: Bools
    weight: Floats
    chance: Floats
    contrast: Floats
    owner: Ints


def measure_support(samples: Samples, nearby: Nearby, p: SupportParameters) -> SampleSupport:
    """The support by the elements near samples; an element supports the predicted edges of one surface only, the
    nearest.

    Edges that share a surface, as both rims of a bore in a thin web do, may share their elements, and so may the edges
    of a part that shows little, as the head of a bolt: they are present or absent together."""
    n, away = len(samples.run), np.abs(nearby.offset)
    nearest, owner = _find_owners(samples, nearby, p)
    alien = ~share_surface(samples.kin[nearby.sample], samples.kin[owner[nearby.element]])
    claimed = alien & (nearest[nearby.element] < np.minimum(away - p.tie_px, p.tolerance_px))
    own = (away <= p.tolerance_px) & ~claimed
    found = np.zeros(n, bool)
    found[nearby.sample[own]] = True
    contrast = np.zeros(n)
    np.maximum.at(contrast, nearby.sample[own], np.abs(nearby.contrast[own]))

    # Chance: windows as wide as the tolerance, of what no predicted edge accounts for.
    free = nearest[nearby.element] > p.tolerance_px
    chance = np.zeros(n)
    for place in p.chance_px:
        seen = np.zeros(n, bool)
        seen[nearby.sample[free & (np.abs(nearby.offset - place) <= p.tolerance_px)]] = True
        chance += seen
    taken = np.where(nearest <= p.tolerance_px, owner, -1)[nearby.element]
    return SampleSupport(found, weigh_samples(samples, p), chance / len(p.chance_px), contrast, taken)


def _find_owners(samples: Samples, nearby: Nearby, p: SupportParameters) -> tuple[Floats, Ints]:
    """How far (e,) px each element lies from the nearest predicted edge, infinite beyond the tolerance, and the sample
    (e,) that stands for that edge there: each for its stretch, of which `Nearby` has but the elements at its middle."""
    from scipy.spatial import cKDTree

    across = np.stack([-samples.direction[:, 1], samples.direction[:, 0]], axis=1)
    place = samples.pixel[nearby.sample] + nearby.offset[:, None] * across[nearby.sample]
    tree, there = cKDTree(_by_camera(samples.pixel, samples.camera)), _by_camera(place, samples.camera[nearby.sample])
    reach = p.tolerance_px + float(samples.length_px.max(initial=0.0)) / 2
    near = np.asarray(tree.query(there, _NEIGHBOURS, distance_upper_bound=reach)[1], np.int64)
    rows, column = np.nonzero(near < len(samples.pixel))
    sample = near[rows, column]
    apart = place[rows] - samples.pixel[sample]
    off = np.abs(np.einsum("ni,ni->n", apart, across[sample]))
    along = np.abs(np.einsum("ni,ni->n", apart, samples.direction[sample]))
    alike = np.abs(np.einsum("ni,ni->n", samples.direction[nearby.sample[rows]], samples.direction[sample]))
    stands = (off <= p.tolerance_px) & (along <= samples.length_px[sample] / 2) & (alike > p.crowded_cosine)
    element, sample, off = nearby.element[rows[stands]], sample[stands], off[stands]
    count = int(nearby.element.max(initial=-1)) + 1
    nearest, owner = np.full(count, np.inf), np.zeros(count, np.int64)
    np.minimum.at(nearest, element, off)
    first = off <= nearest[element]
    owner[element[first]] = sample[first]
    return nearest, owner


def weigh_samples(samples: Samples, p: SupportParameters) -> Floats:
    """The px (n,) that samples count where they are found, as in `SampleSupport`: no picture is needed to say."""
    return np.where(are_crowded(samples, p) | ~samples.inside, 0.0, samples.length_px)


def share_surface(a: Ints, b: Ints) -> Bools:
    """Whether two samples (n, 2), (n, 2) lie on one surface."""
    return np.asarray(np.logical_or.reduce([(a[:, i] == b[:, j]) & (a[:, i] >= 0) for i in (0, 1) for j in (0, 1)]))


def _by_camera(pixel: Floats, camera: Ints) -> Floats:
    """Pixels (n, 3) that a third coordinate, beyond any picture's size, keeps apart by camera."""
    return np.column_stack([pixel, 1e6 * camera])


def are_crowded(samples: Samples, p: SupportParameters, *, by_own: bool = False) -> Bools:
    """Which samples lie too near to a nearly parallel predicted edge of other surfaces, or beside one of any, to be
    distinguished from it."""
    from scipy.spatial import cKDTree

    out = np.zeros(len(samples.run), bool)
    at = cKDTree(_by_camera(samples.pixel, samples.camera))
    i, j = at.query_pairs(p.crowded_px, output_type="ndarray").T
    other = samples.arc[i] != samples.arc[j]
    i, j = i[other], j[other]
    parallel = np.abs(np.einsum("ni,ni->n", samples.direction[i], samples.direction[j])) > p.crowded_cosine
    i, j = i[parallel], j[parallel]
    if by_own:  # not one that goes on where it ends, or lies in the same place
        (x, y), (along_x, along_y) = (samples.pixel[j] - samples.pixel[i]).T, samples.direction[i].T
        crowd = np.abs(x * along_y - y * along_x) > p.tie_px
    else:
        crowd = ~share_surface(samples.kin[i], samples.kin[j])
    out[i[crowd]] = out[j[crowd]] = True
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
    two surfaces face the camera; inside: whether it lies where edges can be found, off the picture's border and glare.
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
    can_show: Sequence[Callable[[Floats], Bools]],
    world_from_rig: Floats,
    views: Mapping[str, ViewArcs],
    p: SampleParameters,
) -> Samples:
    """The samples of what cameras see at a pose; can_show: whether pixels can show edges, by camera of the rig."""
    pieces: list[Samples] = []
    runs = 0
    for number, name in enumerate(rig.cameras):
        piece = _of_view(stored, rig, number, world_from_rig, views[name])
        kept, run = np.unique(piece.run, return_inverse=True)
        pieces.append(replace(piece, run=runs + run.ravel(), inside=can_show[number](piece.pixel)))
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


def _of_view(stored: StoredScene, rig: Rig, number: int, world_from_rig: Floats, view: ViewArcs) -> Samples:
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
        inside=np.ones(len(seen.arc), bool),
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
    camera's response shift taken off; contrast: grey, above zero where the bright side lies along the normal."""

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
        pieces.append((sample, elements + element, offset, polarity * contrast))
        elements += len(edges.position)
    columns = [np.concatenate(column) for column in zip(*pieces, strict=True)]
    first = np.concatenate([[0], np.cumsum(np.concatenate(counts))])
    return Nearby(first, *columns)
