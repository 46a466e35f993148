"""The answer of an inspection, read from its rows: whatever says it says the same, when it is made and years after."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields
from typing import Any

import numpy as np
from sqlalchemy import Connection

from relmodel.arrays import Floats, list_rows
from relmodel.geometry.transforms import MATRIX_COLUMNS, matrices
from relmodel.printing import finite
from relmodel.store import Store
from vision.cameras.cameras import perturb
from vision.presence.report import describe

PLACE = ("x", "y", "z", "rx", "ry", "rz")  # of a camera's unknowns: what moved it in the rig, as `perturb` takes it


@dataclass(frozen=True)
class Outcome:
    """A row of the view `inspection_outcome`, with the sentences of `found_variant`.

    verdict, pose_verdict, part_verdict, mood: as the view has them.  findings, checked, in_view, changed, contradicted,
    not_confirmed, undecidable: how many parts and features in view are so; None where the pose is refused.  variant:
    that the pictures show another variant than the world has; None where they do not, or none was weighed.  words: all
    of it, as "pose usable; part deviates (4 findings); 5 of 8 checked, ...".  variants: of each object of which several
    variants were weighed which one is shown, and what says so.  shown: which of the objects that the pictures were
    compared with they show; None where a world was given.  cause: why the pose is most likely not accepted, as
    the view `why_verdict_cause` says, and refusal: that in a sentence and what to do next in another; nothing where it
    is accepted."""

    verdict: str
    pose_verdict: str
    part_verdict: str
    mood: str
    findings: int | None
    checked: int | None
    in_view: int | None
    changed: int | None
    contradicted: int | None
    not_confirmed: int | None
    undecidable: int | None
    variant: str | None
    words: str
    variants: list[str]
    shown: str | None
    cause: str | None
    refusal: list[str]

    @property
    def unchecked(self) -> int | None:
        """How many parts and features in view are not confirmed or undecidable."""
        return None if self.in_view is None else self.in_view - (self.checked or 0)

    @property
    def is_usable(self) -> bool:
        return self.pose_verdict == "usable"

    def has(self, what: str) -> bool:
        """Whether one of NOT_AS_MODELLED is there."""
        return bool(getattr(self, what))

    def to_json(self) -> dict[str, Any]:
        return {**asdict(self), "unchecked": self.unchecked}


@dataclass(frozen=True)
class Inspection:
    """The answer of an inspection; transforms are 4x4, mm, of the best hypothesis whatever the verdict, and None only
    where nothing is in view.  Lists of rows are as `docs/json/inspect.schema.json` has them.

    outcome: whether the pose may be used and how the part is.
    posterior: probability that the best hypothesis is the right one.  missing: what was missing for acceptance, a
    sentence each.  needs: how exactly the pose was needed.  sigma: standard deviations of the pose along the worst
    directions, of the point in the middle of what is seen and of rotation; weakest: those directions.
    covariance: (6, 6) of a right perturbation of world_from_rig in the rig's frame, t mm then r rad.
    base_corrections: what the pose says of each object that the world mounts the rig on; none where it is not accepted
    or the rig not mounted.
    presence: evidence for what is in view; None where the pose is refused.
    characteristics: sizes that have limits or were measured, with what is decided of each.
    variants: evidence for each loaded variant of the inspected objects, the likeliest first, where it was weighed.
    considered: the loaded objects that the pictures were compared with where no world was given, what is shown first;
    all else is then of the first, in a world where it stands alone at its origin.
    selection: how many placed parts any pose which the prior leaves open could show, all where there is none (nothing
    else was considered), and how many of them no sampled pose shows.
    hypotheses: poses considered, the best first.  equivalent: poses of the rig, beside the best, from which a symmetric
    model looks the same.
    standpoints: where one rig took the pictures from several; the pose above is of the first that is not ignored.
    notes: what was taken for given that the inputs do not say, of the pictures and of the prior, a sentence each."""

    run: int
    outcome: Outcome
    reason: str
    posterior: float
    missing: list[str]
    needs: dict[str, float]
    sigma: dict[str, float]
    weakest: str | None
    world_from_rig: Floats | None
    world_from_camera: dict[str, Floats | None]
    covariance: Floats | None
    base_corrections: list[dict[str, Any]]
    parts_in_view: list[dict[str, Any]]
    presence: dict[str, Any] | None
    characteristics: list[dict[str, Any]]
    variants: list[dict[str, Any]]
    considered: list[dict[str, Any]]
    selection: dict[str, int]
    hypotheses: list[dict[str, Any]]
    equivalent: list[Floats]
    standpoints: list[dict[str, Any]]
    notes: list[str]
    timings_s: dict[str, float] = field(compare=False)

    @property
    def verdict(self) -> str:
        """accepted, ambiguous or refused: of the pose."""
        return self.outcome.verdict

    def to_json(self) -> dict[str, Any]:
        """The answer in plain lists and numbers, under the names of the fields."""
        own = {it.name: getattr(self, it.name) for it in fields(Inspection)}
        said = {"run": self.run, "verdict": self.verdict, **own, "outcome": self.outcome.to_json()}
        return finite(said)  # type: ignore[no-any-return]


def read_outcome(store: Store, connection: Connection, run: int) -> Outcome:
    """The outcome of an inspection that came to a verdict."""
    (row,) = store.rows(connection, "run/outcome", run=run)
    variants = [r.sentence for r in store.rows(connection, "why/verdict/15_variants", run=run)]
    refusal = [r.sentence for r in store.rows(connection, "why/verdict/11_cause", run=run)]
    (shown, *_) = [r.sentence for r in store.rows(connection, "why/verdict/12_against", run=run)] or [None]
    return Outcome(**row._mapping, variants=variants, shown=shown, refusal=refusal)


def read_inspection(store: Store, run: int) -> Inspection:
    """The answer of an inspection that came to a verdict."""
    with store.read() as connection:

        def select(table: str, order: str, **key: Any) -> list[dict[str, Any]]:
            return list_rows(store.select(connection, table, order=order, run_id=run, **key))

        (row,) = select("inspection", "run_id")
        weighed = {it["name"]: it["value"] for it in select("verdict_statistic", "name")}
        sentences = select("inspection_sentence", "kind sentence_no")
        said = {kind: [it["sentence"] for it in sentences if it["kind"] == kind] for kind in ("missing", "note")}
        hypotheses = [_with_pose(it, "world_from_rig", "cost") for it in select("hypothesis", "hypothesis_no")]
        best = hypotheses[0]["world_from_rig"] if hypotheses else None
        cameras = store.rows(connection, "result/camera", run_id=run)
        moved: dict[str, list[float]] = {}
        for it in select("camera_unknown", "camera"):
            if it["name"] in PLACE:
                moved.setdefault(it["camera"], [0.0] * 6)[PLACE.index(it["name"])] = it["value"]
        used = {it["camera"] for it in select("hypothesis_support", "camera", hypothesis_no=0)}
        shown = [it["shown"] for it in select("selected_part", "occurrence_id")]
        timings: dict[str, float] = {}
        for it in select("run_event", "event_no", kind="step"):
            timings[it["name"]] = round(timings.get(it["name"], 0.0) + it["seconds"], 4)
        return Inspection(
            run=run,
            outcome=read_outcome(store, connection, run),
            reason=row["reason"],
            posterior=row["posterior"],
            missing=said["missing"],
            needs={"translation_mm": row["needs_translation_mm"], "rotation_deg": math.degrees(row["needs_rotation"])},
            sigma={
                "translation_mm": weighed.get("sigma_mm", math.inf),
                "rotation_deg": math.degrees(weighed.get("sigma_rad", math.inf)),
            },
            weakest=row["weakest"],
            world_from_rig=best,
            world_from_camera={
                c.camera: None
                if best is None
                else perturb(best @ matrices(c._mapping), np.array(moved.get(c.camera, [0.0] * 6)))
                for c in cameras
                if c.camera in used or not used
            },
            covariance=None if best is None else np.reshape(row["covariance"], (6, 6)),
            base_corrections=[
                _base_correction(it, select("joint_correction", "joint", base_no=it.base_no))
                for it in store.rows(connection, "result/base_correction", run_id=run)
            ],
            parts_in_view=[
                {**_some(it, "path level"), "visible_share": round(it["visible_pixels"] / it["covered_pixels"], 4)}
                for it in select("part_in_view", "in_view_no")
            ],
            presence=_presence(store, connection, run) if best is not None and row["verdict"] != "refused" else None,
            characteristics=[
                it._asdict()
                for it in store.rows(connection, "result/characteristic", run_id=run)
                if it.source or it.measured is not None
            ],
            variants=[
                _some(it._asdict(), "object variant placed against")
                | {"log_odds": round(it.log_odds, 3), "of": it.decided}
                | {"distinguished_by": list(it.distinguished_by or ())}
                for it in store.rows(connection, "result/variant_evidence", run_id=run)
            ],
            considered=[
                _with_pose(it._asdict(), "object_from_rig", "object variant state score verdict posterior")
                for it in store.rows(connection, "result/considered_object", run_id=run)
            ],
            selection={"parts": len(shown), "superfluous": shown.count(False)},
            hypotheses=hypotheses,
            equivalent=[_pose(it) for it in select("solved_pose", "solved_no", kind="equivalent")],
            standpoints=[
                _with_pose(it, "world_from_rig", "name carrier ignored")
                | {"moved": None if it["moved"] is None else np.asarray(it["moved"]), "sigmas": it["sigmas"]}
                for it in select("standpoint", "standpoint_no")
            ],
            notes=said["note"],
            timings_s=timings,
        )


def _pose(row: Mapping[str, Any]) -> Any:
    """The transform (4, 4) of a row, None where it has none."""
    return None if row["m00"] is None else matrices({name: row[name] for name in MATRIX_COLUMNS})


def _some(row: Mapping[str, Any], names: str) -> dict[str, Any]:
    return {name: row[name] for name in names.split()}


def _with_pose(row: Mapping[str, Any], name: str, names: str) -> dict[str, Any]:
    return {name: _pose(row), **_some(row, names)}


# The tables of an assessment, and the order of their rows.
_PRESENCE = {
    "presence": "item_no",
    "presence_camera": "item_no camera",
    "measured_size": "measure_no",
    "unexplained": "unexplained_no",
}


def _presence(store: Store, connection: Connection, run: int) -> dict[str, Any]:
    return describe({it: store.select(connection, it, order=order, run_id=run) for it, order in _PRESENCE.items()})


def _base_correction(row: Any, joints: list[dict[str, Any]]) -> dict[str, Any]:
    return {
        "carrier": f"{row.object}/{row.robot}" if row.robot else row.object,
        "world_from_object": matrices(row._mapping),
        "shift_mm": [row.shift_x, row.shift_y, row.shift_z],
        "turn_rad": [row.turn_x, row.turn_y, row.turn_z],
        "covariance": np.reshape(row.covariance, (6, 6)),
        "joints": {it["joint"]: it["value"] for it in joints},
        "joint_sigmas": {it["joint"]: it["sigma"] for it in joints if not math.isnan(it["sigma"])},
        "stated_joints": {it["joint"]: it["stated_value"] for it in joints},
        "joint_units": {it["joint"]: it["unit"] for it in joints},
    }
