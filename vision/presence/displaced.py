"""Displaced and missing parts: pieces moved as one, or what they cover seen in their place; and sizes of features."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from relmodel.arrays import Bools, Floats, Ints, Rows, count_from, rank_in_groups, sum_by_group
from relmodel.geometry.transforms import rotation_matrix
from vision.account.runs import EdgeAccount, EdgeRuns, part_at_turns, sum_in_one_light, weigh_runs
from vision.account.samples import (
    Samples,
    Sides,
    collect_samples,
    find_nearby,
    look_at_sides,
    measure_support,
    weigh_samples,
)
from vision.cameras.cameras import Rig
from vision.localisation.measurements import EdgeIndex
from vision.localisation.views import find_view_arcs
from vision.localisation.visibility import SurfaceMap
from vision.presence.items import NONE, Items
from vision.presence.presence_parameters import PartParameters, PresenceParameters, StateParameters
from vision.presence.surfaces import BodyElements, Displacement, SceneSurfaces, fit
from vision.scene import Scene, StoredScene


def find_pieces(paths: Sequence[str]) -> Ints:
    """The piece (o,) that each occurrence belongs to: the parts of an assembly within an object are one piece."""
    above = [path.rpartition("/")[0] for path in paths]
    pieces = [group if "/" in group else path for path, group in zip(paths, above, strict=True)]
    return np.asarray(np.unique(pieces, return_inverse=True)[1].ravel(), np.int64)


def find_loose_pieces(stored: StoredScene, samples: Samples, p: PresenceParameters) -> tuple[Ints, Ints]:
    """The piece of each occurrence, and which pieces may be displaced or missing: of inspected objects, they show
    enough edges, and not so many that they determine the pose."""
    scene, piece_of = stored.scene, find_pieces(stored.paths)
    of_sample = piece_of[scene.surface_occurrence[samples.surface[:, 0]]]
    shown = np.bincount(of_sample, weigh_samples(samples, p.account.support), len(piece_of))
    inspected = np.isin(np.arange(len(piece_of)), piece_of[scene.inspected])
    few = shown <= p.parts.most_share * shown.sum()
    return piece_of, np.flatnonzero(inspected & few & (shown >= p.parts.least_px))


def find_axes(scene: Scene, occurrences: Ints, ahead: Floats) -> Floats:
    """Unit vectors (3, 3): two along the plane that most of the surface of parts is parallel to, and its normal, which
    points to the side that the direction `ahead` (3,) does."""
    mine = np.isin(scene.surface_occurrence[scene.triangle_surface], occurrences)
    corner = scene.vertices[scene.triangles[mine]]
    way = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    area = np.linalg.norm(way, axis=1)
    normal = way / np.maximum(area, 1e-12)[:, None]
    # Both sides of a plate face the same way; rounding makes classes of normals.
    largest = normal[np.arange(len(normal)), np.abs(normal).argmax(axis=1)]
    upright = np.where(largest < 0, -1.0, 1.0)[:, None] * normal
    _, kind = np.unique(np.rint(upright * 50), axis=0, return_inverse=True)
    most = upright[kind.ravel() == np.argmax(np.bincount(kind.ravel(), area))][0]
    most = most if most @ ahead >= 0 else -most
    first = np.cross(most, np.eye(3)[np.abs(most).argmin()])
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(most, first), most])


@dataclass(frozen=True)
class CameraPoses:
    """Cameras' poses (c, 4, 4) in the world and matrices (c, 3, 3)."""

    pose: Floats
    matrix: Floats

    def project(self, camera: Ints, point: Floats, ways: Floats) -> tuple[Floats, Floats]:
        """Pixels (n, 2) of points (n, 3), and how they move (n, k, 2), px a mm, by motions (n, k, 3) of these."""
        pixel, flow = np.empty((len(camera), 2)), np.empty((*ways.shape[:2], 2))
        for number, (pose, matrix) in enumerate(zip(self.pose, self.matrix, strict=True)):
            mine = camera == number
            seen, there = (point[mine] - pose[:3, 3]) @ pose[:3, :3], ways[mine] @ pose[:3, :3]
            flat = seen[:, :2] / seen[:, 2:]
            pixel[mine] = flat @ matrix[:2, :2].T + matrix[:2, 2]
            flow[mine] = (there[..., :2] - there[..., 2:] * flat[:, None]) / seen[:, 2, None, None] @ matrix[:2, :2].T
        return pixel, flow


