"""The state of each part, feature and surface at the pose found, and what it rests on."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from relmodel.arrays import Bools, Floats, Ints, count_from
from vision.account.account_parameters import RunParameters
from vision.account.runs import EdgeAccount, EdgeRuns, sum_in_one_light, weigh_absence
from vision.localisation.localise import Localisation
from vision.localisation.measurements import RESPONSE, split_response
from vision.localisation.views import ModelView, Observation
from vision.localisation.visibility import PartsInView
from vision.presence.displaced import (
    DISPLACED,
    Displacements,
    Measures,
    Uncovered,
    find_moved,
    look_beneath,
    measure_displacements,
    measure_items,
    report_displacements,
)
from vision.presence.items import (
    BORES,
    WITHIN,
    Appearance,
    Items,
    UnexplainedElements,
    find_unexplained,
    list_items,
    look_at_features,
)
from vision.presence.presence_parameters import DistanceParameters, PresenceParameters, StateParameters
from vision.presence.surfaces import (
    BodyElements,
    EdgePredictions,
    SceneSurfaces,
    assess_surfaces,
    find_moving_surfaces,
    find_tangent,
    find_usable,
)
from vision.scene import Scene, StoredScene

# Where a bore lies aside from its place is measured in the plane across its axis; the pose's error is common to two
# bores, so that their distance is known better than the place of either.


def measure_distances(
    items: Items, scene: Scene, radius: Floats, surfaces: SceneSurfaces, p: DistanceParameters
) -> Measures:
    """Of each measured hole, boss or pin the distances to the nearest of the same part with a parallel axis whose
    middle is about as high.  radius (s,): of the scene's cylinders, nan for others."""
    item, surface = _choose_bores(items, radius, surfaces)
    centre, axis = _find_axes(scene, surface)
    apart = centre[None] - centre[:, None]
    along = np.einsum("abi,ai->ab", apart, axis)
    alike = np.abs(axis @ axis.T) > p.min_cosine
    alike &= items.occurrence[item][:, None] == items.occurrence[item]
    alike &= np.abs(along) < p.same_level_mm
    across = apart - along[..., None] * axis[:, None]
    nominal = np.linalg.norm(across, axis=2)
    near = np.where(alike & (nominal > p.least_mm), nominal, np.inf)
    nearest = np.argsort(near, axis=1, kind="stable")[:, : p.neighbours]
    a = np.repeat(np.arange(len(item)), nearest.shape[1])
    b = nearest.ravel()
    there = np.isfinite(near[a, b])
    pairs = np.unique(np.sort(np.stack([a[there], b[there]], axis=1), axis=1), axis=0)
    a, b = pairs.T if len(pairs) else np.zeros((2, 0), np.int64)

    shift = surfaces.shift[surface]
    moved = across[a, b] + shift[b] - shift[a]
    moved -= np.einsum("ni,ni->n", moved, axis[a])[:, None] * axis[a]
    value = np.linalg.norm(moved, axis=1)
    sigma = np.hypot(surfaces.shift_sigma[surface[a]], surfaces.shift_sigma[surface[b]])
    off = np.abs(value - nominal[a, b])
    changed = (off > p.changed_sigma * sigma) & (off > p.changed_mm)
    return Measures(item[a], item[b], ["distance"] * len(a), nominal[a, b], value, sigma, changed)


def _choose_bores(items: Items, radius: Floats, surfaces: SceneSurfaces) -> tuple[Ints, Ints]:
    """Features with a cylinder that was measured all around, and of each the one that was measured best."""
    feature = np.array([level == "feature" for level in items.level])
    measured = np.isfinite(radius) & np.isfinite(surfaces.shift_sigma) & np.isfinite(surfaces.mm)
    rows = np.flatnonzero(measured[items.surface] & feature[items.member] & items.inset[items.surface])
    order = rows[np.lexsort((surfaces.shift_sigma[items.surface[rows]], items.member[rows]))]
    first = order[np.diff(items.member[order], prepend=-1) != 0]
    return items.member[first], items.surface[first]


