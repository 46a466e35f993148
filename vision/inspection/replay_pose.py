"""The pose and verdict of a stored inspection worked out again from its rows: what was measured at last gives the pose
and its covariance, what was weighed gives the verdict."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields, is_dataclass
from typing import Any, get_type_hints

import numpy as np
from sqlalchemy import Connection

from relmodel.arrays import Floats
from relmodel.geometry.transforms import MATRIX_COLUMNS, inverse, matrices
from relmodel.store.database import Database
from vision.cameras.cameras import Needs, Prior
from vision.inspection.record_decisions import UNKNOWNS
from vision.localisation.calibration import CameraUnknowns, differentiate
from vision.localisation.covariance import compute_covariance
from vision.localisation.hypotheses import Prediction, project_with_jacobians
from vision.localisation.localisation_parameters import LocalisationParameters, VerdictParameters
from vision.localisation.measurements import Measurements, weigh
from vision.localisation.refine import Explanation, join_explanations, normal_equations, take_last_step
from vision.localisation.verdict import (
    Gathered,
    compute_agreement,
    compute_precision,
    find_standing,
    judge,
)


@dataclass(frozen=True)
class Compared:
    """Values of a step as the store has them and as they come out again: arrays of one shape, or texts."""

    step: str
    what: str
    stored: Floats | str
    replayed: Floats | str


@dataclass(frozen=True)
class _Asked:
    """What an inspection was given, and the parameters of its localisation."""

    prior: Prior
    needs: Needs
    p: LocalisationParameters


def replay_pose(store: Database, connection: Connection, run: int, parameters: dict[str, Any]) -> Iterator[Compared]:
    """The last step of the refinement, from its measurements; nothing where the run kept none."""
    asked = _read_asked(store, connection, run, parameters)
    start = store.rows(connection, "replay/solved", run=run, kind="start")
    cameras = store.columns(connection, "replay/cameras", run=run)
    if not start or not len(cameras["view_no"]):
        return
    at, rig_from_camera = _matrix(start[0]), matrices(cameras)
    unknowns, before, solved = _read_unknowns(store, connection, run, cameras["camera"].tolist())
    rows = store.columns(connection, "replay/measurements", run=run)
    prediction = _predict(rows, at, rig_from_camera, cameras)
    m = _measure(rows, prediction, unknowns, before, asked.p)
    pose, own = take_last_step(m, at, before, asked.prior, unknowns, asked.p.refinement)
    hessian, _ = normal_equations(m, at, before, asked.prior, unknowns)
    covariance = compute_covariance(m, prediction, rows["stretch"], hessian, unknowns, asked.p)
    others = [
        Explanation(_matrix(row), _square(row.covariance), row.log_odds)
        for row in store.rows(connection, "replay/solved", run=run, kind="explanation")
    ]
    found = store.rows(connection, "replay/pose", run=run)[0]
    yield Compared("refinement", "residuals", rows["residual"], m.offset)
    yield Compared("refinement", "weights", rows["weight"], m.weight)
    yield Compared("refinement", "pose", _matrix(found), pose)
    yield Compared("refinement", "unknowns of the cameras", solved, own)
    own_sigma = _square(start[0].covariance)
    yield Compared(
        "refinement", "covariance of the measurements", _scaled(own_sigma, own_sigma), _scaled(covariance, own_sigma)
    )
    stored = _square(found.covariance)
    joined = join_explanations(at, covariance, others)
    yield Compared("refinement", "covariance of the pose", _scaled(stored, stored), _scaled(joined, stored))


def replay_verdict(store: Database, connection: Connection, run: int, parameters: dict[str, Any]) -> Iterator[Compared]:
    """The verdict, from what the hypotheses gather and the poses of single cameras; nothing where no pose was found."""
    asked = _read_asked(store, connection, run, parameters)
    found = store.rows(connection, "replay/pose", run=run)
    h = store.columns(connection, "replay/hypotheses", run=run)
    if not found or not len(h["cost"]):
        return
    p = _verdict_parameters(store.rows(connection, "replay/thresholds", run=run, decision="verdict"))
    poses, pose = matrices(h), _matrix(found[0])
    g = Gathered(
        h["distance"], h["evidence"], h["found"], h["expected"], h["outline_length"], h["outline_contrast"],
        h["outline_evidence"],
    )  # fmt: skip
    standing = find_standing(g, p)
    yield Compared("verdict", "best hypothesis", pose, poses[standing[0]])
    yield Compared(
        "verdict", "distances from the prior", g.prior_sigma, np.array([asked.prior.distance(x) for x in poses])
    )
    yield Compared("verdict", "costs", h["cost"], g.cost)
    yield Compared("verdict", "shares of the evidence expected", h["evidence_ratio"], g.share)

    weighed = {row.name: row.value for row in store.rows(connection, "replay/signs", run=run)}
    rows = store.columns(connection, "replay/measurements", run=run)
    agreement = weighed["agreement"]
    if len(rows["weight"]):
        agreement = compute_agreement(rows["length"], rows["weight"], rows["residual"], p)
    again = judge(
        g,
        standing,
        agreement,
        [
            (_matrix(row), _square(row.covariance))
            for row in store.rows(connection, "replay/solved", run=run, kind="alone")
        ],
        compute_precision(
            _square(found[0].covariance), np.array([found[0].middle_x, found[0].middle_y, found[0].middle_z])
        ),
        int(weighed["excluded"]),
        asked.needs,
        p,
    )
    for name in sorted(weighed.keys() | again.weighed.keys()):
        values = (np.array(of.get(name, np.nan), float) for of in (weighed, again.weighed))
        yield Compared("verdict", name, *values)
    yield Compared("verdict", "posterior", np.array(found[0].posterior), np.array(again.posterior))
    yield Compared("verdict", "verdict", found[0].verdict, again.verdict)
    yield Compared("verdict", "reason", found[0].reason, again.reason)


def read_parameters(cls: type[Any], stated: dict[str, Any]) -> Any:
    """An object of a parameter class from what a run recorded; what it did not state is as the class has it."""
    hints, given = get_type_hints(cls), {}
    for field in fields(cls):
        if field.name in stated:
            value = stated[field.name]
            kind = hints[field.name]
            nested = isinstance(kind, type) and is_dataclass(kind)
            given[field.name] = read_parameters(kind, value) if nested else _tupled(value)
    return cls(**given)


def _tupled(value: Any) -> Any:
    return tuple(_tupled(v) for v in value) if isinstance(value, list) else value


def _verdict_parameters(held: Any) -> VerdictParameters:
    """As the thresholds of a run have them: `weights[0]` is the first of several."""
    stated: dict[str, Any] = {}
    for row in held:
        name, bracket, _ = row.name.partition("[")
        if bracket:
            stated.setdefault(name, []).append((int(row.name[len(name) + 1 : -1]), row.value))
        else:
            stated[name] = row.value
    values = {n: [v for _, v in sorted(v)] if isinstance(v, list) else v for n, v in stated.items()}
    found: VerdictParameters = read_parameters(VerdictParameters, values)
    return found


def _read_asked(store: Database, connection: Connection, run: int, parameters: dict[str, Any]) -> _Asked:
    (row,) = store.rows(connection, "replay/inspection", run=run)
    return _Asked(
        Prior(_matrix(row), _square(row.prior_covariance)),
        Needs(row.needs_translation_mm, row.needs_rotation),
        read_parameters(LocalisationParameters, parameters["localisation"]),
    )


def _read_unknowns(
    store: Database, connection: Connection, run: int, cameras: list[str]
) -> tuple[CameraUnknowns, Floats, Floats]:
    """What was expected of the cameras' unknowns; what the last step set out from, and where it led (c, 10)."""
    rows = {(row.camera, row.name): row for row in store.rows(connection, "replay/unknowns", run=run)}
    ordered = [[rows[camera, name] for name in UNKNOWNS] for camera in cameras]

    def of(column: str) -> Floats:
        return np.array([[getattr(row, column) for row in camera] for camera in ordered])

    shared = np.zeros((len(cameras), len(UNKNOWNS), 2))
    for axis, name in enumerate(("centre_u", "centre_v")):
        shared[:, UNKNOWNS.index(name), axis] = of("considered")[:, UNKNOWNS.index(name)]
    return CameraUnknowns(of("expected"), of("sigma"), shared.reshape(-1, 2)), of("before"), of("value")