@dataclass(frozen=True)
class Aspects(Rows):
    """How pieces are looked for, as columns: piece; angle, rad, that it is turned about the last of its axes (a, 3, 3)
    through its centre (a, 3)."""

    piece: Ints
    angle: Floats
    centre: Floats
    axes: Floats


@dataclass(frozen=True)
class PieceEdges(Rows):
    """What cameras should see of aspects, as columns: camera; aspect; edge, of one camera: it shows or hides by itself;
    point (n, 3) in the world; direction (n, 2) in the picture; length, px; chance, shows: as `EdgeRuns` has them."""

    camera: Ints
    aspect: Ints
    edge: Ints
    point: Floats
    direction: Floats
    length: Floats
    chance: Floats
    shows: Floats

    def thin(self, enough: int) -> PieceEdges:
        """Of many samples of an aspect in a camera every so many, which then stand for the others."""
        group = self.camera * (self.aspect.max(initial=0) + 1) + self.aspect
        step = 1 + np.bincount(group) // enough
        rows = np.flatnonzero(rank_in_groups(group, np.zeros(len(group))) % step[group] == 0)
        some = self.take(rows)
        return replace(some, length=some.length * step[group[rows]])


def list_pieces(
    scene: Scene, piece_of: Ints, pieces: Ints, samples: Samples, weight: Floats, runs: EdgeRuns, eyes: CameraPoses
) -> tuple[PieceEdges, Aspects]:
    """What cameras see of pieces where the model has them, an aspect each."""
    of_sample = piece_of[scene.surface_occurrence[samples.surface[:, 0]]]
    rows = np.flatnonzero(np.isin(of_sample, pieces) & (weight > 0))
    aspect, run = np.searchsorted(pieces, of_sample[rows]), samples.run[rows]
    edges = PieceEdges(
        samples.camera[rows], aspect, run, samples.point[rows], samples.direction[rows], weight[rows],
        runs.chance[run], runs.shows[run],
    )  # fmt: skip
    centre = sum_by_group(aspect, edges.point, len(pieces), edges.length)
    centre /= np.bincount(aspect, edges.length, len(pieces))[:, None]
    ahead = eyes.pose[:, :3, 3].mean(axis=0) - centre
    axes = [find_axes(scene, np.flatnonzero(piece_of == k), way) for k, way in zip(pieces.tolist(), ahead, strict=True)]
    return edges, Aspects(pieces, np.zeros(len(pieces)), centre, np.reshape(axes, (-1, 3, 3)))


