"""A stored inspection decided again from its rows, without its pictures: `relmodel replay`."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from sqlalchemy import Connection

from relmodel.errors import UsageError
from relmodel.geometry.transforms import matrices
from relmodel.identity import code_sha256
from relmodel.labelling.solve import solve
from relmodel.labelling.stored import read_problem
from relmodel.store import Store
from relmodel.store.runs import package_versions
from vision.cameras.cameras import perturb
from vision.cameras.record_cameras import read_recorded_rig
from vision.constellations.constellation_parameters import DEFAULTS as CONSTELLATIONS
from vision.constellations.find_poses import find_poses
from vision.constellations.find_poses_of_one_picture import find_poses_of_one_picture
from vision.extraction.record_extraction import read_primitives
from vision.inspection.record_inspection import STEREO
from vision.inspection.replay_pose import Compared, read_parameters, read_used_prior, replay_pose, replay_verdict
from vision.localisation.localisation_parameters import DEFAULTS as LOCALISATION
from vision.matching.pose_problem import REASONS, PoseMatch
from vision.matching.stored_match import match_stored
from vision.scene.stored_scene import read_scene
from vision.stereo.record_stereo import read_triangulated

TOLERANCE, OTHER_TOLERANCE = 1e-9, 1e-6
"""greatest difference, as a share of a value above 1, by the code, packages and machine that made the run; by others"""

# The relations that a replay reads.
READ = {
    "problem", "candidate", "problem_relation", "compatibility", "assignment", "correspondence", "surface_match",
    "space_relation", "edge_measurement", "solved_pose", "camera_unknown", "hypothesis", "hypothesis_support",
    "verdict_statistic", "threshold", "inspection",
}  # fmt: skip


class Outcome(NamedTuple):
    """How one thing came out again: how many values, and the greatest difference (of values above 1 as a share); None
    for texts, and where one side lacks a value."""

    step: str
    what: str
    values: int
    difference: float | None
    agrees: bool


@dataclass(frozen=True)
class Replay:
    """outcomes: of what could be replayed.  others: what has another version now than when the run was made, a sentence
    each."""

    outcomes: list[Outcome]
    others: list[str]

    @property
    def agrees(self) -> bool:
        return all(outcome.agrees for outcome in self.outcomes)


def replay(store: Store, run: int) -> Replay:
    """Decide an inspection again: assignments from candidates and relations, matches from pairs and relations, the last
    step of the refinement from what was measured, and the verdict from what was weighed.  Writes nothing.

    Raises UsageError for runs that are no finished inspections, or whose rows were pruned.
    """
    with store.read(scratch=True) as connection:
        _check(store, connection, run)
        (given,) = store.rows(connection, "replay/inspection", run=run)
        parameters = read_parameters(LOCALISATION, json.loads(given.parameters)["localisation"])
        others = _changed(json.loads(given.versions), given.code_sha256)
        tolerance = OTHER_TOLERANCE if others else TOLERANCE
        compared = [
            *_replay_matching(store, connection, run),
            *_replay_join(store, connection, run, given),
            *replay_pose(store, connection, run, parameters),
            *replay_verdict(store, connection, run, given),
        ]
    return Replay([_judge(c, tolerance) for c in compared], others)


def _check(store: Store, connection: Connection, run: int) -> None:
    found = store.rows(connection, "audit/run", run=run)
    if not found:
        raise UsageError(f"there is no run {run}: relmodel runs lists them")
    if found[0].kind != "inspect":
        raise UsageError(f"run {run} is of kind {found[0].kind}: name one of kind inspect, as relmodel runs lists them")
    pruned = store.rows(connection, "audit/pruned", run=run)
    if pruned:
        raise UsageError(f"what run {run} found was pruned by run {pruned[0].by_run_id}")
    if found[0].verdict is None:
        raise UsageError(f"run {run} came to no verdict, it is {found[0].state}")


def _changed(versions: dict[str, str], code: str) -> list[str]:
    now = package_versions(*versions)
    others = [
        f"{name} was {version} and is {now.get(name, 'not there')}"
        for name, version in versions.items()
        if now.get(name) != version
    ]
    if code != code_sha256():
        others.append("the code of relmodel is another than the run's")
    return others


def _judge(c: Compared, tolerance: float) -> Outcome:
    if isinstance(c.stored, str) or isinstance(c.replayed, str):
        same = c.stored == c.replayed
        return Outcome(c.step, c.what, 1, None, same)
    if c.stored.shape != c.replayed.shape:
        return Outcome(c.step, c.what, c.stored.size, None, False)
    both = np.isnan(c.stored) & np.isnan(c.replayed)
    apart = np.where(both, 0.0, np.abs(c.stored - c.replayed) / np.maximum(np.abs(c.stored), 1.0))
    worst = float(apart.max(initial=0.0))
    if not np.isfinite(worst):
        return Outcome(c.step, c.what, c.stored.size, None, False)
    return Outcome(c.step, c.what, c.stored.size, worst, worst <= tolerance)


def _replay_matching(store: Store, connection: Connection, run: int) -> Iterator[Compared]:
    for problem in store.rows(connection, "replay/problems", run=run):
        number, parameters = problem.problem_no, json.loads(problem.parameters)
        labels = store.columns(connection, "replay/labels", run=run, problem_no=number)["label_no"].astype(float)
        step = f"{problem.kind} {number}"
        if problem.kind == "stereo":
            nodes = int(parameters["assignment"]["nodes"])
            again = solve(read_problem(store, connection, run, number), parameters["search"], nodes=nodes)
        else:
            match = match_stored(store, connection, run, number)
            again = match.solved.result
            yield from _compare_pairs(store, connection, run, number, step, match)
        yield Compared(step, "labels", labels, again.label.astype(float))
        yield Compared(step, "cost", np.array(problem.cost), np.array(float(again.cost)))


def _replay_join(store: Store, connection: Connection, run: int, given: Any) -> Iterator[Compared]:
    """The poses of the join, from the arcs that stereo put in space or those of one picture; nothing where the run kept
    none."""
    stored = store.columns(connection, "replay/joined_poses", run=run)
    cameras = store.columns(connection, "replay/cameras", run=run)
    if not len(stored["score"]) or not len(cameras["camera"]):
        return
    p = read_parameters(CONSTELLATIONS, json.loads(given.parameters)["constellations"])
    used = read_used_prior(store, connection, run)
    if len(cameras["camera"]) > 1:
        space = read_triangulated(store, connection, run, STEREO)
        selected = store.columns(connection, "replay/selected_parts", run=run)["occurrence_id"]
        scene = read_scene(store, connection, given.world_id, selected.tolist()).scene
        prior, found, relations = find_poses(store, connection, scene, given.world_id, space, used, p)
    else:
        picture = read_primitives(store, connection, int(cameras["extraction_id"][0]))
        rig = read_recorded_rig(cameras)
        prior, found, relations = find_poses_of_one_picture(store, connection, rig, given.world_id, picture, used, p)
    related = store.columns(connection, "replay/relations", run=run)
    for name, values in related.items():
        yield Compared("join", name, values, np.concatenate([np.zeros(0), *(one[name] for one in relations.values())]))
    yield Compared("join", "poses", matrices(stored), perturb(prior.world_from_rig, found.delta))
    yield Compared("join", "scores", stored["score"], found.score)


def _compare_pairs(
    store: Store, connection: Connection, run: int, number: int, step: str, match: PoseMatch
) -> Iterator[Compared]:
    (problem,) = store.rows(connection, "matching/localisation_problem", run_id=run, problem_no=number)
    for what, query, pairs in (
        ("correspondences", "matching/stored_pairs", match.arcs),
        ("matches of surfaces", "matching/stored_surface_pairs", match.surfaces),
    ):
        key = {"run_id": run, "view_no": problem.view_no} | ({"problem_no": number} if pairs is match.arcs else {})
        stored = store.columns(connection, query, **key)["reason"]
        codes = np.array([REASONS.index(reason) for reason in stored], float)
        yield Compared(step, what, codes, pairs.reason.astype(float))


def count_rows(store: Store, run: int) -> list[tuple[str, int]]:
    """How many rows a run wrote of the relations that a replay reads."""
    with store.read() as connection:
        _check(store, connection, run)
        written = store.rows(connection, "report/written", run_id=run)
    return sorted((row.relation, int(row.row_count)) for row in written if row.relation in READ)
