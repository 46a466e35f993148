"""The evidence of predicted edges, run by run, and the account of them all."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from relmodel.arrays import Bools, Floats, Ints, Rows, sum_by_group
from vision.account.account_parameters import AccountParameters, RunParameters
from vision.account.samples import (
    Nearby,
    Samples,
    SampleSupport,
    Sides,
    collect_samples,
    find_nearby,
    look_at_sides,
    measure_support,
)
from vision.cameras.cameras import Rig
from vision.localisation.measurements import RESPONSE, EdgeIndex, split_response
from vision.localisation.refine import RefinedPose
from vision.localisation.views import ViewArcs
from vision.scene import StoredScene

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

    camera; view_run: as the camera's view counts it; kind; arc, surface (r, 2): as samples have them; visible_px;
    weight_px: of it what can be distinguished from other edges; found: share of that which is supported; chance: share
    that chance supports; shows: probability that such an edge shows; log_odds: of there against not there; expected:
    what they would be in the mean were it there; in_light (r, k): log odds in k lights, equally likely, from one in
    which few edges show to one in which most do: the edges of a thing are seen in the same."""

    camera: Ints
    view_run: Ints
    kind: Ints
    arc: Ints
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
        arc=samples.arc[head],
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


def weigh_edges(it: EdgeRuns) -> float:
    """Log odds of all edges being there against not there, each camera's in one light."""
    return float(sum_in_one_light(it.camera, it.in_light, int(it.camera.max(initial=-1)) + 1).sum())


def weigh_absence(item: Ints, rows: EdgeRuns, count: int, cameras: int, p: RunParameters) -> Floats:
    """Log odds (count,) that some edges of items are not there, against all being there; item (r,): of the rows.

    In a picture those of one pair of surfaces, and of an arc that has nothing on one side, are there or not together.
    An edge that one picture shows is not gone from another.  What share of its edges an item would lack is not known:
    those of `missing` are as likely one as another.  So no edge that is found pays for one that does not show."""
    sides = np.sort(np.where(rows.surface < 0, -2 - rows.arc[:, None], rows.surface), axis=1)
    seen, row = np.unique(np.column_stack([item, sides, rows.camera]), axis=0, return_inverse=True)
    edge = np.unique(seen[:, :3], axis=0, return_inverse=True)[1].ravel()
    own, each = sum_by_group(row.ravel(), rows.in_light, len(seen)), np.arange(len(seen))
    shown = np.maximum(sum_in_one_light(each, own, len(seen)), 0.0)
    elsewhere = (np.bincount(edge, shown)[edge] - shown)[:, None]

    def weigh(odds: Floats) -> Floats:
        at = seen[:, 0] * cameras + seen[:, 3]
        return np.asarray(sum_in_one_light(at, odds, count * cameras).reshape(count, cameras).sum(axis=1))

    some = [weigh(np.logaddexp(np.log1p(-share) + own, np.log(share) - elsewhere)) for share in p.missing]
    return np.asarray(np.logaddexp.reduce(some) - np.log(len(some)) - weigh(own))


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
    """The share (r,) that runs between alike sides show elsewhere in the picture, without others of its surfaces."""
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
        a, b = surface[rows].T
        on_a, on_b = (((side[:, None] == a) | (side[:, None] == b)) & (side[:, None] >= 0) for side in (a, b))
        alike[on_a & (on_b | (b[:, None] < 0))] = 0.0
        out[rows] = (alike @ found[rows] + p.usual_runs * usual) / (alike.sum(axis=1) + p.usual_runs)
    return out


def _squares(a: Floats, b: Floats) -> Floats:
    """Squared distances (n, n) between rows."""
    return np.asarray(np.maximum((a**2).sum(axis=1)[:, None] + (b**2).sum(axis=1)[None] - 2 * a @ b.T, 0.0))


@dataclass(frozen=True)
class EdgeAccount:
    """All that is known of the edges that cameras should see at a pose: their samples, the elements beside them, what
    supports them, what lies on their sides, and the evidence, of whole runs and of pieces, parted where they turn, with
    the piece (n,) of each sample."""

    samples: Samples
    nearby: Nearby
    support: SampleSupport
    sides: Sides
    runs: EdgeRuns
    pieces: EdgeRuns
    piece: Ints


def take_account(
    stored: StoredScene,
    rig: Rig,
    pose: RefinedPose,
    indexes: Mapping[str, EdgeIndex],
    views: Mapping[str, ViewArcs],
    p: AccountParameters,
) -> EdgeAccount:
    """The account of what cameras see of a scene at a pose with its cameras as solved; indexes, views: by camera."""
    lists, (responses, _) = [indexes[name] for name in rig.cameras], split_response(pose.camera_unknowns[:, RESPONSE])
    can_show = [index.edges.can_show for index in lists]
    samples = collect_samples(stored, rig, can_show, pose.world_from_rig, views, p.samples)
    nearby = find_nearby(samples.camera, samples.pixel, samples.direction, lists, responses, p.samples)
    support = measure_support(samples, nearby, p.support)
    sides = look_at_sides(stored.scene, rig, pose.world_from_rig, samples, p.sides)
    parted = part_at_turns(samples, p.runs)
    runs, pieces = (weigh_runs(it, support, sides, p.runs) for it in (samples, parted))
    return EdgeAccount(samples, nearby, support, sides, runs, pieces, parted.run)


def weigh_lookalike(
    stored: StoredScene, it: EdgeRuns, asked: Bools, cameras: Sequence[str], p: RunParameters
) -> tuple[float, str]:
    """Log odds that the object lacks some of its asked edges (r,), as another of like outline does, against having them
    all; and words on that, with the edge that says most for it."""
    rows = it.take(np.flatnonzero(asked & (it.weight_px > 0)))
    if not len(rows.camera):
        return 0.0, ""
    whole = np.zeros(len(rows.camera), np.int64)
    odds = weigh_absence(whole, rows, 1, len(cameras), p)
    worst = int(np.argmin(rows.log_odds))
    own = [stored.name_surface(surface) for surface in rows.surface[worst].tolist() if surface >= 0]
    words = f"edges of the model that should show do not, log odds {odds[0]:.1f}, most of all "
    where = f"{rows.weight_px[worst]:.0f} px of {' and '.join(own)} in the picture of {cameras[rows.camera[worst]]}"
    return float(odds[0]), words + where