def add_turned(
    scene: Scene, piece_of: Ints, lost: Ints, edges: PieceEdges, aspects: Aspects, eyes: CameraPoses, p: PartParameters
) -> tuple[PieceEdges, Aspects]:
    """With the edges of lost pieces at every turn about their middle: those of faces toward the cameras."""
    angle = np.radians(np.arange(p.step_degrees, 360.0, p.step_degrees))
    pieces, more, turns = [edges], [aspects], np.zeros(len(angle), np.int64)
    for number in np.flatnonzero(np.isin(aspects.piece, lost)).tolist():
        members = np.flatnonzero(piece_of == aspects.piece[number])
        mine = np.isin(scene.arc_occurrence[scene.sample_arc], members) & (scene.sample_cosine < p.max_cosine)
        if not mine.any():
            continue
        place = scene.sample_point[mine]
        centre, axes = 0.5 * (place.min(axis=0) + place.max(axis=0)), aspects.axes[number]
        ways = np.stack([scene.sample_tangent[mine], scene.sample_normal_a[mine], scene.sample_normal_b[mine]], axis=1)
        back = np.swapaxes(rotation_matrix(angle[:, None] * axes[2]), 1, 2)
        point, way = centre + (place - centre) @ back, ways @ back[:, None]
        own, begins = edges.aspect == number, sum(len(a.piece) for a in more)
        usual = [np.average(v[own], weights=edges.length[own]) for v in (edges.chance, edges.shows)]
        for camera, pose in enumerate(eyes.pose):
            front = np.einsum("tnki,tni->tnk", way[:, :, 1:], pose[:3, 3] - point) > 0
            turn, sample = np.nonzero(front.any(axis=2))
            same, at = np.full(len(turn), camera), (turn, sample)
            direction = eyes.project(same, point[at], way[at][:, :1])[1][:, 0]
            stretch = np.maximum(np.linalg.norm(direction, axis=1), 1e-9)
            pieces.append(
                PieceEdges(
                    same, begins + turn, scene.sample_arc[mine][sample] * len(eyes.pose) + camera, point[at],
                    direction / stretch[:, None], scene.sample_length[mine][sample] * stretch,
                    *np.repeat(usual, len(turn)).reshape(2, -1),
                )
            )  # fmt: skip
        more.append(replace(aspects.take(turns + number), angle=angle, centre=np.tile(centre, (len(angle), 1))))
    return PieceEdges.stack(pieces), Aspects.stack(more)


# Sizes of features by their surfaces' displacements: diameters, thicknesses, and where single surfaces lie.

DISPLACED = ("displacement", "dx", "dy", "dz", "turn")  # of parts that lie elsewhere


@dataclass(frozen=True)
class Measures(Rows):
    """Measured sizes of items, as columns: item; other: the item to which a distance is measured, else NONE; what:
    diameter, thickness, width (between walls of a pocket), offset (how far outward a surface lies), shift (how far
    aside the middle of a bore lies), distance (from it to a neighbour), of parts that lie elsewhere displacement, dx,
    dy, dz (mm along the world's axes) and turn (degrees); nominal, value, sigma in `unit_of(what)`; changed: surely."""

    item: Ints
    other: Ints
    what: list[str]
    nominal: Floats
    value: Floats
    sigma: Floats
    changed: Bools


def unit_of(what: str) -> str:
    """The unit of a measured size."""
    return "deg" if what == "turn" else "mm"


def find_moved(items: Items, surfaces: SceneSurfaces, distinct_px: Floats, least_share: float) -> Bools:
    """Which rows of `items.member` are moved faces that count for their feature or surface.  distinct_px (n,): of
    items; a face with less than a share of that does not count, such as one face of a body."""
    much = surfaces.distinct_px[items.surface] >= least_share * distinct_px[items.member]
    return np.asarray(surfaces.moved[items.surface] & much & (np.array(items.level)[items.member] != "part"))