def _find_axes(scene: Scene, surface: Ints) -> tuple[Floats, Floats]:
    """The middle (n, 3) and direction (n, 3) of cylinders, by their meshes' vertices: their normals meet the axis."""
    centre, axis = np.zeros((2, len(surface), 3))
    for row, one in enumerate(surface.tolist()):
        vertex = np.unique(scene.triangles[scene.triangle_surface == one])
        point, normal = scene.vertices[vertex], scene.vertex_normals[vertex]
        axis[row] = np.linalg.eigh(normal.T @ normal)[1][:, 0]
        # The point of the plane across the axis that is nearest to all lines along the normals.
        nearby = np.eye(3) - normal[:, :, None] * normal[:, None, :]
        level = np.outer(axis[row], axis[row])
        to_axis = nearby - level
        total = to_axis.sum(axis=0) + len(vertex) * level
        middle = 0.5 * (point @ axis[row]).min() + 0.5 * (point @ axis[row]).max()
        centre[row] = np.linalg.solve(total, np.einsum("nij,nj->i", to_axis, point) + len(vertex) * middle * axis[row])
    return centre, axis


# States in our words and QIF's.

STATES = ("confirmed", "contradicted", "changed", "not_confirmed", "undecidable")
CONFIRMED, CONTRADICTED, CHANGED, NOT_CONFIRMED, UNDECIDABLE = range(5)
# Log odds of each that the object is another one: shares of features at right poses, and of objects that look alike.
OF_ANOTHER = np.array([-0.4, 2.0, 2.0, 1.5, 0.0])
QIF = ("PASS", "FAIL", "FAIL", "INDETERMINATE", "NOT_ANALYZED")
REASONS = (
    "its edges are found",
    "its edges are not found, where they would show",
    "its edges are found displaced",
    "its size differs from the model's",
    "no sharp edge of it is in view",
    "its edges are too short in the picture",
    "its edges lie too near to others, to the picture's border, or in light that hides them",
    "little contrast is expected of its edges",
    "some of its edges are found, some are not",
    "something else shows through it than lies behind",
    "none of its edges is found, which so few may hide",
    "its edges are found, which may be chance",
    "a feature of it is not as modelled",
    "what it covers shows in its place",
    "an edge of it that should show does not",
    "a size of it may differ from the model's",
    "a feature of it is in doubt",
)
(
    FOUND, MISSING, SHIFTED, RESIZED, NO_EDGE, SHORT, CROWDED, FAINT, DIVIDED, STOPPED, NONE, BY_CHANCE,
    OF_FEATURE, UNCOVERED, ABSENT, DOUBTFUL, OF_DOUBT,
) = range(len(REASONS))  # fmt: skip


@dataclass(frozen=True)
class ItemEvidence:
    """Evidence for items, by camera (n, c): px of edges in view, of them px that can be distinguished from others, of
    those px supported; log_odds: of there against not there; expected_log_odds: their mean, were it there."""

    edge_px: Floats
    distinct_px: Floats
    supported_px: Floats
    log_odds: Floats
    expected_log_odds: Floats


