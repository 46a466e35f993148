"""The main job: from a rig's pictures to the parts in view and the pose of the cameras, every step in the store."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

from sqlalchemy import Connection

from relmodel.arrays import Bytes, Floats
from relmodel.drawing.model_edges import check_crops, write_crops, write_overlay
from relmodel.drawing.strokes import check_writable
from relmodel.errors import UsageError
from relmodel.find.find import world_named
from relmodel.labelling.solve import check_mode
from relmodel.store import Run, Store
from relmodel.store.digests import record_digests
from relmodel.user import user_name
from relmodel.world.correction import Carrier, Correction, correct_base, predict_covariance
from relmodel.world.kinematics import MountedRig, mount_of_rig
from vision.cameras.cameras import DEFAULT_NEEDS, Needs, Prior, Rig
from vision.cameras.files import read_needs, read_prior
from vision.cameras.images import Picture, PictureBytes, describe_reading
from vision.cameras.record_cameras import find_rig
from vision.cameras.rig_pictures import Pictures, digest_given, pictures_as_files, read_rig_with_pictures
from vision.cameras.view_volume import Selection
from vision.extraction import extract as extraction
from vision.inspection.against import Considered, Recognised, place_candidates, recognise
from vision.inspection.inspection_parameters import DEFAULTS, InspectionParameters
from vision.inspection.locate import Sight, select_parts
from vision.inspection.matched_views import match_views
from vision.inspection.memory import return_memory
from vision.inspection.outcome import Outcome, read_outcome
from vision.inspection.pictures import extract_pictures
from vision.inspection.quality import doubt_pictures, find_faults, measure_quality
from vision.inspection.record_decisions import record_decisions
from vision.inspection.record_inspection import Inspected, record_inspection
from vision.inspection.variants import is_to_be_weighed, weigh_variants
from vision.localisation.coverage import map_views
from vision.localisation.localise import Localisation
from vision.localisation.parts_in_view import PartsInView, find_parts_in_view
from vision.presence.assess import assess
from vision.presence.report import describe
from vision.presence.states import Presence
from vision.presence.variants import VariantEvidence
from vision.scene.kept_scenes import Scenes
from vision.stereo.match import StereoMatches, check_method, match_stereo
from vision.stereo.rectification import choose_pair

# The kernels of an inspection.
KERNELS = (
    "relmodel.find.rtree_kernels",
    *extraction.KERNELS,
    "vision.stereo.epipolar_kernels",
    "vision.constellations.ellipse_kernels",
    "relmodel.labelling.dual_kernels",
    "relmodel.labelling.search_kernels",
    "relmodel.labelling.soft_kernels",
    "vision.localisation.search_kernels",
    "vision.localisation.measure_kernels",
    "vision.localisation.coverage_kernels",
    "vision.presence.nearby_kernels",
    "vision.presence.displacement_kernels",
)
PACKAGES = ("duckdb", "embreex", "numba", "numpy", "opencv-python-headless", "scipy", "sqlalchemy")


@dataclass(frozen=True)
class Inspection:
    """The answer of an inspection; transforms are 4x4, mm, of the best hypothesis whatever the verdict, and None only
    where nothing is in view.

    outcome: whether the pose may be used and how the part is, as the store has it.
    posterior: probability that the best hypothesis is the right one.  missing: what was missing for acceptance, a
    sentence each.  needs: how exactly the pose was needed.  sigma_mm, sigma_rad: standard deviations of the pose along
    the worst directions, of the point in the middle of what is seen and of rotation; weakest: those directions.
    covariance: (6, 6) of a right perturbation of world_from_rig in the rig's frame, t mm then r rad.
    base_correction: what the pose says of the object that the world mounts the rig on; None where it is not accepted or
    the rig not mounted.
    presence: evidence for what is in view; None where the pose is refused.
    variants: evidence for each loaded variant of the inspected objects, the likeliest first, where it was weighed.
    considered: the loaded objects that the pictures were compared with where no world was given, what is shown first;
    all else is then of the first, in a world where it stands alone at its origin.
    selection: the placed parts that any pose which the prior leaves open could show, all where there is none; nothing
    else was considered.
    hypotheses: (world_from_rig, cost) of the poses considered, the best first.  equivalent: poses of the rig, beside
    the best, from which a symmetric model looks the same.
    notes: what was taken for given that the inputs do not say, of the pictures and of the prior, a sentence each.
    """

    run: int
    outcome: Outcome
    reason: str
    posterior: float
    missing: list[str]
    needs: Needs
    sigma_mm: float
    sigma_rad: float
    weakest: str
    world_from_rig: Floats | None
    world_from_camera: dict[str, Floats | None]
    covariance: Floats | None
    base_correction: Correction | None
    parts_in_view: list[dict[str, Any]]
    presence: Presence | None
    variants: list[VariantEvidence]
    considered: list[Considered]
    selection: Selection
    hypotheses: list[tuple[Floats, float]]
    equivalent: list[Floats]
    notes: list[str]
    timings_s: dict[str, float] = field(compare=False)

    @property
    def verdict(self) -> str:
        """accepted, ambiguous or refused: of the pose."""
        return self.outcome.verdict

    def to_json(self) -> dict[str, Any]:
        """The answer in plain lists and numbers, under the names of the fields; of the selection, how many."""

        def plain(matrix: Floats | None) -> list[list[float]] | None:
            return None if matrix is None else matrix.tolist()

        return {
            "run": self.run,
            "verdict": self.verdict,
            "outcome": self.outcome.to_json(),
            "reason": self.reason,
            "posterior": self.posterior,
            "missing": self.missing,
            "needs": {
                "translation_mm": self.needs.translation_mm,
                "rotation_deg": math.degrees(self.needs.rotation),
            },
            "sigma": {
                "translation_mm": _stated(self.sigma_mm),
                "rotation_deg": _stated(math.degrees(self.sigma_rad)),
            },
            "weakest": self.weakest,
            "world_from_rig": plain(self.world_from_rig),
            "world_from_camera": {name: plain(pose) for name, pose in self.world_from_camera.items()},
            "covariance": plain(self.covariance),
            "base_correction": None if self.base_correction is None else self.base_correction.to_json(),
            "parts_in_view": self.parts_in_view,
            "presence": None if self.presence is None else describe(self.presence),
            "variants": [variant.to_json() for variant in self.variants],
            "considered": [it.to_json() for it in self.considered],
            "selection": {"parts": len(self.selection.shown), "superfluous": self.selection.superfluous},
            "hypotheses": [{"world_from_rig": plain(pose), "cost": cost} for pose, cost in self.hypotheses],
            "equivalent": [plain(pose) for pose in self.equivalent],
            "notes": self.notes,
            "timings_s": {name: round(seconds, 4) for name, seconds in self.timings_s.items()},
        }


def _stated(value: float) -> float | None:
    """A number as JSON has it: none where nothing is known."""
    return value if math.isfinite(value) else None


def inspect(
    store: Store,
    *,
    rig: str | Path,
    pictures: Pictures,
    prior: str | Path | None = None,
    needs: Needs | None = None,
    world: str | None = None,
    against: Sequence[str] | None = None,
    carrier: Carrier | None = None,
    serial: str | None = None,
    operator: str | None = None,
    keep_images: bool = True,
    full_audit: bool = True,
    variants: bool | None = None,
    overlay: str | Path | None = None,
    crops: str | Path | None = None,
    parameters: InspectionParameters = DEFAULTS,
    scenes: Scenes | None = None,
) -> Inspection:
    """Inspect the pictures that one or more cameras of a rig took together, against a world of the store.

    rig, prior: files, the rig in any format of `read_rig`; without a prior the rig is taken to be where the joints of
    what carries it put it, and where the world does not mount it several pictures are located by the circles that
    stereo finds, one by its ellipses, wherever in the world they were taken; pictures: by the names of their cameras,
    up to sixteen, files or arrays (grey, RGB or RGBA, of bytes, of 16 bits, or of floats from 0 to 1), or one alone
    where the rig has one camera; against: names of loaded objects, all where there are none, to say which of them the
    pictures show, with no world and no prior; needs: how exactly the pose is needed, else as the prior file says, else
    the default; world: its name, where the store has several; carrier: how the object stands that carries the rig,
    which is found by the rig's content; serial: the number of the physical part, by which the evidence of all its
    inspections adds up; operator: who makes it, else the user of this machine; variants: whether to weigh all loaded
    variants of the inspected objects at the pose found, None where something is not as the model says and they are
    few; overlay: a picture of the model drawn over the images, to be written; crops: a folder for pictures of what is
    not as the model says, worst first; full_audit: whether the rows that explain the decisions are kept, and not the
    decisions alone; scenes: those that earlier inspections of the store left, for more of them in a row. The run
    records the parameters, defaults included.

    Raises InputError for bad inputs, UsageError where several objects carry the rig and `carrier` does not choose; the
    run then ended as failed, and the store is otherwise as it was.
    """
    if (overlay or crops) and not full_audit:
        raise UsageError("overlay and crops are drawn from rows that a minimal audit leaves out: leave out one of both")
    if overlay is not None:
        check_writable(overlay)
    if crops is not None:
        check_crops(crops)
    files = pictures_as_files(pictures)
    carrier = carrier or Carrier()
    if against is None:
        with store.read() as connection:
            world_id, world_name = world_named(store, connection, world)
        if world_id < 0:
            raise UsageError("the store holds no world: place the objects with relmodel world FILE")
    else:
        world_id, world_name, against = -1, "", tuple(against)
        given = (prior, world, variants, parameters.believe_pictures or None)
        if carrier.is_given or any(it is not None for it in given):
            raise UsageError(
                "pictures compared with loaded objects have no world, prior or arm, and weigh all variants: leave out "
                "what says otherwise, or leave out against"
            )
    return_memory()
    request = Request(
        world_id,
        world_name,
        against,
        carrier,
        serial,
        operator or user_name(),
        keep_images,
        full_audit,
        variants,
    )
    with (
        store.one_thread(),
        Run.begin(
            store,
            "inspect",
            {**request.parameters(), **asdict(parameters)},
            inputs=digest_given(files, rig, prior),
            packages=PACKAGES,
        ) as run,
    ):
        inputs = _read_inputs(Path(rig), files, None if prior is None else Path(prior), needs, parameters)
        run.step("read")
        answer = carry_out(scenes or Scenes(store), run, request, inputs, parameters)
        greys = {name: inputs.pictures[name].grey for name in answer.world_from_camera}
        if overlay is not None:
            write_overlay(overlay, store, run.id, greys)
        if crops is not None:
            write_crops(crops, store, run.id, greys)
        return answer


@dataclass(frozen=True)
class Request:
    """A world of the store, how the object in it stands that carries the rig, and what is kept."""

    world_id: int
    world: str
    against: tuple[str, ...] | None
    carrier: Carrier
    serial: str | None
    operator: str | None
    keep_images: bool
    full_audit: bool
    variants: bool | None

    def parameters(self) -> dict[str, Any]:
        """What a run records of it."""
        return {name: value for name, value in asdict(self).items() if name != "world_id"}


@dataclass(frozen=True)
class _Found:
    """What an inspection found by some cameras from a prior, with some parameters, and whether all that it rests on is
    kept."""

    it: Inspected
    rig: Rig
    prior: Prior
    parameters: InspectionParameters
    full: bool

    def record(self, run: Run, connection: Connection) -> None:
        """Append it and end the run."""
        it, p = self.it, self.parameters
        record_inspection(run, connection, it, full=self.full)
        record_decisions(run, connection, self.rig, self.prior, it.needs, it.found, p)
        record_digests(run, connection)
        run.finish(it.found.verdict.reason, connection, last="record")


@dataclass(frozen=True)
class Inputs:
    """What an inspection is given: a rig, a picture of each of its cameras that took one, where the rig is thought to
    be, where that is known, how exactly its pose is needed, and what of the world to look for, where that is known."""

    rig: Rig
    pictures: dict[str, Picture]
    prior: Prior | None
    needs: Needs
    selection: Selection | None = None


def _read_inputs(
    rig: Path,
    files: dict[str, Path | PictureBytes],
    prior: Path | None,
    needs: Needs | None,
    parameters: InspectionParameters,
) -> Inputs:
    check_mode(parameters.matching.pose.search)
    check_method(parameters.stereo)
    whole, pictures = read_rig_with_pictures(rig, files)
    choose_pair(whole.only(*pictures))  # refuses cameras that all are at one place
    needs = needs or (read_needs(prior) if prior is not None else None) or DEFAULT_NEEDS
    return Inputs(whole, pictures, None if prior is None else read_prior(prior), needs)


def carry_out(
    scenes: Scenes, run: Run, request: Request, inputs: Inputs, parameters: InspectionParameters
) -> Inspection:
    """Inspect what was read, within a run."""
    store, call, pictures, needs = scenes.store, request, inputs.pictures, inputs.needs
    cameras = inputs.rig.only(*pictures)
    mounted = believed = selected = None
    among = [] if call.against is None else place_candidates(store, run, call.against)
    scenes.keep_only({call.world_id, *(it.world_id for it in among)})
    if call.against is None:
        mounted = _mounted(store, call.world_id, inputs.rig, call.carrier)
        believed = inputs.prior
        if believed is None and mounted is not None:
            believed = Prior(mounted.world_from_rig, predict_covariance(mounted, call.carrier))
        selected = select_parts(
            scenes, call.world_id, call.world, cameras, believed, parameters.selection, inputs.selection
        )
    run.step("select")

    seen = extract_pictures(run, pictures, parameters.extraction, keep_images=call.keep_images)
    primitives = {name: one.primitives for name, one in seen.items()}
    run.step("extract")
    quality = measure_quality(run.id, store, cameras, seen)
    faults = find_faults(quality, run.id, parameters.pictures)
    notes = [fault.words for fault in faults if not fault.refuses]
    run.step("look")
    greys: dict[str, Bytes | Floats] = {name: picture.grey for name, picture in pictures.items()}

    def look(by: Rig) -> tuple[StereoMatches | None, Recognised]:
        """What these cameras show."""
        of = {name: primitives[name] for name in by.cameras}
        pair = choose_pair(by)
        stereo = None if pair is None else match_stereo(by.only(*pair), of[pair[0]], of[pair[1]], parameters.stereo)
        run.step("stereo")
        own = {name: greys[name] for name in by.cameras}
        sight = Sight(run, scenes, call.world_id, call.world, by, of, own, stereo, needs, parameters)
        if selected is None:
            return stereo, recognise(sight, among)
        return stereo, Recognised(sight.locate(selected, believed), [], [])

    blind = {fault.camera: fault.words for fault in faults if fault.refuses}
    is_looked_at = False
    while not is_looked_at:
        if parameters.ignore_blind_camera and 0 < len(blind) < len(cameras.cameras):
            notes += [f"camera {name} is ignored: {words}" for name, words in blind.items()]
            cameras = cameras.only(*(name for name in cameras.cameras if name not in blind))
        stereo, (located, considered, ranked) = look(cameras)
        blind = dict(located.found.verdict.blind)
        is_looked_at = not (parameters.ignore_blind_camera and 0 < len(blind) < len(cameras.cameras))
    pictures = {name: pictures[name] for name in cameras.cameras}
    primitives = {name: primitives[name] for name in cameras.cameras}
    (stored, selection), used, found, relations = located
    verdict = doubt_pictures(found.verdict, [fault for fault in faults if fault.camera in cameras.cameras])
    found = replace(found, verdict=verdict)
    believed = believed or used
    maps = {}
    if found.best is not None:
        maps = map_views(stored.scene, found.rig, found.best.world_from_rig, parameters.localisation)
    matched = match_views(found.rig, found, maps, primitives, parameters.matching)
    run.step("match")
    correction = _correction(mounted, call.carrier, found)
    parts = None
    if found.best is not None and found.verdict.verdict != "refused":
        parts = find_parts_in_view(stored, found.rig, maps, found.best.world_from_rig, parameters.localisation)
    run.step("view")
    presence = None
    if parts is not None and found.best is not None:
        presence = assess(
            stored,
            found.rig,
            primitives,
            greys,
            found.edge_indexes,
            found.best,
            {name: view.arcs for name, view in found.views.items()},
            maps,
            parts,
            matched,
            parameters.presence,
        )
    run.step("presence")
    if presence is not None and call.against is None and is_to_be_weighed(presence, call.variants):
        most = None if call.variants else parameters.most_variants
        ranked = weigh_variants(run, stored, selection, found.rig, primitives, greys, found, presence, parameters, most)
        run.step("variants")

    run.conclude(
        _Found(
            Inspected(
                call.serial,
                stored,
                selection,
                inputs.rig,
                believed,
                needs,
                seen,
                quality,
                stereo,
                relations,
                found,
                matched,
                parameters.matching.pose,
                correction,
                parts,
                presence,
                ranked,
                considered,
            ),
            cameras,
            used,
            parameters,
            call.full_audit,
        )
    )
    outcome, notes = read_outcome(store, run.id), [*notes, *describe_reading(pictures.values())]
    if inputs.prior is None and mounted is not None:
        notes.append(f"no prior was given: the rig is taken to be where {mounted.base} has it")
    return _answer(
        run, cameras, needs, found, outcome, correction, parts, presence, ranked, considered, selection, notes
    )


def _mounted(store: Store, world_id: int, rig: Rig, carrier: Carrier) -> MountedRig | None:
    """The rig as the world mounts it, the joints as given; None where it is not mounted."""
    with store.read() as connection:
        rig_id = find_rig(store, connection, rig)
        mounted = None if rig_id is None else mount_of_rig(store, connection, world_id, rig_id, carrier.on)
    if mounted is None:
        if carrier.is_given:
            raise UsageError(
                "the world does not mount this rig: mount it in the world file, or leave its carrier and joints out"
            )
        return None
    mounted = mounted.moved(carrier.joints)
    mounted.sigmas(carrier.joint_sigmas)  # refuses bad ones
    return mounted


def _correction(mounted: MountedRig | None, carrier: Carrier, found: Localisation) -> Correction | None:
    if mounted is None or found.best is None or found.verdict.verdict != "accepted":
        return None
    return correct_base(
        mounted,
        found.best.world_from_rig,
        found.best.covariance,
        joint_sigmas=carrier.joint_sigmas,
        base_covariance=carrier.base_covariance,
    )


def _answer(
    run: Run,
    rig: Rig,
    needs: Needs,
    found: Localisation,
    outcome: Outcome,
    correction: Correction | None,
    parts: PartsInView | None,
    presence: Presence | None,
    variants: list[VariantEvidence],
    considered: list[Considered],
    selection: Selection,
    notes: list[str],
) -> Inspection:
    best, verdict = found.best, found.verdict
    rows = [] if parts is None else parts.rows()
    return Inspection(
        run=run.id,
        outcome=outcome,
        reason=verdict.reason,
        posterior=verdict.posterior,
        missing=verdict.missing,
        needs=needs,
        sigma_mm=verdict.sigma_mm,
        sigma_rad=verdict.sigma_rad,
        weakest=verdict.weakest,
        world_from_rig=best.world_from_rig if best else None,
        world_from_camera={
            name: best.world_from_rig @ found.rig.rig_from_camera[name] if best else None for name in found.rig.cameras
        },
        covariance=best.covariance if best else None,
        base_correction=correction,
        parts_in_view=rows,
        presence=presence,
        variants=variants,
        considered=considered,
        selection=selection,
        hypotheses=[(h.world_from_rig, h.cost) for h in found.hypotheses],
        equivalent=found.equivalent,
        notes=notes,
        timings_s=run.seconds,
    )
