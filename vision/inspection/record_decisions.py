"""The thresholds of an inspection's decisions and what its verdict weighed, as rows of `threshold`,
`verdict_statistic`, `hypothesis_support`, `camera_unknown` and `solved_pose`."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields, is_dataclass

import numpy as np
from sqlalchemy import Connection

from relmodel.columns import Ragged
from relmodel.geometry.transforms import matrix_columns
from relmodel.store import Run
from vision.cameras.cameras import Needs, Prior, Rig, perturb
from vision.inspection.inspection_parameters import InspectionParameters
from vision.localisation.calibration import describe_unknowns
from vision.localisation.hypotheses import Stage
from vision.localisation.localise import Localisation
from vision.localisation.refine import Explanation, LastStep, Refined

# A camera's own unknowns in the order of `CameraUnknowns`.
UNKNOWNS = ("response", "centre_u", "centre_v", "focal", "x", "y", "z", "rx", "ry", "rz")


def record_decisions(
    run: Run, connection: Connection, rig: Rig, prior: Prior, needs: Needs, found: Localisation, p: InspectionParameters
) -> None:
    """Append the thresholds of an inspection's decisions and what its verdict weighed."""
    compared = {
        "verdict": p.localisation.verdict,
        "correspondence": p.matching.pose,
        "stereo": p.stereo,
        "presence": p.presence,
        "picture": p.pictures,
    }
    rows = [(decision, name, value) for decision, of in compared.items() for name, value in _numbers(of)]
    rows += [("verdict", f"needs_{name}", value) for name, value in _numbers(needs)]
    run.append(
        connection,
        "threshold",
        {
            "run_id": run.id,
            "decision": [decision for decision, _, _ in rows],
            "name": [name for _, name, _ in rows],
            "value": np.array([value for _, _, value in rows]),
        },
    )
    if found.best is None:
        return
    _record_search(run, connection, prior, found.stages)
    weighed = found.verdict.weighed
    run.append(
        connection,
        "verdict_statistic",
        {"run_id": run.id, "name": list(weighed), "value": np.array(list(weighed.values()))},
    )
    cameras = list(rig.cameras)
    run.append(
        connection,
        "hypothesis_support",
        {
            "run_id": run.id,
            "hypothesis_no": np.repeat(np.arange(len(found.hypotheses)), len(cameras)),
            "camera": cameras * len(found.hypotheses),
            "evidence": np.concatenate([h.support.by_camera for h in found.hypotheses]),
            **{
                name: np.concatenate([getattr(h.support, name) for h in found.hypotheses])
                for name in ("found", "expected", "length_px")
            },
        },
    )
    last = found.best.last_step
    assert last is not None
    unknowns = describe_unknowns(rig, p.localisation.refinement)
    run.append(
        connection,
        "camera_unknown",
        {
            "run_id": run.id,
            "camera": np.repeat(cameras, len(UNKNOWNS)).tolist(),
            "name": list(UNKNOWNS) * len(cameras),
            "value": found.best.own.ravel(),
            "expected": unknowns.mean.ravel(),
            "sigma": unknowns.sigma.ravel(),
        },
    )
    _record_solved(run, connection, found, last, dict(zip(cameras, found.single_cameras, strict=False)))


def _record_search(run: Run, connection: Connection, prior: Prior, stages: list[Stage]) -> None:
    """Append what left each stage of the search, and what became of it."""
    run.append(
        connection,
        "search_stage",
        {
            "run_id": run.id,
            "stage_no": np.arange(len(stages)),
            "name": [stage.name for stage in stages],
            "looked_at": [stage.looked_at for stage in stages],
        },
    )
    counts = [len(stage.rule) for stage in stages]
    run.append(
        connection,
        "search_pose",
        {
            "run_id": run.id,
            "stage_no": np.repeat(np.arange(len(stages)), counts),
            "pose_no": np.concatenate([np.arange(count) for count in counts]),
            **matrix_columns(list(perturb(prior.world_from_rig, np.concatenate([stage.delta for stage in stages])))),
            "score": np.ma.masked_invalid(np.concatenate([stage.score for stage in stages])),
            "rule": [rule for stage in stages for rule in stage.rule],
        },
    )


def _record_solved(
    run: Run, connection: Connection, found: Localisation, last: LastStep, by_camera: dict[str, Refined]
) -> None:
    covariance = found.hypotheses[0].covariance
    equivalent = [Explanation(pose, covariance, 0.0) for pose in found.equivalent]
    others = [*last.explanations, *equivalent]
    kinds = ["explanation"] * len(last.explanations) + ["equivalent"] * len(equivalent)
    poses: list[LastStep | Refined | Explanation] = [last, *by_camera.values(), *others]
    run.append(
        connection,
        "solved_pose",
        {
            "run_id": run.id,
            "solved_no": np.arange(len(poses)),
            "kind": ["start"] + ["single_camera"] * len(by_camera) + kinds,
            "camera": [None, *by_camera, *[None] * len(others)],
            **matrix_columns([h.world_from_rig for h in poses]),
            "covariance": Ragged.pack([h.covariance for h in poses]),
            "log_odds": [None, *(h.evidence for h in by_camera.values()), *(h.log_odds for h in others)],
        },
    )


def _numbers(parameters: object, within: str = "") -> Iterator[tuple[str, float]]:
    """Names and values of the numeric fields of a parameter class, those of tuples one by one, and of the classes in
    it: `assignment.nodes`."""
    for field in fields(parameters):  # type: ignore[arg-type]
        name, value = f"{within}{field.name}", getattr(parameters, field.name)
        if is_dataclass(value):
            yield from _numbers(value, f"{name}.")
        elif isinstance(value, int | float):
            yield name, float(value)
        elif isinstance(value, tuple) and all(isinstance(v, int | float) for v in value):
            yield from ((f"{name}[{i}]", float(v)) for i, v in enumerate(value))
