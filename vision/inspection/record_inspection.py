"""Everything an inspection saw and decided, as rows of the store."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from sqlalchemy import Connection

from relmodel.arrays import Floats
from relmodel.columns import Ragged
from relmodel.geometry.transforms import matrix_columns
from relmodel.store import Run
from relmodel.world.correction import Correction
from vision.cameras.cameras import Needs, Prior, Rig
from vision.cameras.record_cameras import record_rig
from vision.cameras.view_volume import Selection
from vision.constellations.record_relations import record_relations
from vision.inspection.against import Comparison, record_comparisons
from vision.inspection.locate import Location
from vision.inspection.pictures import SeenPicture
from vision.inspection.quality import Quality
from vision.inspection.record_match import record_match
from vision.localisation.localise import Localisation, View
from vision.localisation.parts_in_view import PART, PartsInView
from vision.localisation.refine import Refined
from vision.localisation.views import KINDS, NO_RUN, SILHOUETTE
from vision.matching.matching_parameters import PoseProblemParameters
from vision.matching.pose_problem import MatchedView
from vision.presence.record_presence import record_presence, record_variants
from vision.presence.states import Presence
from vision.presence.variants import VariantEvidence
from vision.scene.stored_scene import StoredScene
from vision.stereo.match import StereoMatches
from vision.stereo.record_stereo import record_stereo

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
    considered: list[Comparison]

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