@dataclass(frozen=True)
class Presence:
    """What is there and what is not, a row an item.

    state, reason: index of STATES and of REASONS.  moved_mm, moved_sigma_mm: how far the surface of it that has moved
    most surely lies from its place, nan where none has; moved_log_odds: of that.  uncovered_log_odds: that what a part
    covers shows in its place, nan of others.  cameras: names, as the evidence counts them."""

    items: Items
    signs: Signs
    cameras: list[str]
    evidence: ItemEvidence
    state: NDArray[np.int8]
    reason: NDArray[np.int8]
    moved_mm: Floats
    moved_sigma_mm: Floats
    moved_log_odds: Floats
    uncovered_log_odds: Floats
    measures: Measures

    def find_holding_parts(self, p: StateParameters) -> Ints:
        """The scene's occurrences whose edges hold the pose: those there that lack none, if these show enough."""
        part = np.array([level == "part" for level in self.items.level], bool)
        there = part & (self.state != CONTRADICTED)
        whole = there & (self.signs.absent < 0)
        px = self.evidence.distinct_px.sum(axis=1)
        holding = whole if px[whole].sum() >= p.most_share * px[part].sum() else there
        return np.asarray(self.items.occurrence[holding])

    def weigh_features(self, parts: Ints) -> tuple[float, str]:
        """Log odds that features of these occurrences, as they are told, are another object's; and that in words."""
        of = (np.array(self.items.level) == "feature") & np.isin(self.items.occurrence, parts)
        of &= ~np.char.endswith(np.array(self.items.kind, str), "pattern")  # whose holes count by themselves
        count = np.bincount(self.state[of], minlength=len(STATES))
        differ, doubt, sure = count[CONTRADICTED] + count[CHANGED], count[NOT_CONFIRMED], count[CONFIRMED]
        words = f"too many features differ ({differ}, with {doubt} in doubt and {sure} confirmed): "
        words += "is the object another one, or another size?"
        return float(count @ OF_ANOTHER), words

    def find_explained_surfaces(self) -> Bools:
        """Which of the scene's surfaces (s,) have moved, have something else in their place, are of a hole, boss or
        duct that is not found, or are not found of a pocket, rib, slot or step that is not as modelled: what is missing
        of their edges is told by that."""
        items, level = self.items, np.array(self.items.level)
        fails, face = np.isin(self.state, (CONTRADICTED, CHANGED)), level == "surface"

        def hold(some: Bools) -> Bools:
            """Which surfaces belong to some of these items."""
            out = np.zeros(len(self.signs.surfaces.moved), bool)
            out[items.surface[some[items.member]]] = True
            return out

        lost = (level == "feature") & (fails | (self.state == NOT_CONFIRMED))
        unseen = hold(fails & np.isin(items.kind, WITHIN)) & ~hold(face & (self.state == CONFIRMED))
        return self.signs.surfaces.moved | hold(face & fails) | (hold(lost) & items.inset) | unseen


@dataclass(frozen=True, kw_only=True)
class Signs:
    """What speaks for and against items: the predicted edges, what their surfaces and the regions on them show, how
    they look, how far parts and features stand from their places and from each other, what shows in the place of parts,
    and what nothing predicts.  absent (n,): log odds of each item that some of its own edges are not there."""

    runs: EdgeRuns
    absent: Floats
    surfaces: SceneSurfaces
    appearance: Appearance
    displacements: Displacements
    uncovered: Uncovered
    distances: Measures
    unexplained: UnexplainedElements


