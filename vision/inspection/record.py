"""Everything an inspection saw and decided, as rows of the store."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import asdict, dataclass, fields, is_dataclass

import numpy as np
from sqlalchemy import Connection

from relmodel.arrays import Floats, Ragged
from relmodel.geometry.transforms import matrix_columns
from relmodel.store import Run
from relmodel.world.kinematics import Correction
from vision.cameras.cameras import Needs, Prior, Rig, Selection, perturb
from vision.cameras.record import record_rig
from vision.constellations.find_poses import record_relations
from vision.inspection.against import ComparedObject, record_comparisons
from vision.inspection.inspection_parameters import InspectionParameters
from vision.inspection.locate import Location
from vision.inspection.pictures import Quality, SeenPicture
from vision.localisation.hypotheses import Stage
from vision.localisation.localise import Localisation, View
from vision.localisation.measurements import describe_unknowns
from vision.localisation.refine import Explanation, LastStep, Refined
from vision.localisation.views import KINDS, NO_RUN, SILHOUETTE
from vision.localisation.visibility import PART, PartsInView
from vision.matching import REASONS, MatchedView, PoseProblemParameters
from vision.presence.report import VariantEvidence, record_presence, record_variants
from vision.presence.states import Presence
from vision.relations.relations import solved_rows
from vision.scene import StoredScene
from vision.stereo.match import StereoMatches, record_stereo

STEREO = 0  # number of the stereo problem of a run


@dataclass(frozen=True)
class Result:
    """What an inspection was given and found.

    serial: of the physical part, where one was given; prior: where the rig was thought to be; pictures, quality and
    matched: by camera; parts and presence: None where nothing is in view or the pose is refused; variants: where they
    were weighed; considered: where no world was given.
    """

    serial: str | None
    rig: Rig
    prior: Prior
    needs: Needs
    pictures: dict[str, SeenPicture]
    quality: dict[str, Quality]
    stereo: StereoMatches | None
    location: Location
    matched: dict[str, MatchedView]
    correction: Correction | None
    parts: PartsInView | None
    presence: Presence | None
    variants: list[VariantEvidence]
    considered: list[ComparedObject]

    @property
    def found(self) -> Localisation:
        return self.location.found

    @property
    def stored(self) -> StoredScene:
        return self.location.target.stored

    @property
    def selection(self) -> Selection:
        return self.location.target.selection


def record_inspection(run: Run, connection: Connection, it: Result, p: PoseProblemParameters, *, full: bool) -> None:
    """Append the rows of an inspection within the transaction of `connection`: all, or unless `full` what was decided
    without the views, correspondences, measurements and stereo matches that it rests on.  p: by which the views were
    matched."""
    _record_verdict(run, connection, it)
    views = it.found.views if full else {}
    view_no = {name: number for number, name in enumerate(views)}
    for number, (name, picture) in enumerate(it.pictures.items()):
        run.append(
            connection,
            "inspection_image",
            {
                "run_id": [run.id],
                "camera": name,
                "camera_no": number,
                "image_id": picture.image_id,
                "extraction_id": picture.recorded.extraction_id,
                "view_no": view_no.get(name),
                "edges": it.quality[name].edges,
                "blur_px": np.ma.masked_invalid([it.quality[name].blur_px]),
                "saturated": it.quality[name].saturated,
                "stale_run_id": it.quality[name].stale_run,
            },
        )
    if full and it.stereo is not None:
        units, labels = (it.pictures[name].recorded.unit_set_id for name in it.stereo.rectification.cameras)
        record_stereo(run, connection, STEREO, units, labels, it.stereo)
        record_relations(run, connection, STEREO, it.location.relations)
    _record_hypotheses(run, connection, it.found.hypotheses)
    for number, (name, view) in enumerate(views.items()):
        _record_view(run, connection, number, view, it.stored)
        record_match(run, connection, number, it.pictures[name].recorded.unit_set_id, it.matched[name], it.stored, p)
    if it.correction is not None:
        _record_correction(run, connection, it.correction)
    if it.parts is not None:
        run.append(
            connection,
            "part_in_view",
            {
                "run_id": run.id,
                "in_view_no": np.arange(len(it.parts.path)),
                "occurrence_id": it.parts.occurrence_id,
                "feature_no": np.ma.masked_equal(it.parts.feature_no, PART),
                "level": it.parts.level,
                "path": it.parts.path,
                "visible_pixels": it.parts.visible,
                "covered_pixels": it.parts.covered,
            },
        )
    if it.presence is not None:
        record_presence(run, connection, it.stored, it.presence)
    record_variants(run, connection, it.variants)
    record_comparisons(run, connection, it.considered)


def _record_verdict(run: Run, connection: Connection, it: Result) -> None:
    verdict, best = it.found.verdict, it.found.best
    run.append(
        connection,
        "inspection",
        {
            "run_id": [run.id],
            "world_id": it.stored.world_id,
            "serial": [it.serial],
            "rig_id": record_rig(run, connection, it.rig),
            **({} if it.prior.is_open else matrix_columns(it.prior.world_from_rig)),
            "prior_covariance": Ragged.pack([None if it.prior.is_open else it.prior.covariance]),
            "needs_translation_mm": it.needs.translation_mm,
            "needs_rotation": it.needs.rotation,
            "verdict": verdict.verdict,
            "reason": verdict.reason,
            "posterior": verdict.posterior,
            "covariance": Ragged.pack([best.covariance if best else None]),
            "singular_values": Ragged.pack([_singular_values(best) if best else None]),
        },
    )
    run.append(
        connection,
        "selected_part",
        {"run_id": run.id, "occurrence_id": it.selection.occurrence_id, "shown": it.selection.shown},
    )


def _record_hypotheses(run: Run, connection: Connection, hypotheses: list[Refined]) -> None:
    if not hypotheses:
        return
    run.append(
        connection,
        "hypothesis",
        {
            "run_id": run.id,
            "hypothesis_no": np.arange(len(hypotheses)),
            **matrix_columns([h.world_from_rig for h in hypotheses]),
            "cost": np.array([h.cost for h in hypotheses]),
            "evidence_ratio": np.array(
                [h.support.found.sum() / max(h.support.expected.sum(), 1e-9) for h in hypotheses]
            ),
            "outline_length": np.array([h.outlines.total_px if h.outlines else 0.0 for h in hypotheses]),
            "outline_contrast": np.array([h.outlines.mean if h.outlines else 0.0 for h in hypotheses]),
            "outline_evidence": np.array([h.outlines.evidence if h.outlines else 0.0 for h in hypotheses]),
            "distance": np.ma.masked_invalid([h.prior_sigma for h in hypotheses]),
            "is_symmetric": np.array([h.is_symmetric for h in hypotheses]),
            "relational_distance": np.ma.masked_invalid([h.relational_distance for h in hypotheses]),
        },
    )


def _record_view(run: Run, connection: Connection, number: int, view: View, stored: StoredScene) -> None:
    arcs, measured = view.arcs, view.measurements
    key = {"run_id": run.id, "view_no": number}
    outline = arcs.kind == SILHOUETTE
    run.append(
        connection,
        "view_arc",
        {
            **key,
            "view_arc_no": np.arange(len(arcs.kind)),
            "occurrence_id": stored.occurrence_id[arcs.occurrence],
            "kind": [KINDS[k] for k in arcs.kind],
            # A silhouette is no arc of the model: it is of a surface.
            "arc_no": np.ma.masked_array(stored.arc_no[np.where(outline, 0, arcs.element)], outline),
            "surface_no": np.ma.masked_array(stored.surface_no[np.where(outline, arcs.element, 0)], ~outline),
            "length": arcs.length,
        },
    )
    run.append(
        connection,
        "edge_measurement",
        {
            **key,
            "measurement_no": np.arange(len(measured.view_arc)),
            "view_arc_no": np.ma.masked_equal(measured.view_arc, NO_RUN),
            "world_x": measured.world[:, 0],
            "world_y": measured.world[:, 1],
            "world_z": measured.world[:, 2],
            "normal_u": measured.normal[:, 0],
            "normal_v": measured.normal[:, 1],
            "u": measured.position[:, 0],
            "v": measured.position[:, 1],
            "sigma": measured.sigma,
            "weight": measured.weight,
            "residual": measured.residual,
            "response": measured.response,
            "arc_shift": measured.arc_shift,
            "scene_arc": measured.arc,
        },
    )


def _record_correction(run: Run, connection: Connection, it: Correction) -> None:
    run.append(
        connection,
        "base_correction",
        {
            "run_id": [run.id],
            "object_no": it.mounted.object_no,
            "robot": it.mounted.robot,
            **matrix_columns(it.world_from_object),
            **{f"shift_{axis}": float(value) for axis, value in zip("xyz", it.shift, strict=True)},
            **{f"turn_{axis}": float(value) for axis, value in zip("xyz", it.turn, strict=True)},
            "covariance": Ragged.pack([it.covariance]),
        },
    )
    names = list(it.joints)
    if names:
        run.append(
            connection,
            "joint_correction",
            {
                "run_id": run.id,
                "joint": names,
                "stated_value": [it.mounted.joints[name] for name in names],
                "prior_sigma": [it.prior_sigmas.get(name) for name in names],
                "value": [it.joints[name] for name in names],
                "sigma": [it.joint_sigmas.get(name) for name in names],
            },
        )


def _singular_values(refined: Refined) -> Floats:
    """Singular values (6,) of what was measured, whitened, with a turn of 1 mrad scaled against a shift of 1 mm."""
    m = refined.measurements
    scaled = m.jacobian[:, :6] * (np.sqrt(m.weight) / m.sigma)[:, None] * np.repeat([1.0, 1e-3], 3)
    return np.linalg.svd(scaled, compute_uv=False)


# A picture matched against a view, as rows of the store.

BEST = 0  # number of the hypothesis that views and correspondences belong to
FIRST_OF_VIEWS = 1  # number of the first view's problem, after that of stereo


def record_match(
    run: Run,
    connection: Connection,
    view_no: int,
    units_id: int,
    matched: MatchedView,
    stored: StoredScene,
    p: PoseProblemParameters,
) -> None:
    """Append the units of a view with their relations, the pairs that were considered, and the problem with the
    tree of its search.  units_id: the set of the picture's units."""
    key, units = {"run_id": run.id, "view_no": view_no}, matched.units
    run.append(connection, "view_point", {**key, **units.points})
    surface = units.surface
    run.append(
        connection,
        "view_surface",
        {
            **key,
            "view_surface_no": np.arange(len(surface)),
            "occurrence_id": stored.occurrence_id[stored.scene.surface_occurrence[surface]],
            "surface_no": stored.surface_no[surface],
        },
    )
    labels_id = int(run.new_ids(connection, "unit_set", 1)[0])
    run.append(connection, "unit_set", {"id": [labels_id], "kind": "view", **key})
    of_arcs, of_surfaces = np.arange(units.arcs), np.arange(len(surface))
    run.append(
        connection,
        "unit",
        {
            "unit_set_id": labels_id,
            "unit_no": np.arange(units.arcs + len(surface)),
            "kind": ["view_arc"] * units.arcs + ["view_surface"] * len(surface),
            "ref_no": np.concatenate([of_arcs, of_surfaces]),
        },
    )
    run.append(connection, "unit_relation", {"unit_set_id": labels_id, **units.relations})
    _record_pairs(run, connection, view_no, matched)
    solved, problem_key = matched.match.solved, {"run_id": run.id, "problem_no": FIRST_OF_VIEWS + view_no}
    for table, columns in solved_rows(solved).items():
        if table == "problem":
            columns = {
                **columns,
                "kind": "localisation",
                "method": "relations",
                "units_id": units_id,
                "labels_id": labels_id,
                "parameters": json.dumps(asdict(p), sort_keys=True),
            }
        run.append(connection, table, {**problem_key, **columns})