def measure_items(items: Items, radius: Floats, surfaces: SceneSurfaces, moved: Bools, p: StateParameters) -> Measures:
    """All sizes that the displacements of surfaces give, and which surely differ: a feature or surface has changed
    where one of its sizes has.  moved: from `find_moved`."""
    level, kind = np.array(items.level)[items.member], np.array(items.kind)
    surface, opposed, others = items.surface, surfaces.opposed, np.arange(len(items))
    mm, sigma, shift_sigma = surfaces.mm[surface], surfaces.sigma[surface], surfaces.shift_sigma[surface]
    aside = np.linalg.norm(surfaces.shift[surface], axis=1)
    measured = np.isfinite(mm)
    round_ = measured & np.isfinite(shift_sigma) & np.isfinite(radius[surface]) & (level == "feature")
    single = measured & ~round_ & (level != "part")
    diameter, grows = 2 * radius[surface], np.where(surfaces.inward[surface], -2.0, 2.0)
    zero = np.zeros(len(surface))
    # Where one side of a rim is in place, an edge beside it, as of a shadow, was taken for the other.
    resized = round_ & (np.abs(mm) - aside > np.hypot(sigma, shift_sigma))
    # Whether a single face lies elsewhere, as a wall of a pocket, is known from where it was sought, and a web's other
    # side is hardly ever seen: widths and webs are reported, and judged where a face of theirs has moved.
    has_moved = np.zeros(len(items), bool)
    has_moved[items.member[moved]] = True
    thickness, thickness_sigma = _thicknesses(items, surfaces, measured)
    width = opposed.sizes(surfaces.mm)
    width_sigma = np.hypot(surfaces.sigma[opposed.one], surfaces.sigma[opposed.other])
    wall_moved = has_moved[opposed.item] & (surfaces.moved[opposed.one] | surfaces.moved[opposed.other])
    rows = [
        _select("diameter", round_, items.member, diameter, diameter + grows * mm, 2 * sigma, resized),
        _select("shift", round_, items.member, zero, aside, shift_sigma, surfaces.log_odds[surface] > 0),
        _select("offset", single, items.member, zero, mm, sigma, moved),
        _select(
            "thickness", np.isfinite(thickness), others, items.thickness, thickness, thickness_sigma,
            (kind == "rib") | has_moved,
        ),
        _select(
            "width", np.isfinite(width) & (opposed.sign < 0), opposed.item, opposed.mm, width, width_sigma, wall_moved
        ),
    ]  # fmt: skip
    every = Measures.stack(rows)
    what, off = np.array(every.what, "U9"), np.abs(every.value - every.nominal)
    least = np.where(what == "thickness", p.changed_wall_mm, p.changed_mm)
    sigmas = np.where(what == "diameter", p.changed_diameter_sigma, p.changed_sigma)
    surely = (off > sigmas * every.sigma) & (off > least)
    surely |= (what == "diameter") & (off > p.changed_sigma * every.sigma)
    changed = every.changed & ((what == "offset") | surely)
    # A size that no part can have is dropped.
    most = np.full(len(items), np.inf)
    np.minimum.at(most, opposed.item, opposed.most)
    kept = np.isin(what, ("offset", "shift")) | (every.value > 0) & (every.value <= most[every.item])
    return replace(every, changed=changed).take(kept)


def _select(what: str, rows: Bools, item: Ints, nominal: Floats, value: Floats, sigma: Floats, told: Bools) -> Measures:
    """Some rows of sizes of one kind; `changed` is whether they may count as such."""
    n = int(rows.sum())
    return Measures(item[rows], np.full(n, NONE), [what] * n, nominal[rows], value[rows], sigma[rows], told[rows])


def _thicknesses(items: Items, surfaces: SceneSurfaces, measured: Bools) -> tuple[Floats, Floats]:
    """Of ribs and webs, mm and sigma (n,): the nominal and how far both sides lie outward; nan of other items, and of
    those of which one side is not measured."""
    flat = np.linalg.norm(surfaces.normal, axis=1) > 0.99
    rows = np.flatnonzero(measured & np.isfinite(items.thickness[items.member]) & flat[items.surface])
    item, normal = items.member[rows], surfaces.normal[items.surface[rows]]
    # The first surface of an item says which side is which.
    first = rows[np.diff(item, prepend=-1) != 0]
    reference = np.zeros((len(items), 3))
    reference[items.member[first]] = surfaces.normal[items.surface[first]]
    facing = np.einsum("ni,ni->n", normal, reference[item])
    value, variance = items.thickness.copy(), np.zeros(len(items))
    for side in (facing > 0.98, facing < -0.98):
        weight = np.where(side, surfaces.sigma[items.surface[rows]] ** -2.0, 0.0)
        total = np.bincount(item, weight, len(items)).astype(float)
        total[total == 0] = np.nan
        value += np.bincount(item, weight * surfaces.mm[items.surface[rows]], len(items)) / total
        variance += 1 / total
    return value, np.sqrt(variance)


# Displaced parts: by how much in their plane, out of it, and turned about its normal.
#
# A part, or an assembly of parts, is moved as one piece from places around its own until its predicted edges lie on
# those of the pictures. One whose edges are hardly found in place is looked for at every turn as well. The pose stays
# fixed. A part that makes up much of the view has determined the pose and is left out.

