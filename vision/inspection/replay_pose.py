"""The pose and verdict of a stored inspection decided again, by the inspection's own steps, from its rows: what was
measured at last gives the pose and its covariance, what was weighed gives the verdict."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass, fields, replace
from typing import Any, TypeVar

import numpy as np
from sqlalchemy import Connection

from relmodel.arrays import Floats
from relmodel.geometry.transforms import matrices
from relmodel.store.database import Database
from vision.cameras.cameras import Needs, Prior, Rig
from vision.cameras.record_cameras import read_recorded_rig
from vision.inspection.against import doubt
from vision.inspection.quality import PictureParameters, doubt_pictures, find_faults, read_quality
from vision.inspection.record_decisions import UNKNOWNS
from vision.localisation.calibration import describe_unknowns
from vision.localisation.covariance import compute_covariance
from vision.localisation.elsewhere import Chance
from vision.localisation.hypotheses import Prediction, project_with_jacobians, see_from
from vision.localisation.localisation_parameters import LocalisationParameters, VerdictParameters
from vision.localisation.measurements import Sightings, compare_with_edges, hold_shifts
from vision.localisation.refine import Explanation, join_explanations, normal_equations, take_last_step
from vision.localisation.verdict import (
    CameraSupport,
    Gathered,
    compute_agreement,
    compute_precision,
    find_standing,
    judge,
    weigh_against_prior,
)

P = TypeVar("P")


@dataclass(frozen=True)
class Compared:
    """Values of a step as the store has them and as they come out again: arrays of one shape, or texts."""

    step: str
    what: str
    stored: Floats | str
    replayed: Floats | str


def replay_pose(store: Database, connection: Connection, run: int, p: LocalisationParameters) -> Iterator[Compared]:
    """The last step of the refinement, from its measurements; nothing where the run kept none."""
    poses = _read_poses(store, connection, run)
    cameras = store.columns(connection, "replay/cameras", run=run)
    if "start" not in poses or not len(cameras["view_no"]):
        return
    (start,), (found,), prior = poses["start"], poses["pose"], _prior(poses)
    at, rig = start.world_from_rig, read_recorded_rig(cameras)
    unknowns, stored = describe_unknowns(rig, p.refinement), _read_unknowns(store, connection, run, rig)
    rows = store.columns(connection, "replay/measurements", run=run)
    prediction, seen = _read_sightings(rows, np.searchsorted(cameras["view_no"], rows["view_no"]), rig, at)
    before, scale = stored["before"], p.refinement.rounds[-1][1]
    m = compare_with_edges(prediction, seen, np.zeros(6), unknowns, before, scale, rows["weight"] > 0, p)
    m = replace(m, arc_shift=rows["arc_shift"])
    held = hold_shifts(m, prediction)
    hessian, _ = normal_equations(held, at, before, prior, unknowns)
    covariance = compute_covariance(m, held, prediction, rows["stretch"], hessian, unknowns, p)
    joined = join_explanations(at, covariance, poses.get("explanation", []))
    pose, own = take_last_step(held, at, before, prior, unknowns, p.refinement)
    expected = np.stack([unknowns.mean, unknowns.sigma, unknowns.considered.sum(axis=1).reshape(own.shape)])
    for what, values, again in (
        ("residuals", rows["residual"], m.offset),
        ("weights", rows["weight"], m.weight),
        ("pose", found.world_from_rig, pose),
        ("unknowns of the cameras", stored["value"], own),
        ("what was expected of them", np.stack([stored[n] for n in ("expected", "sigma", "considered")]), expected),
        ("covariance of the measurements", *_scaled(start.covariance, covariance)),
        ("covariance of the pose", *_scaled(found.covariance, joined)),
    ):
        yield Compared("refinement", what, values, again)


def replay_verdict(store: Database, connection: Connection, run: int, given: Any) -> Iterator[Compared]:
    """The verdict, from what the hypotheses gather and the poses of single cameras; nothing where no pose was found.
    given: the row of `replay/inspection`."""
    poses = _read_poses(store, connection, run)
    h = store.columns(connection, "replay/hypotheses", run=run)
    if "start" not in poses or not len(h["cost"]):
        return
    weighed = store.rows(connection, "replay/weighed", run=run)
    p = _read_thresholds([row for row in weighed if row.what == "threshold"])
    stats = {row.name: row.value for row in weighed if row.what == "statistic"}
    gathered = (
        "distance", "evidence", "found", "expected", "outline_length", "outline_contrast", "outline_evidence",
        "is_symmetric", "relational_distance",
    )  # fmt: skip
    g = Gathered(*(np.asarray(h[name], bool if name == "is_symmetric" else float) for name in gathered))
    standing, tried = find_standing(g, p), matrices(h)
    (found,), by_camera, prior = poses["pose"], poses.get("single_camera", []), _prior(poses)
    rows = store.columns(connection, "replay/measurements", run=run)
    measured = len(rows["weight"]) > 0
    view = {name: number for number, name in enumerate(store.columns(connection, "replay/cameras", run=run)["camera"])}

    def agreement(camera: str) -> float:
        if not measured:
            return float(stats[f"agreement {camera}"])
        own = rows["view_no"] == view[camera]
        return compute_agreement(rows["length"][own], rows["residual"][own], p)

    gathered_by = store.rows(connection, "replay/support", run=run, hypothesis_no=int(standing[0]))
    support = {
        row.camera: CameraSupport(
            row.evidence, row.found, row.expected, agreement(row.camera), _read_chance(stats, f" {row.camera}")
        )
        for row in (gathered_by if len(by_camera) > 1 else [])
    }
    again = judge(
        g,
        standing,
        compute_agreement(rows["length"], rows["residual"], p) if measured else stats["agreement"],
        [pose.log_odds for pose in by_camera],
        support,
        _read_chance(stats),
        compute_precision(found.covariance, np.array([given.middle_x, given.middle_y, given.middle_z])),
        int(stats["excluded"]),
        Needs(given.needs_translation_mm, given.needs_rotation),
        p,
    )
    if "contradicted" in poses:
        stated = json.loads(given.parameters).get("believe_pictures", False)
        prior_pose = _as_prior(poses["contradicted"][0])
        again = weigh_against_prior(again, prior_pose, found.world_from_rig, believe_pictures=stated)
    stated_parameters = json.loads(given.parameters)
    faults = find_faults(
        read_quality(store, connection, run), run, read_parameters(PictureParameters(), stated_parameters["pictures"])
    )
    again = doubt_pictures(again, [fault for fault in faults if fault.camera in {row.camera for row in gathered_by}])
    again = doubt(again, [row.name for row in store.rows(connection, "replay/alike", run=run)])
    margin = g.cost[1:].min() - g.cost[0] if len(tried) > 1 else None
    for what, values, replayed in (
        ("best hypothesis", found.world_from_rig, tried[standing[0]]),
        *([] if prior.is_open else [("distances from the prior", g.prior_sigma, [prior.distance(x) for x in tried])]),
        ("costs", h["cost"], g.cost),
        ("shares of the evidence expected", h["evidence_ratio"], g.share),
        *((name, stats.get(name), again.weighed.get(name)) for name in sorted(stats.keys() | again.weighed.keys())),
        ("posterior", given.posterior, again.posterior),
        ("cost", given.cost, g.cost[0]),
        ("margin", given.margin, margin),
    ):
        yield Compared("verdict", what, np.asarray(values, float), np.asarray(replayed, float))
    yield Compared("verdict", "verdict", given.verdict, again.verdict)
    yield Compared("verdict", "reason", given.reason, again.reason)


def _read_chance(stats: dict[str, float], of: str = "") -> Chance:
    return Chance(stats[f"chance_level{of}"], stats[f"chance_scale{of}"])


def read_used_prior(store: Database, connection: Connection, run: int) -> Prior | None:
    """The prior that the pose of a run was found with; None where it was found without."""
    prior = _prior(_read_poses(store, connection, run))
    return None if prior.is_open else prior


def read_parameters(of: P, stated: dict[str, Any]) -> P:
    """Parameters as a run recorded them; what it did not state is as `of` has it."""
    own = {field.name: stated[field.name] for field in fields(of) if field.name in stated}  # type: ignore[arg-type]
    values = {n: read_parameters(getattr(of, n), v) if isinstance(v, dict) else _tupled(v) for n, v in own.items()}
    return replace(of, **values)  # type: ignore[type-var]


def _tupled(value: Any) -> Any:
    return tuple(_tupled(v) for v in value) if isinstance(value, list) else value


def _read_thresholds(rows: list[Any]) -> VerdictParameters:
    """As the thresholds of a run have them: `weights[0]` is the first of several."""
    stated: dict[str, Any] = {}
    for row in sorted(rows, key=lambda row: (len(row.name), row.name)):
        name, bracket, _ = row.name.partition("[")
        stated[name] = [*stated.get(name, []), row.value] if bracket else row.value
    return read_parameters(VerdictParameters(), stated)


def _read_poses(store: Database, connection: Connection, run: int) -> dict[str, list[Explanation]]:
    columns = store.columns(connection, "replay/poses", run=run)
    poses: dict[str, list[Explanation]] = {}
    rows = zip(matrices(columns), columns["covariance"], columns["log_odds"].tolist(), strict=True)
    for what, (pose, covariance, log_odds) in zip(columns["what"], rows, strict=True):
        poses.setdefault(what, []).append(Explanation(pose, np.reshape(covariance, (6, 6)), log_odds))
    return poses


def _prior(poses: dict[str, list[Explanation]]) -> Prior:
    """The prior that the pose was found with."""
    if "prior" not in poses:
        return Prior.open(np.eye(4))
    return _as_prior(poses["prior"][0])


def _as_prior(pose: Explanation) -> Prior:
    return Prior(pose.world_from_rig, pose.covariance)


def _read_unknowns(store: Database, connection: Connection, run: int, rig: Rig) -> dict[str, Floats]:
    """What is known of the cameras' own unknowns, each column as (c, 10)."""
    rows = store.columns(connection, "replay/unknowns", run=run)
    cameras, names = rows.pop("camera").tolist(), rows.pop("name").tolist()
    order = np.lexsort(([UNKNOWNS.index(n) for n in names], [list(rig.cameras).index(c) for c in cameras]))
    return {name: values[order].reshape(len(rig.cameras), len(UNKNOWNS)) for name, values in rows.items()}


def _read_sightings(rows: dict[str, Any], view: Any, rig: Rig, at: Floats) -> tuple[Prediction, Sightings]:
    """The samples that the refinement measured at a pose, in the views (n,), and the edge elements beside them."""
    world = np.stack([rows[f"world_{axis}"] for axis in "xyz"], axis=1)
    prediction = see_from(
        rig, at, world, np.zeros_like(world),
        weight=rows["length"], tolerance_px=rows["tolerance"], view=view, arc=np.asarray(rows["scene_arc"], np.int64),
    )  # fmt: skip
    return prediction, Sightings(
        *project_with_jacobians(prediction),
        np.stack([rows["normal_v"], -rows["normal_u"]], axis=1),
        np.arange(len(world)),
        np.stack([rows["u"], rows["v"]], axis=1),
        rows["sigma"],
        rows["response"],
    )


def _scaled(by: Floats, other: Floats) -> tuple[Floats, Floats]:
    """Two covariances in the standard deviations of the first."""
    sigma = np.sqrt(np.diag(by))
    return by / np.outer(sigma, sigma), other / np.outer(sigma, sigma)
