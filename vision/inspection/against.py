"""Which of the loaded objects and variants pictures show, and where, with no world given or at the pose found."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from relmodel.arrays import Floats, fields_of
from relmodel.errors import UsageError
from relmodel.geometry.transforms import matrix_columns
from relmodel.store import Run, Store
from relmodel.store.runs import Writer
from relmodel.world.placement import place_in_own_worlds
from vision.constellations.find_poses import PoseCandidates
from vision.inspection.inspection_parameters import InspectionParameters
from vision.inspection.locate import Location, Locator, Target, select_parts
from vision.localisation.localise import LEAST_SHARE, Localisation
from vision.localisation.verdict import HypothesisTable, Verdict, find_standing
from vision.localisation.views import Observation
from vision.presence.report import VariantEvidence, assess_variant, rank, rank_failures, tabulate_items, weigh_variant
from vision.presence.states import Presence
from vision.scene import read_variant_scene


def is_to_be_weighed(presence: Presence, asked: bool | None) -> bool:
    """Whether variants are weighed: as asked, where nothing was said if a part or feature is not as the model says."""
    return bool(len(rank_failures(tabulate_items(presence)))) if asked is None else asked


def weigh_variants(
    run: Run,
    target: Target,
    seen: Observation,
    found: Localisation,
    presence: Presence | None,
    p: InspectionParameters,
    most: int | None = None,
) -> list[VariantEvidence]:
    """Rank the loaded variants of the world's inspected objects by their evidence at the best pose.

    presence: that of the variants that the world has, where it is known already; most: so many others are weighed, and
    none where there are more."""
    out, store, world_id = [], run.store, target.stored.world_id
    with store.read() as connection:
        found_rows = store.rows(connection, "world/variants", world_id=world_id, run=run.id)
    rows = [dict(row._mapping) for row in found_rows]
    others = sum(not row["placed"] for row in rows)
    if most is not None and not 1 <= others <= most:
        return []
    for row in rows:
        if row["placed"] and presence is not None:
            out.append(weigh_variant(row, presence))
            continue
        with store.read() as connection:
            scene = read_variant_scene(store, connection, world_id, target.selection.occurrence_id.tolist(), row)
        store.release()
        out.append(assess_variant(row, scene, seen, found, p.presence))
    return rank(out)


LEAST_MARGIN = 3.0
"""nats of evidence, 20 to 1, that tell one variant from another, as the view `found_variant` has it"""


def shows_another(variants: Sequence[VariantEvidence]) -> bool:
    """Whether the pictures surely show another variant of some object than the world has."""
    best: dict[int, float] = {}
    for it in variants:
        best[it.object_no] = max(it.log_odds, best.get(it.object_no, it.log_odds))
    return any(it.placed and best[it.object_no] - it.log_odds >= LEAST_MARGIN for it in variants)


class Candidate(NamedTuple):
    """A loaded variant of an object, and the world in which it stands alone."""

    object_variant_id: int
    name: str
    variant: str
    world_id: int
    world: str


@dataclass(frozen=True)
class ComparedObject:
    """A loaded variant of an object compared with the pictures.

    score: what the best pose of its join explains, None where there is none.  state: `shown`; `alike`, which explains
    the edges that what is shown explains about as well; `outdone`, which explains them less well; `refused`; `left`,
    whose join explains too little beside the best, or less than that of another variant, to be localised.  verdict,
    posterior and object_from_rig (4, 4) are of its own localisation, None where there was none."""

    candidate: Candidate
    score: float | None
    state: str = "left"
    verdict: str | None = None
    posterior: float | None = None
    object_from_rig: Floats | None = None


class Recognition(NamedTuple):
    """Where what is shown is, or what comes nearest; all that was considered, and how its variants rank."""

    location: Location
    considered: list[ComparedObject]
    variants: list[VariantEvidence]


class Chosen(NamedTuple):
    """The variant of an object that was localised, and how its variants rank there."""

    candidate: Candidate
    located: Location
    variants: list[VariantEvidence]


class Start(NamedTuple):
    """Where a variant could be."""

    candidate: Candidate
    locator: Locator
    target: Target
    found: PoseCandidates

    @property
    def score(self) -> float | None:
        score = self.found.candidates.score
        return float(score[0]) if len(score) else None

    def locate(self) -> Location:
        prior, starts, relations = self.found
        found = self.locator.localise(self.target.stored, prior, starts)
        return self.locator.doubt(Location(self.target, prior, found, relations))


def place_candidates(store: Store, run: Run, names: Sequence[str]) -> list[Candidate]:
    """The variants that have any part of the objects of these names, of all that are loaded where there are none, each
    in a world of its own.  Raises UsageError where an object is not loaded."""
    with store.read() as connection:
        loaded = [dict(row._mapping) for row in store.rows(connection, "object/newest", run=run.id)]
    known = list(dict.fromkeys(row["name"] for row in loaded))
    if not known:
        raise UsageError("the store holds no object: load one with relmodel load FILE --object NAME")
    for name in names:
        if name not in known:
            raise UsageError(f"the object {name!r} is not loaded: name some of {', '.join(known)}, or none for all")
    asked = [row for row in loaded if row["name"] in (names or known)]
    worlds = place_in_own_worlds(store, run, asked)
    with store.read() as connection:
        found = [
            Candidate(int(row["object_variant_id"]), row["name"], row["variant"], *world)
            for row, world in zip(asked, worlds, strict=True)
            if store.rows(connection, "world/size", world_id=world[0])[0].parts
        ]
    if not found:
        raise UsageError(f"{', '.join(names or known)} hold no part that pictures could show: load what has some")
    return found


def recognise(locator: Locator, among: Sequence[Candidate]) -> Recognition:
    """Which of some objects the pictures show.

    Every variant is joined with what the pictures show.  The best of each object, of the few whose joins explain most,
    is localised as an inspection without a prior is.  Of those that are not refused the one of most evidence is shown,
    in the variant that has most evidence at its pose; others are shown beside it where they explain other edges."""
    starts = _join(locator, among)
    chosen = [_choose_variant(locator, start, starts) for start in find_worthy(starts, locator.p.most_objects)]
    shown = max(chosen, key=lambda it: _rank(it.located.found))
    considered = {start.candidate: ComparedObject(start.candidate, start.score) for start in starts}
    for it in chosen:
        for one, state in judge_variants(it, judge(it.located, shown.located, locator.p), among).items():
            considered[one] = replace(considered[one], state=state)
        own = fields_of(it.located.found.verdict, "verdict posterior")
        own["object_from_rig"] = getattr(it.located.found.best, "world_from_rig", None)
        considered[it.candidate] = replace(considered[it.candidate], **own)
    order = ("shown", "alike", "outdone", "refused", "left")
    ranked = sorted(considered.values(), key=lambda it: (order.index(it.state), it.candidate != shown.candidate))
    alike, sure = ({it.candidate.name for it in ranked if it.state == state} for state in ("alike", "shown"))
    found = shown.located.found
    found = replace(found, verdict=doubt(found.verdict, sorted(alike - sure)))
    return Recognition(shown.located._replace(found=found), ranked, shown.variants)


def doubt(verdict: Verdict, alike: Sequence[str]) -> Verdict:
    """The verdict on what is shown where other objects, of these names, explain the same edges about as well."""
    if not alike:
        return verdict
    return verdict.ambiguous(f"{' and '.join(alike)} explain{'s' * (len(alike) == 1)} the same edges about as well")


def record_comparisons(write: Writer, considered: Sequence[ComparedObject]) -> None:
    """Append the objects that the pictures were compared with, in their order; none where a world was given."""
    poses = [np.full((4, 4), np.nan) if it.object_from_rig is None else it.object_from_rig for it in considered]
    write(
        "considered_object",
        rank_no=np.arange(len(considered)),
        object_variant_id=[it.candidate.object_variant_id for it in considered],
        **{name: [getattr(it, name) for it in considered] for name in ("score", "state", "verdict", "posterior")},
        **{name: np.ma.masked_invalid(values) for name, values in matrix_columns(poses).items()},
    )


def _join(locator: Locator, among: Sequence[Candidate]) -> list[Start]:
    """Where each of some variants could be, the best explained first."""
    starts = []
    for one in among:
        own = replace(locator, world_id=one.world_id, world=one.world)
        target = select_parts(own.scenes, one.world_id, one.world, own.seen.rig, None, own.p.selection)
        starts.append(Start(one, own, target, own.join(target.stored.scene, None)))
    return sorted(starts, key=lambda start: -(start.score or 0.0))


def find_worthy(starts: Sequence[Start], most: int) -> list[Start]:
    """Of the objects, `most` of them, whose joins explain most, the best variant; starts: the best first."""
    of_object: dict[str, Start] = {}
    for start in starts:
        of_object.setdefault(start.candidate.name, start)
    best = list(of_object.values())
    least = LEAST_SHARE * (best[0].score or 0.0)
    worthy = [start for start in best if start.score is not None and start.score >= least]
    return worthy[:most] or best[:1]


def _rank(found: Localisation) -> tuple[bool, float]:
    """What is not refused first, then more evidence."""
    return found.verdict.verdict != "refused", -np.inf if found.best is None else -found.best.cost


def _choose_variant(locator: Locator, start: Start, starts: Sequence[Start]) -> Chosen:
    """The variant of an object that has most evidence at the pose found, located anew where it is another."""
    located = start.locate()
    own = {s.candidate.object_variant_id: s for s in starts if s.candidate.name == start.candidate.name}
    if located.found.verdict.verdict == "refused" or len(own) < 2:
        return Chosen(start.candidate, located, [])
    ranked = weigh_variants(locator.run, located.target, locator.seen, located.found, None, locator.p)
    locator.run.step("variants")
    likeliest = own[ranked[0].object_variant_id]
    again = located if likeliest is start else likeliest.locate()
    if likeliest is start or again.found.verdict.verdict == "refused":
        return Chosen(start.candidate, located, ranked)
    object_no = int(again.target.stored.occurrence_id[0]) >> 28
    placed = likeliest.candidate.object_variant_id
    ranked = [replace(v, object_no=object_no, placed=v.object_variant_id == placed) for v in ranked]
    return Chosen(likeliest.candidate, again, ranked)


def judge(located: Location, shown: Location, p: InspectionParameters) -> str:
    """What is to be thought of an object that was localised beside the best."""
    if located.found.best is None or shown.found.best is None or located.found.verdict.verdict == "refused":
        return "refused"
    if located is shown or share_edges(located.found, shown.found) < p.same_edges:
        return "shown"
    both = HypothesisTable.of([shown.found.best, located.found.best])
    return "alike" if len(find_standing(both, p.localisation.verdict)) > 1 else "outdone"


def judge_variants(it: Chosen, state: str, among: Sequence[Candidate]) -> dict[Candidate, str]:
    """What is to be thought of an object's variants that were weighed, by what is thought of the one localised."""
    states = {it.candidate: state}
    best = max((v.log_odds for v in it.variants), default=0.0)
    less = {v.object_variant_id: best - v.log_odds for v in it.variants if state != "refused"}
    for one in among:
        if one != it.candidate and one.object_variant_id in less:
            alike = state != "outdone" and less[one.object_variant_id] < LEAST_MARGIN
            states[one] = "alike" if alike else "outdone"
    return states


def share_edges(one: Localisation, other: Localisation) -> float:
    """The share of the edges found by one that another found too."""
    edges, others = (
        {(name, *xy) for name, view in found.views.items() for xy in view.measurements.position.tolist()}
        for found in (one, other)
    )
    return len(edges & others) / max(len(edges), 1)