def _predict(rows: dict[str, Any], at: Floats, rig_from_camera: Floats, cameras: dict[str, Any]) -> Prediction:
    rig_from_world, camera_from_rig = inverse(at), inverse(rig_from_camera)
    world = np.stack([rows[f"world_{axis}"] for axis in "xyz"], axis=1)
    matrix = np.zeros((len(camera_from_rig), 2, 3))
    for name, (i, j) in {"fx": (0, 0), "skew": (0, 1), "cx": (0, 2), "fy": (1, 1), "cy": (1, 2)}.items():
        matrix[:, i, j] = cameras[name]
    return Prediction(
        point=world @ rig_from_world[:3, :3].T + rig_from_world[:3, 3],
        tangent=np.zeros_like(world),
        weight=rows["length"],
        tolerance_px=rows["tolerance"],
        view=np.searchsorted(cameras["view_no"], rows["view_no"]),
        arc=np.asarray(rows["scene_arc"], np.int64),
        rotation=camera_from_rig[:, :3, :3],
        offset=camera_from_rig[:, :3, 3],
        matrix=matrix,
    )


def _measure(
    rows: dict[str, Any], prediction: Prediction, unknowns: CameraUnknowns, own: Floats, p: LocalisationParameters
) -> Measurements:
    """The measurements as the refinement had them, offsets and weights worked out anew."""
    pixel, jacobian = project_with_jacobians(prediction)
    normal = np.stack([rows["normal_u"], rows["normal_v"]], axis=1)
    at = np.stack([rows["u"], rows["v"]], axis=1)
    by_camera = np.zeros((len(pixel), *own.shape))
    for number in range(len(own)):
        of = np.flatnonzero(prediction.view == number)
        by_camera[of, number] = differentiate(
            prediction, np.zeros(6), of, pixel[of], normal[of], rows["response"][of], unknowns.sigma[number]
        )
    offset = np.einsum("ni,ni->n", normal, at - pixel) - by_camera.reshape(len(pixel), -1) @ own.ravel()
    weight, slope = weigh(offset, prediction.tolerance_px, rows["weight"] > 0, p.refinement.rounds[-1][1])
    return Measurements(
        pixel,
        np.stack([rows["normal_v"], -rows["normal_u"]], axis=1),
        offset,
        np.zeros(len(offset), np.int64),
        rows["sigma"],
        weight,
        slope,
        np.concatenate([np.einsum("ni,nij->nj", normal, jacobian), by_camera.reshape(len(pixel), -1)], axis=1),
    )


def _matrix(row: Any) -> Floats:
    return np.asarray(matrices({name: np.array([getattr(row, name)]) for name in MATRIX_COLUMNS})[0])


def _square(values: Any) -> Floats:
    return np.reshape(np.asarray(values, float), (6, 6))


def _scaled(covariance: Floats, by: Floats) -> Floats:
    """A covariance in the standard deviations of another."""
    sigma = np.sqrt(np.diag(by))
    return np.asarray(covariance / np.outer(sigma, sigma))