ENOUGH = 150  # samples of a piece in a camera: more samples add no information


@dataclass(frozen=True)
class Displacements:
    """Where the edges of parts were found best, of those parts that may lie elsewhere, as columns: occurrence: the
    scene's, ascending; shift (n, 3), covariance (n, 3, 3): mm in the world, from where the model has it; turn,
    turn_sigma: rad about the normal of the part's plane; log_odds: of lying there against lying in place; far, turned:
    whether it surely lies elsewhere, or turned."""

    occurrence: Ints
    shift: Floats
    covariance: Floats
    turn: Floats
    turn_sigma: Floats
    log_odds: Floats
    far: Bools
    turned: Bools

    @property
    def shift_sigma(self) -> Floats:
        return np.asarray(np.sqrt(np.diagonal(self.covariance, axis1=1, axis2=2)))

    @property
    def distance(self) -> Floats:
        """How far parts lie from their places, mm."""
        return np.asarray(np.linalg.norm(self.shift, axis=1))

    @property
    def sigma(self) -> Floats:
        """The standard deviation of that."""
        way = self.shift / np.maximum(self.distance, 1e-9)[:, None]
        return np.asarray(np.sqrt(np.einsum("ni,nij,nj->n", way, self.covariance, way)))


def measure_displacements(
    stored: StoredScene,
    rig: Rig,
    world_from_rig: Floats,
    indexes: list[EdgeIndex],
    response_px: Floats,
    account: EdgeAccount,
    p: PresenceParameters,
) -> Displacements:
    """Places of the parts that show enough edges, and not so many that they determine the pose."""
    scene, samples, support, q = stored.scene, account.samples, account.support, p.parts
    poses = [world_from_rig @ rig.rig_from_camera[name] for name in rig.cameras]
    eyes = CameraPoses(np.stack(poses), np.stack([camera.matrix for camera in rig.cameras.values()]))
    piece_of, tried = find_loose_pieces(stored, samples, p)
    of_sample = piece_of[scene.surface_occurrence[samples.surface[:, 0]]]
    shown, found = (np.bincount(of_sample, support.weight * v, len(piece_of)) for v in (1.0, support.found))
    lost = tried[((shown >= q.turned_px) & (found <= q.turned_share * shown))[tried]]
    edges, aspects = list_pieces(scene, piece_of, tried, samples, support.weight, account.runs, eyes)
    edges, aspects = add_turned(scene, piece_of, lost, edges, aspects, eyes, q)
    taken = np.full(sum(len(index.edges.position) for index in indexes), -1)
    owned = np.flatnonzero(support.owner >= 0)
    taken[account.nearby.element[owned]] = of_sample[support.owner[owned]]
    places = _seek_places(_Pictures(eyes, indexes, response_px, taken, p), edges, aspects, tried)
    return _choose(places, aspects, piece_of, tried, p)


@dataclass(frozen=True)
class _Places:
    """Where pieces may lie, as columns: aspect: of the piece; there: place; gain (k, c): log odds, by camera, of there
    against in place; log_odds: their sum, less what all the places tried cost, -inf in place."""

    aspect: Ints
    there: Displacement
    gain: Floats
    log_odds: Floats


def _seek_places(pictures: _Pictures, edges: PieceEdges, aspects: Aspects, tried: Ints) -> _Places:
    """Where least squares puts pieces from in place, and from the best of the starts around it, as the model has them
    and turned; the first aspects are those of the pieces tried, as the model has them."""
    q = pictures.p.parts
    turned = np.arange(len(aspects.piece)) >= len(tried)
    side = np.arange(-q.reach_mm, q.reach_mm + 1e-9, q.step_mm)
    places = np.pad(np.stack(np.meshgrid(side, side), axis=-1).reshape(-1, 2), [(0, 0), (0, 2)])
    aspect, start = np.repeat(np.arange(len(turned)), len(places)), np.tile(places, (len(turned), 1))
    score = _Bodies(pictures, edges.thin(q.coarse), aspects, aspect).score(start)
    best = np.flatnonzero(rank_in_groups(2 * aspects.piece[aspect] + turned[aspect], score) < q.best)
    aspect = np.append(np.arange(len(tried)), aspect[best])
    bodies = _Bodies(pictures, edges.thin(ENOUGH), aspects, aspect)
    there = bodies.settle(np.append(np.zeros((len(tried), 4)), start[best], axis=0))
    in_place = np.arange(len(aspect)) < len(tried)
    odds = bodies.weigh(np.where(in_place[:, None], 0.0, there.x))
    gain = odds - odds[np.searchsorted(tried, aspects.piece[aspect])]
    cost = np.log(len(places)) + turned * (q.least_log_odds + np.log(360 / q.step_degrees))
    return _Places(aspect, there, gain, np.where(in_place, -np.inf, gain.sum(axis=1) - cost[aspect]))