def decide(items: Items, radius: Floats, signs: Signs, cameras: list[str], p: StateParameters) -> Presence:
    """States of items by the signs of them; radius (s,): of the scene's cylinders, nan for others."""
    runs, surfaces, appearance = signs.runs, signs.surfaces, signs.appearance
    evidence = gather_evidence(items, runs, len(cameras))
    np.add.at(evidence.log_odds, (appearance.item, appearance.camera), appearance.log_odds)
    displaced = report_displacements(items, signs.displacements, p)
    moved = find_moved(items, surfaces, evidence.distinct_px.sum(axis=1), p.least_moved_share)
    missing = find_missing(items, signs, p)
    moved &= ~missing[items.member]
    measures = Measures.stack([measure_items(items, radius, surfaces, moved, p), displaced])
    measures = measures.take(~missing[measures.item])
    total, expected = evidence.log_odds.sum(axis=1), evidence.expected_log_odds.sum(axis=1)
    edge, distinct = evidence.edge_px.sum(axis=1), evidence.distinct_px.sum(axis=1)
    share = evidence.supported_px.sum(axis=1) / np.maximum(distinct, 1e-9)
    changed, resized, doubtful = np.zeros((3, len(items)), bool)
    off, what = np.abs(measures.value - measures.nominal), np.array(measures.what)
    beyond = np.isin(what, ("diameter", "thickness")) & (off > p.doubtful_sigma * measures.sigma)
    part, feature, face = (np.array(items.level) == it for it in ("part", "feature", "surface"))
    bore = np.isin(items.kind, BORES) | (np.bincount(items.member, items.inset[items.surface], len(items)) > 0) & face
    least_mm = np.where(bore[measures.item], 0.0, p.changed_mm)  # half of a rim has no diameter
    sigmas = np.where(face & ~bore, p.doubtful_sigma, p.changed_sigma)[measures.item]
    beyond |= (what == "offset") & (off > np.maximum(sigmas * measures.sigma, least_mm))
    doubtful[measures.item[beyond]] = True
    changed[measures.item[measures.changed]] = True
    resized[measures.item[measures.changed & ~np.isin(measures.what, ("offset", *DISPLACED))]] = True

    state = np.full(len(items), UNDECIDABLE, np.int8)
    reason = np.where(share <= 0, NONE, np.where(share >= 1 - 1e-9, BY_CHANCE, DIVIDED)).astype(np.int8)
    reason[expected < p.least_expected] = FAINT

    def settle(where: Bools, new_state: int, new_reason: int) -> None:
        state[where], reason[where] = new_state, new_reason

    settle((total <= -p.least_log_odds) & (expected >= p.least_expected), NOT_CONFIRMED, MISSING)
    against = np.where(np.isin(items.kind, WITHIN), p.contradicted_within, p.contradicted_log_odds)
    # Light hides an edge from several pictures at once: of a thing that is not seen n pictures are worth root n.
    pictures = np.maximum((evidence.distinct_px > 0).sum(axis=1), 1)
    gone = (total / np.sqrt(pictures) <= -against - p.contradicted_by_share * share) & (expected >= p.least_expected)
    settle(gone, CONTRADICTED, MISSING)
    settle(total >= p.least_log_odds, CONFIRMED, FOUND)
    holds = part & (distinct >= p.most_share * distinct[part].sum())
    settle((state == CONFIRMED) & (signs.absent >= np.where(holds, 0.0, p.least_log_odds)), NOT_CONFIRMED, ABSENT)
    settle((state == CONFIRMED) & doubtful, NOT_CONFIRMED, DOUBTFUL)
    settle(changed, CHANGED, SHIFTED)
    settle(resized, CHANGED, RESIZED)
    few = distinct < p.least_px
    settle(few, UNDECIDABLE, SHORT)
    settle(few & (edge >= p.least_px), UNDECIDABLE, CROWDED)
    settle(edge <= 0, UNDECIDABLE, NO_EDGE)
    settle(missing & (edge > 0), CONTRADICTED, UNCOVERED)
    stopped = np.isin(np.arange(len(items)), appearance.item[appearance.stopped])
    settle(stopped & (state != CONTRADICTED), CONTRADICTED, STOPPED)
    # No hole passes with a wall whose edges should show and do not, or is there without it.  No hole and no face passes
    # whose size is hardly known, or which has as likely moved as not; no part with a feature that fails or is in doubt.
    hole, fails = np.char.endswith(np.array(items.kind, str), "hole"), (CHANGED, CONTRADICTED)
    for walls, of, *told in (
        (state == NOT_CONFIRMED, feature & (state == CONFIRMED), NOT_CONFIRMED, ABSENT),
        (state == CONTRADICTED, hole, CONTRADICTED, MISSING),
    ):
        unseen = items.surface[(face & (reason == MISSING) & walls)[items.member]]
        wall = items.inset[items.surface] & np.isin(items.surface, unseen)
        settle(of & (np.bincount(items.member, wall, len(items)) > 0), *told)
    most = np.maximum(p.most_sigma_mm * np.where(what == "diameter", 1, 2), p.most_sigma * measures.nominal)
    sized = np.isin(what, ("diameter", "offset", "width")) & (measures.sigma <= most)
    known = np.bincount(measures.item, sized, len(items)) > 0
    even = (surfaces.log_odds >= 0) & (surfaces.distinct_px >= p.least_px)
    known &= np.bincount(items.member, even[items.surface], len(items)) == 0
    settle((hole | face) & (state == CONFIRMED) & ~known, UNDECIDABLE, DOUBTFUL)
    of_feature = [items.occurrence[feature & np.isin(state, some)] for some in ((NOT_CONFIRMED,), fails)]
    in_doubt, failing = (part & np.isin(items.occurrence, some) for some in of_feature)
    settle(in_doubt & (state == CONFIRMED), NOT_CONFIRMED, OF_DOUBT)
    settle(failing & ~np.isin(state, fails), CHANGED, OF_FEATURE)
    # No size of an undecidable item counts as changed.
    measures = replace(measures, changed=measures.changed & (state[measures.item] != UNDECIDABLE))
    measures = Measures.stack([measures, signs.distances])
    most_moved = _find_most_moved(items, surfaces, moved)
    uncovered = np.where(part, signs.uncovered.log_odds[items.occurrence], np.nan)
    return Presence(items, signs, cameras, evidence, state, reason, *most_moved, uncovered, measures)