def _record_pairs(run: Run, connection: Connection, view_no: int, matched: MatchedView) -> None:
    arcs, surfaces = matched.match.arcs, matched.match.surfaces
    run.append(
        connection,
        "correspondence",
        {
            "run_id": run.id,
            "hypothesis_no": BEST,
            "view_no": view_no,
            "view_arc_no": arcs.view_arc,
            "image_arc_no": arcs.image_arc,
            "accepted": arcs.accepted,
            "reason": [REASONS[r] for r in arcs.reason],
            "residual": arcs.residual,
            "gate": arcs.gate,
            "angle": arcs.angle,
            "angle_gate": arcs.angle_gate,
            "overlap": arcs.overlap,
            "first_point": arcs.first_point,
            "last_point": arcs.last_point,
        },
    )
    run.append(
        connection,
        "surface_match",
        {
            "run_id": run.id,
            "view_no": view_no,
            "view_surface_no": surfaces.view_surface,
            "region_no": surfaces.region,
            "accepted": surfaces.accepted,
            "reason": [REASONS[r] for r in surfaces.reason],
            "pixels": surfaces.pixels,
            "region_share": surfaces.region_share,
            "surface_share": surfaces.surface_share,
        },
    )


# The thresholds of an inspection's decisions and what its verdict weighed, as rows of `threshold`, `verdict_statistic`,
# `hypothesis_support`, `camera_unknown` and `solved_pose`.

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