def _choose(it: _Places, aspects: Aspects, piece_of: Ints, tried: Ints, p: PresenceParameters) -> Displacements:
    """The likeliest place of each piece, for all of its occurrences."""
    number = np.searchsorted(tried, aspects.piece[it.aspect])
    occurrence = np.flatnonzero(np.isin(piece_of, tried))
    first = np.flatnonzero(rank_in_groups(number, it.log_odds) == 0)
    row = first[np.argsort(number[first])][np.searchsorted(tried, piece_of[occurrence])]
    aspect, x, covariance, log_odds = it.aspect[row], it.there.x[row], it.there.covariance[row], it.log_odds[row]
    known = (log_odds >= p.parts.least_log_odds) & (it.gain[row].min(axis=1) >= 0)
    axes, turned = aspects.axes[aspect], aspect >= len(tried)
    turn = np.mod(x[:, 3] + aspects.angle[aspect] + np.pi, 2 * np.pi) - np.pi
    out = Displacements(
        occurrence, np.einsum("ni,nij->nj", x[:, :3], axes), np.swapaxes(axes, 1, 2) @ covariance[:, :3, :3] @ axes,
        turn, np.sqrt(covariance[:, 3, 3]), log_odds, known, known & turned,
    )  # fmt: skip
    least = np.maximum(p.displacement.least_mm, p.displacement.sure_sigma * out.sigma)
    return replace(out, far=known & (out.distance > least))


@dataclass(frozen=True)
class _Pictures:
    """What cameras saw: their elements, and the piece whose predicted edge takes each (e,), -1 for none."""

    eyes: CameraPoses
    indexes: list[EdgeIndex]
    response_px: Floats
    taken: Ints
    p: PresenceParameters