def find_missing(items: Items, signs: Signs, p: StateParameters) -> Bools:
    """Which items (n,) belong to a part that is surely not there, where what it covers rather shows than not, likelier
    than that it is displaced or that its faces are."""
    it, moved = signs.displacements, np.flatnonzero(signs.surfaces.moved)
    odds, rival = signs.uncovered.log_odds, np.full(len(signs.uncovered.log_odds), p.contradicted_log_odds)
    elsewhere = it.far | it.turned
    rival[it.occurrence[elsewhere]] = np.maximum(p.contradicted_log_odds, it.log_odds[elsewhere])
    of_surface = np.zeros(len(signs.surfaces.moved), np.int64)
    of_surface[items.surface] = items.occurrence[items.member]
    resized = np.bincount(of_surface[moved], signs.surfaces.log_odds[moved], len(odds))
    return np.asarray(((signs.uncovered.beneath > 0) & (odds >= np.maximum(rival, resized)))[items.occurrence])


def weigh_absence_of_items(items: Items, runs: EdgeRuns, cameras: int, p: RunParameters) -> Floats:
    """Log odds (n,) that some of its own edges are not there, of each item."""
    item, run, lent = pair_with_runs(items, runs.surface)
    return weigh_absence(item[~lent], runs.take(run[~lent]), len(items), cameras, p)


def gather_evidence(items: Items, runs: EdgeRuns, cameras: int) -> ItemEvidence:
    """Sums over the edges of all surfaces of each item, each edge once.

    The edges of a hole, a boss or a duct in a face speak for the face where they are found.  Where they are not found
    they say nothing of the face, which may be there without them.  Where edges of an item do not show, others of it
    hide with them: the log odds of all are those in one light, averaged over lights."""
    item, run, lent = pair_with_runs(items, runs.surface)
    distinct = ~lent | (runs.log_odds[run] > 0)
    item, run, lent = item[distinct], run[distinct], lent[distinct]
    at, size = item * cameras + runs.camera[run], len(items) * cameras

    def total(values: Floats) -> Floats:
        return np.bincount(at, values, size).reshape(len(items), cameras).astype(float)

    return ItemEvidence(
        total(runs.visible_px[run]),
        total(runs.weight_px[run]),
        total(runs.weight_px[run] * runs.found[run]),
        sum_in_one_light(at, runs.in_light[run], size).reshape(len(items), cameras),
        total(np.where(lent, 0.0, runs.expected[run])),
    )


