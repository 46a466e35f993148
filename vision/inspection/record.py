"""Everything an inspection saw and decided, as rows of the store."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import asdict, dataclass, fields, is_dataclass

import numpy as np
from sqlalchemy import Connection

from relmodel.arrays import Columns, Floats, Ragged, by_column, fields_of
from relmodel.geometry.transforms import matrix_columns
from relmodel.store import Run
from relmodel.store.runs import Writer
from relmodel.world.kinematics import Correction
from vision.account.runs import EdgeRuns
from vision.cameras.cameras import Needs, Prior, Rig, Selection, perturb, perturbation
from vision.cameras.record import record_rig
from vision.constellations.find_poses import record_relations
from vision.inspection.against import ComparedObject, record_comparisons
from vision.inspection.inspection_parameters import InspectionParameters
from vision.inspection.locate import Location
from vision.inspection.pictures import Quality, SeenPicture
from vision.localisation.hypotheses import Stage
from vision.localisation.localise import Localisation, View
from vision.localisation.measurements import PLACE, UNKNOWNS, describe_unknowns
from vision.localisation.refine import Explanation, LastStep, RefinedPose
from vision.localisation.verdict import compare_standpoints
from vision.localisation.views import KINDS, NO_RUN, SILHOUETTE, ViewPoints
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

    serial: of the physical part, where one was given; prior: where the rig was thought to be; pictures, quality,
    points and matched: by camera, the last where that was asked for; parts and presence: None where nothing is in view
    or the pose is refused; variants: where they were weighed; considered: where no world was given; notes: what was
    taken for given that the inputs do not say."""

    serial: str | None
    rig: Rig
    prior: Prior
    needs: Needs
    pictures: dict[str, SeenPicture]
    quality: dict[str, Quality]
    stereo: StereoMatches | None
    location: Location
    points: dict[str, ViewPoints]
    matched: dict[str, MatchedView]
    corrections: list[Correction]
    parts: PartsInView | None
    presence: Presence | None
    variants: list[VariantEvidence]
    considered: list[ComparedObject]
    notes: list[str]

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
    without the views, correspondences, measurements and stereo matches that it rests on.  p: of matching views."""
    write = run.writer(connection)
    _record_verdict(write, it, record_rig(run, connection, it.rig))
    views = it.found.views if full else {}
    view_no = {name: number for number, name in enumerate(views)}
    for number, (name, picture) in enumerate(it.pictures.items()):
        write(
            "inspection_image",
            camera=name,
            camera_no=number,
            image_id=picture.image_id,
            extraction_id=picture.recorded.extraction_id,
            view_no=view_no.get(name),
            edges=it.quality[name].edges,
            blur_px=np.ma.masked_invalid([it.quality[name].blur_px]),
            saturated=it.quality[name].saturated,
            mosaic=it.quality[name].mosaic,
            stale_run_id=it.quality[name].stale_run,
        )
    if full and it.stereo is not None:
        units, labels = (it.pictures[name].recorded.unit_set_id for name in it.stereo.rectification.cameras)
        record_stereo(run, connection, STEREO, units, labels, it.stereo)
        record_relations(run, connection, STEREO, it.location.relations)
    if it.rig.moved is not None:
        rigs = [of.rig or it.rig.moved for of in it.rig.standpoints.values()]
        _record_standpoints(write, it, [record_rig(run, connection, rig) for rig in rigs])
    if it.found.hypotheses:
        _record_hypotheses(write, it.found.hypotheses)
    for number, (name, view) in enumerate(views.items()):
        edges = None if it.location.account is None else it.location.account.runs
        _record_view(write, number, view, it.points[name], edges, it.stored)
        if name in it.matched:
            units_id = it.pictures[name].recorded.unit_set_id
            record_match(run, connection, number, units_id, it.matched[name], it.stored, p)
    if it.matched:
        write("threshold", **by_column("decision name value", [("correspondence", *each) for each in _numbers(p)]))
    for number, correction in enumerate(it.corrections):
        _record_correction(write, number, correction)
    if it.parts is not None:
        write(
            "part_in_view",
            in_view_no=np.arange(len(it.parts.path)),
            feature_no=np.ma.masked_equal(it.parts.feature_no, PART),
            visible_pixels=it.parts.visible,
            covered_pixels=it.parts.covered,
            **fields_of(it.parts, "occurrence_id level path"),
        )
    if it.presence is not None:
        record_presence(write, it.stored, it.presence)
    record_variants(write, it.variants)
    record_comparisons(write, it.considered)


def _record_verdict(write: Writer, it: Result, rig_id: int) -> None:
    verdict, best = it.found.verdict, it.found.best
    write(
        "inspection",
        world_id=it.stored.world_id,
        serial=it.serial,
        rig_id=rig_id,
        **({} if it.prior.is_open else matrix_columns(it.prior.world_from_rig)),
        prior_covariance=Ragged.pack([None if it.prior.is_open else it.prior.covariance]),
        needs_translation_mm=it.needs.translation_mm,
        needs_rotation=it.needs.rotation,
        covariance=Ragged.pack([best.covariance if best else None]),
        singular_values=Ragged.pack([_singular_values(best) if best else None]),
        weakest=verdict.weakest if best else None,
        **fields_of(verdict, "verdict reason posterior"),
    )
    said = [("missing", words) for words in verdict.missing] + [("note", words) for words in it.notes]
    said += [("rig", verdict.rig)] if verdict.rig else []
    write("inspection_sentence", sentence_no=np.arange(len(said)), **by_column("kind sentence", said))
    write("selected_part", **fields_of(it.selection, "occurrence_id shown"))


def _record_standpoints(write: Writer, it: Result, rig_ids: list[int]) -> None:
    best, stated = it.found.best, it.rig.standpoints
    solved = {} if best is None else compare_standpoints(it.found.rig, best)
    each = [(one, solved.get(name)) for name, one in stated.items()]
    write(
        "standpoint",
        standpoint_no=np.arange(len(each)),
        name=list(stated),
        rig_id=rig_ids,
        carrier=[one.carrier or None for one in stated.values()],
        ignored=[one.ignored for one in stated.values()],
        joints=[json.dumps(dict(one.joints), sort_keys=True) for one in stated.values()],
        **matrix_columns([one.world_from_rig for one in stated.values()]),
        covariance=Ragged.pack([one.covariance for one in stated.values()]),
        sway=Ragged.pack([one.sway for one in stated.values()]),
        moved=Ragged.pack([None if found is None else found.moved for _, found in each]),
        covariance_left=Ragged.pack([None if found is None else found.covariance for _, found in each]),
        sigmas=[None if found is None else found.misfit.sigmas for _, found in each],
    )


def _record_hypotheses(write: Writer, hypotheses: list[RefinedPose]) -> None:
    write(
        "hypothesis",
        hypothesis_no=np.arange(len(hypotheses)),
        **matrix_columns([h.world_from_rig for h in hypotheses]),
        cost=[h.cost for h in hypotheses],
        evidence_ratio=[h.support.found.sum() / max(h.support.expected.sum(), 1e-9) for h in hypotheses],
        outline_length=[h.outlines.total_px if h.outlines else 0.0 for h in hypotheses],
        outline_contrast=[h.outlines.mean if h.outlines else 0.0 for h in hypotheses],
        outline_evidence=[h.outlines.evidence if h.outlines else 0.0 for h in hypotheses],
        distance=np.ma.masked_invalid([h.prior_sigma for h in hypotheses]),
        is_symmetric=[h.is_symmetric for h in hypotheses],
        account_log_odds=np.ma.masked_invalid([h.told for h in hypotheses]),
    )


def _record_view(
    write: Writer, number: int, view: View, points: ViewPoints, edges: EdgeRuns | None, stored: StoredScene
) -> None:
    """Append what a camera should see; edges: the account of it, where one was taken."""
    arcs, measured = view.arcs, view.measurements
    account = np.full((4, len(arcs.kind)), np.nan)
    if edges is not None:
        own = edges.take(np.flatnonzero(edges.camera == number))
        account[:, own.view_run] = own.weight_px, own.found * own.weight_px, own.shows, own.log_odds
    outline = arcs.kind == SILHOUETTE
    write(
        "view_arc",
        view_no=number,
        view_arc_no=np.arange(len(arcs.kind)),
        occurrence_id=stored.occurrence_id[arcs.occurrence],
        kind=[KINDS[k] for k in arcs.kind],
        # A silhouette is no arc of the model: it is of a surface.
        arc_no=np.ma.masked_array(stored.arc_no[np.where(outline, 0, arcs.element)], outline),
        surface_no=np.ma.masked_array(stored.surface_no[np.where(outline, arcs.element, 0)], ~outline),
        length=arcs.length,
        **dict(zip(("distinct_px", "supported_px", "shows", "log_odds"), np.ma.masked_invalid(account), strict=True)),
    )
    write("view_point", view_no=number, **points.rows)
    places = {"world_x world_y world_z": measured.world, "normal_u normal_v": measured.normal, "u v": measured.position}
    write(
        "edge_measurement",
        view_no=number,
        measurement_no=np.arange(len(measured.view_arc)),
        view_arc_no=np.ma.masked_equal(measured.view_arc, NO_RUN),
        **{name: place[:, k] for names, place in places.items() for k, name in enumerate(names.split())},
        scene_arc=measured.arc,
        **fields_of(measured, "sigma weight residual response arc_shift"),
    )


def _record_correction(write: Writer, number: int, it: Correction) -> None:
    write(
        "base_correction",
        base_no=number,
        object_no=it.mounted.object_no,
        robot=it.mounted.robot,
        **matrix_columns(it.world_from_object),
        **{f"shift_{axis}": float(value) for axis, value in zip("xyz", it.shift, strict=True)},
        **{f"turn_{axis}": float(value) for axis, value in zip("xyz", it.turn, strict=True)},
        covariance=Ragged.pack([it.covariance]),
    )
    names = list(it.joints)
    write(
        "joint_correction",
        base_no=number,
        joint=names,
        stated_value=[it.mounted.joints[name] for name in names],
        prior_sigma=[it.prior_sigmas.get(name) for name in names],
        value=[it.joints[name] for name in names],
        sigma=[it.joint_sigmas.get(name) for name in names],
        unit=[it.mounted.unit(name) for name in names],
    )


def _singular_values(refined: RefinedPose) -> Floats:
    """Singular values (6,) of what was measured, whitened, with a turn of 1 mrad scaled against a shift of 1 mm."""
    m = refined.measurements
    scaled = m.jacobian[:, :6] * (np.sqrt(m.weight) / m.sigma)[:, None] * np.repeat([1.0, 1e-3], 3)
    return np.linalg.svd(scaled, compute_uv=False)


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
    write, units, surface = run.writer(connection), matched.units, matched.units.surface
    write(
        "view_surface",
        view_no=view_no,
        view_surface_no=np.arange(len(surface)),
        occurrence_id=stored.occurrence_id[stored.scene.surface_occurrence[surface]],
        surface_no=stored.surface_no[surface],
    )
    labels_id = int(run.new_ids(connection, "unit_set", 1)[0])
    write("unit_set", id=[labels_id], kind="view", view_no=view_no)
    numbers = {"view_arc": np.arange(units.arcs), "view_surface": np.arange(len(surface))}
    columns: Columns = {
        "unit_set_id": labels_id,
        "unit_no": np.arange(units.arcs + len(surface)),
        "kind": [kind for kind, those in numbers.items() for _ in those],
        "ref_no": np.concatenate(list(numbers.values())),
    }
    run.append(connection, "unit", columns)
    run.append(connection, "unit_relation", {"unit_set_id": labels_id, **units.relations})
    arcs, surfaces = matched.match.arcs, matched.match.surfaces
    write(
        "correspondence",
        hypothesis_no=BEST,
        view_no=view_no,
        view_arc_no=arcs.view_arc,
        image_arc_no=arcs.image_arc,
        reason=[REASONS[r] for r in arcs.reason],
        **fields_of(arcs, "accepted residual gate angle angle_gate overlap first_point last_point"),
    )
    write(
        "surface_match",
        view_no=view_no,
        view_surface_no=surfaces.view_surface,
        region_no=surfaces.region,
        reason=[REASONS[r] for r in surfaces.reason],
        **fields_of(surfaces, "accepted pixels region_share surface_share"),
    )
    tables = solved_rows(matched.match.solved)
    tables["problem"] = {
        **tables["problem"],
        "kind": "localisation",
        "method": "relations",
        "units_id": units_id,
        "labels_id": labels_id,
        "parameters": json.dumps(asdict(p), sort_keys=True),
    }
    for table, found in tables.items():
        write(table, problem_no=FIRST_OF_VIEWS + view_no, **found)


def record_decisions(
    write: Writer, rig: Rig, prior: Prior, needs: Needs, found: Localisation, p: InspectionParameters
) -> None:
    """Append the thresholds of an inspection's decisions and what its verdict weighed."""
    compared = {"verdict": p.localisation.verdict, "stereo": p.stereo, "presence": p.presence, "picture": p.pictures}
    rows = [(decision, name, value) for decision, of in compared.items() for name, value in _numbers(of)]
    rows += [("verdict", f"needs_{name}", value) for name, value in _numbers(needs)]
    write("threshold", **by_column("decision name value", rows))
    if found.best is None or found.best.shown is None:
        return
    _record_search(write, prior, found.stages)
    write("verdict_statistic", **by_column("name value", list(found.verdict.weighed.items())))
    cameras, supports = list(rig.cameras), [h.support for h in found.hypotheses]
    columns = {"evidence": "by_camera", "found": "found", "expected": "expected", "length_px": "length_px"}
    write(
        "hypothesis_support",
        hypothesis_no=np.repeat(np.arange(len(supports)), len(cameras)),
        camera=cameras * len(supports),
        **{name: np.concatenate([getattr(it, field) for it in supports]) for name, field in columns.items()},
    )
    unknowns, own = describe_unknowns(rig), found.best.shown.unknowns.copy()
    own[:, PLACE] = found.best.camera_unknowns[:, PLACE]
    if unknowns.bases:  # the pose was found from where pictures of each carrier have its base
        placed = found.rig.rig_from_camera
        own[:, PLACE] = [perturbation(rig.rig_from_camera[name], placed[name]) for name in cameras]
    write(
        "camera_unknown",
        camera=np.repeat(cameras, len(UNKNOWNS)).tolist(),
        name=list(UNKNOWNS) * len(cameras),
        value=own.ravel(),
        expected=unknowns.mean.ravel(),
        sigma=unknowns.sigma.ravel(),
        sigma_shown=found.best.shown.sigma.ravel(),
    )
    _record_solved(write, found, dict(zip(cameras, found.single_cameras, strict=False)))