class _Bodies:
    """Bodies, each an aspect (m,) of a piece, whose edges are looked for in the pictures where the bodies are tried."""

    def __init__(self, pictures: _Pictures, edges: PieceEdges, aspects: Aspects, aspect: Ints) -> None:
        self.pictures, self.aspects, self.count = pictures, aspects.take(aspect), len(aspect)
        order = np.argsort(edges.aspect, kind="stable")
        first, last = (np.searchsorted(edges.aspect[order], aspect, side=end) for end in ("left", "right"))
        body, row = count_from(first, last - first)
        row = order[row]
        by_camera = np.argsort(edges.camera[row], kind="stable")
        self.body, self.edges = body[by_camera], edges.take(row[by_camera])
        self.each = np.arange(len(body))
        self.zero, self.none = np.zeros(len(body)), np.zeros(len(body), np.int64)

    def settle(self, start: Floats) -> Displacement:
        """Where the elements put the bodies from starts (m, 4)."""

        def look(x: Floats, reach: float) -> tuple[Floats, Floats]:
            beside, slope = self._look(x, reach)
            return slope, beside.find_nearest(self.each, self.none, self.zero, reach)

        p = self.pictures.p
        sigma, counts = np.tile(p.parts.sigma, (self.count, 1)), self.edges.length / p.account.runs.stretch_px
        return fit(look, self.body, counts, start, sigma, p.displacement)

    def score(self, x: Floats) -> Floats:
        """How near elements lie to the edges of bodies at x (m, 4), 0 to 1 in the mean."""
        reach, length = self.pictures.p.displacement.reach_px[0], self.edges.length
        away = self._look(x, reach)[0].find_nearest(self.each, self.none, self.zero, reach)
        near = np.exp(-0.5 * (np.where(np.isfinite(away), away, np.inf) / (0.4 * reach)) ** 2)
        total = np.maximum(np.bincount(self.body, length, self.count), 1e-9)
        return np.asarray(np.bincount(self.body, length * near, self.count) / total)

    def weigh(self, x: Floats) -> Floats:
        """Log odds (m, c), by camera, of bodies being at x (m, 4) against not there."""
        p, cameras, edges = self.pictures.p, len(self.pictures.indexes), self.edges
        beside, _ = self._look(x, 2 * max(p.displacement.hidden_px, *p.displacement.tolerance_px))
        key = self.body * (edges.edge.max(initial=0) + 1) + edges.edge
        _, first, edge = np.unique(key, return_index=True, return_inverse=True)
        odds, _ = beside.weigh(
            (self.each, self.none, edge.ravel()), self.zero, self.zero, edges.chance[first], edges.shows[first],
            np.zeros(1), np.inf, p,
        )  # fmt: skip
        at = self.body[first] * cameras + edges.camera[first]
        return np.bincount(at, odds[:, 0], self.count * cameras).reshape(self.count, cameras).astype(float)

    def _look(self, x: Floats, reach_px: float) -> tuple[BodyElements, Floats]:
        """The elements beside the edges of bodies at x (m, 4), and how far the edges move by it (n, 4), px a unit."""
        it, aspects, edges, body = self.pictures, self.aspects, self.edges, self.body
        turn = rotation_matrix(x[:, 3:] * aspects.axes[:, 2])
        arm = np.einsum("nij,nj->ni", turn[body], edges.point - aspects.centre[body])
        point = (aspects.centre + np.einsum("mi,mij->mj", x[:, :3], aspects.axes))[body] + arm
        ways = np.concatenate([aspects.axes[body], np.cross(aspects.axes[body, 2], arm)[:, None]], axis=1)
        pixel, flow = it.eyes.project(edges.camera, point, ways)
        across = np.stack([-edges.direction[:, 1], edges.direction[:, 0]], axis=1)
        samples = replace(it.p.account.samples, reach_px=reach_px)
        near = find_nearby(edges.camera, pixel, edges.direction, it.indexes, it.response_px, samples)
        taken = it.taken[near.element]
        free = (taken < 0) | (taken == aspects.piece[body[near.sample]])
        beside = BodyElements(near.first, near.offset, np.repeat(free[:, None], 2, axis=1), edges.length)
        return beside, np.einsum("nki,ni->nk", flow, across)


def report_displacements(items: Items, displacements: Displacements, p: StateParameters) -> Measures:
    """Sizes of the parts that lie elsewhere: how far, that along the world's axes, and how they are turned."""
    it, part = displacements, np.array([level == "part" for level in items.level])
    rows = np.flatnonzero(part & np.isin(items.occurrence, it.occurrence[it.far | it.turned]))
    at = np.searchsorted(it.occurrence, items.occurrence[rows])
    value = np.stack([it.distance, *it.shift.T, np.degrees(it.turn)])[:, at]
    sigma = np.stack([it.sigma, *it.shift_sigma.T, np.degrees(it.turn_sigma)])[:, at]
    changed = np.stack([it.far, it.far, it.far, it.far, it.turned])[:, at]
    changed[1:4] &= np.abs(value[1:4]) > np.maximum(p.changed_mm, p.changed_sigma * sigma[1:4])
    item, what = np.tile(rows, len(DISPLACED)), np.repeat(DISPLACED, len(rows)).tolist()
    others, zero = np.full(value.size, NONE), np.zeros(value.size)
    return Measures(item, others, what, zero, value.ravel(), sigma.ravel(), changed.ravel())