def pair_with_runs(items: Items, sides: Ints) -> tuple[Ints, Ints, Bools]:
    """Each item with the runs that are edges of its surfaces, by the surfaces (r, 2) on their sides, sorted, each pair
    once; and whether the edge is lent: of a hole, a boss or a duct in the item that does not belong to it, and is none
    itself.  All edges are a part's own."""
    order = np.argsort(items.surface, kind="stable")
    surface, item = items.surface[order], items.member[order]
    pairs = []
    for side in (0, 1):
        rows = np.flatnonzero(sides[:, side] >= 0)
        low, high = (np.searchsorted(surface, sides[rows, side], side=s) for s in ("left", "right"))
        of, at = count_from(low, high - low)
        pairs.append(item[at] * len(sides) + rows[of])
    item, run = np.divmod(np.unique(np.concatenate(pairs)), max(len(sides), 1))
    part = np.array([level == "part" for level in items.level], bool)
    count = len(items.inset)
    own = np.unique(items.member * count + items.surface)
    inset = (sides[run] >= 0) & items.inset[sides[run]]
    of_item = np.isin(item[:, None] * count + sides[run], own)
    # A hole in a hole, as one beneath a spot face, has its rim for its own.
    lent = ~part[item] & (inset & ~of_item).any(axis=1) & ~(inset & of_item).any(axis=1)
    return item, run, lent


def _find_most_moved(items: Items, surfaces: SceneSurfaces, moved: Bools) -> tuple[Floats, Floats, Floats]:
    """Of each item that of its faces which has moved most surely: mm, sigma and log odds (n,), nan where none has."""
    rows = np.flatnonzero(moved)
    order = rows[np.lexsort((surfaces.log_odds[items.surface[rows]], items.member[rows]))]
    out = np.full((3, len(items)), np.nan)
    # The last of each item is the surest.
    out[:, items.member[order]] = np.stack([surfaces.mm, surfaces.sigma, surfaces.log_odds])[:, items.surface[order]]
    return out[0], out[1], out[2]


def assess(
    stored: StoredScene,
    seen: Observation,
    found: Localisation,
    view: ModelView,
    parts: PartsInView,
    it: EdgeAccount,
    p: PresenceParameters,
) -> Presence:
    """Evidence and state of every part, feature and surface in view at the best pose found.

    view: what cameras should see of the stored scene, parts: which share of each part and feature, it: their edges."""
    assert found.best is not None
    rig, pose = found.rig, found.best
    indexes = [found.edge_indexes[name] for name in rig.cameras]
    response_px, astray_px = split_response(pose.camera_unknowns[:, RESPONSE])
    systematic_px = float(np.hypot(p.displacement.systematic_px, astray_px))
    p = replace(p, displacement=replace(p.displacement, systematic_px=systematic_px))
    where = rig, pose.world_from_rig, indexes, response_px
    samples, support = it.samples, it.support
    maps = [view.maps[name] for name in rig.cameras]
    items = list_items(stored, parts, maps)
    moving = find_moving_surfaces(samples, find_tangent(stored, p.moved.tangent_cosine))
    usable = find_usable(samples, it.nearby, support.owner)
    beside = BodyElements(it.nearby.first, it.nearby.offset, usable, support.weight)
    square = np.concatenate([index.edges.sigma for index in indexes])[it.nearby.element] ** 2
    drawn = np.bincount(it.nearby.sample, square, len(samples.run)) / np.maximum(np.diff(it.nearby.first), 1)
    shaded = it.nearby.contrast * it.nearby.offset > 0
    edges = EdgePredictions(samples, moving, beside, it.runs, it.pieces, it.piece, shaded, drawn)
    surfaces = assess_surfaces(edges, stored, items, len(rig.cameras), p)
    greys = [seen.greys[name] for name in rig.cameras]
    signs = Signs(
        runs=it.pieces,
        absent=weigh_absence_of_items(items, it.pieces, len(rig.cameras), p.account.runs),
        surfaces=surfaces,
        appearance=look_at_features(items, samples, stored.scene, greys, maps, p.appearance),
        displacements=measure_displacements(stored, *where, it, p),
        uncovered=look_beneath(stored, *where, it, maps, p),
        distances=measure_distances(items, stored.scene, stored.radius, surfaces, p.distances),
        unexplained=find_unexplained(
            stored.scene, rig, seen.pictures, indexes, pose.world_from_rig, view.arcs, p.unexplained
        ),
    )
    return decide(items, stored.radius, signs, list(rig.cameras), p.states)