def _record_search(write: Writer, prior: Prior, stages: list[Stage]) -> None:
    """Append what left each stage of the search, and what became of it."""
    counts = [len(stage.rule) for stage in stages]
    write(
        "search_pose",
        stage_no=np.repeat(np.arange(len(stages)), counts),
        pose_no=np.concatenate([np.arange(count) for count in counts]),
        stage=[stage.name for stage in stages for _ in stage.rule],
        looked_at=np.repeat([stage.looked_at for stage in stages], counts),
        **matrix_columns(list(perturb(prior.world_from_rig, np.concatenate([stage.delta for stage in stages])))),
        score=np.ma.masked_invalid(np.concatenate([stage.score for stage in stages])),
        rule=[rule for stage in stages for rule in stage.rule],
    )


def _record_solved(write: Writer, found: Localisation, by_camera: dict[str, RefinedPose]) -> None:
    """Append the pose before the last step, those of single cameras, and those that explain or see the same."""
    assert found.best is not None
    last, covariance = found.best.last_step, found.hypotheses[0].covariance
    assert last is not None
    equivalent = [Explanation(pose, covariance, 0.0) for pose in found.equivalent]
    others = [*last.explanations, *equivalent]
    kinds = ["explanation"] * len(last.explanations) + ["equivalent"] * len(equivalent)
    poses: list[LastStep | RefinedPose | Explanation] = [last, *by_camera.values(), *others]
    write(
        "solved_pose",
        solved_no=np.arange(len(poses)),
        kind=["start"] + ["single_camera"] * len(by_camera) + kinds,
        camera=[None, *by_camera, *[None] * len(others)],
        **matrix_columns([h.world_from_rig for h in poses]),
        covariance=Ragged.pack([h.covariance for h in poses]),
        log_odds=[None, *(h.evidence for h in by_camera.values()), *(h.log_odds for h in others)],
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