# Missing parts: whether the edges that a part covers show where its own should.
#
# A bolt that is missing leaves its hole, and the rim of that hole is found where a smaller bolt would be. So what would
# show without a piece is predicted as well, and its own edges and those that it covers, told from each other, are
# weighed in one light: one of both should be there, and not the other.


@dataclass(frozen=True)
class Uncovered:
    """Of the scene's occurrences (o,): log odds of the edges that their piece covers, each there against not there, and
    of the piece's own; nan where it covers none."""

    beneath: Floats
    own: Floats

    @property
    def log_odds(self) -> Floats:
        """Of the piece not being there against its being there."""
        return np.asarray(self.beneath - self.own)


def look_beneath(
    stored: StoredScene,
    rig: Rig,
    world_from_rig: Floats,
    indexes: list[EdgeIndex],
    response_px: Floats,
    account: EdgeAccount,
    maps: Sequence[SurfaceMap],
    p: PresenceParameters,
) -> Uncovered:
    """What shows where those loose pieces of a scene should be whose edges are not surely found, all of them left out
    together; account, maps: of what is seen with them."""
    samples, runs = account.samples, account.runs
    piece_of, loose = find_loose_pieces(stored, samples, p)
    occurrence_at, pieces, cameras = np.append(stored.scene.surface_occurrence, -1), len(piece_of), len(rig.cameras)

    def weigh(piece: Ints, it: EdgeRuns) -> Floats:
        in_light = sum_in_one_light(piece * cameras + it.camera, it.in_light, pieces * cameras)
        return np.asarray(in_light.reshape(pieces, cameras).sum(axis=1))

    loose = loose[weigh(piece_of[occurrence_at[runs.surface[:, 0]]], runs)[loose] < p.parts.sure_log_odds]
    nothing = Uncovered(*np.full((2, len(piece_of)), np.nan))
    if not len(loose):
        return nothing
    bare = replace(stored, scene=stored.scene.without(np.isin(piece_of, loose)))
    can_show = [index.edges.can_show for index in indexes]
    arcs = {
        name: find_view_arcs(bare.scene, camera, world_from_rig @ rig.rig_from_camera[name])
        for name, camera in rig.cameras.items()
    }
    beneath = collect_samples(bare, rig, can_show, world_from_rig, arcs, p.account.samples)
    covering = np.full(len(beneath.run), -1)
    for number, shown in enumerate(maps):
        rows = np.flatnonzero(beneath.camera == number)
        surface = shown.value_along(shown.surface, shown.camera.normalise(beneath.pixel[rows]), -1)
        covering[rows] = np.append(piece_of, -1)[occurrence_at[surface]]
    rows = np.flatnonzero(np.isin(covering, loose))
    beneath, covering = beneath.take(rows), covering[rows]
    if not len(rows):
        return nothing

    # One after the other, camera by camera; a run beneath two pieces is one of each.
    n = len(samples.run)
    both = Samples.stack([samples, replace(beneath, run=samples.run_count + beneath.run * pieces + covering)])
    order = np.lexsort((both.run, both.camera))
    both = both.take(order)
    both = replace(both, run=np.cumsum(np.diff(both.run, prepend=-1) != 0) - 1)
    at = np.argsort(order)
    of_bare = look_at_sides(bare.scene, rig, world_from_rig, beneath, p.account.sides)
    around = Sides.stack([account.sides, replace(of_bare, sample=n + of_bare.sample)])
    around = replace(around, sample=at[around.sample])
    nearby = find_nearby(both.camera, both.pixel, both.direction, indexes, response_px, p.account.samples)
    parted = part_at_turns(both, p.account.runs)
    found = weigh_runs(parted, measure_support(both, nearby, p.account.support), around, p.account.runs)

    head = order[np.flatnonzero(np.diff(parted.run, prepend=-1) != 0)]
    own = piece_of[stored.scene.surface_occurrence[samples.surface[:, 0]]]
    piece, covers = np.append(own, covering)[head], np.isin(piece_of, covering)
    odds = (weigh(piece[rows], found.take(rows))[piece_of] for rows in (head >= n, head < n))
    return Uncovered(*(np.where(covers, values, np.nan) for values in odds))
