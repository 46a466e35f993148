"""The main job: from a rig's pictures to the parts in view and the pose of the cameras, every step in the store."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field, replace
from math import degrees
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from sqlalchemy import Connection

from relmodel.arrays import fields_of
from relmodel.drawing.draw import check_writable, write_crops, write_overlay
from relmodel.errors import UsageError
from relmodel.find.find import world_named
from relmodel.geometry.transforms import carry, inverse
from relmodel.labelling.solve import check_mode
from relmodel.names import make_folder
from relmodel.resources import user_name
from relmodel.store import Run, Store
from relmodel.store.runs import record_digests
from relmodel.world.kinematics import Carrier, Correction, MountedRig, correct_base, mount_of_rig, predict_covariance
from vision.account.runs import take_account, weigh_lookalike
from vision.cameras.cameras import DEFAULT_NEEDS, USUAL_CALIBRATION, Needs, Prior, Rig, Selection, Standpoint
from vision.cameras.files import read_needs, read_prior
from vision.cameras.images import (
    Picture,
    PictureBytes,
    Pictures,
    describe_reading,
    digest_given,
    pictures_as_files,
    read_rig_with_pictures,
)
from vision.cameras.record import find_rig, read_recorded_rig
from vision.cameras.standpoints import GivenStandpoint, Standpoints, pictures_of, read_standpoints
from vision.extraction import extract as extraction
from vision.inspection.against import (
    Candidate,
    Recognition,
    is_to_be_weighed,
    place_candidates,
    recognise,
    shows_another,
    weigh_variants,
)
from vision.inspection.answer import Inspection, read_inspection
from vision.inspection.inspection_parameters import DEFAULTS, InspectionParameters
from vision.inspection.locate import Locator, Target, doubt_calibration, match_views, select_parts
from vision.inspection.pictures import (
    doubt_pictures,
    extract_pictures,
    find_faults,
    in_light_of_model,
    measure_quality,
    name_grave,
    return_memory,
)
from vision.inspection.record import Result, record_decisions, record_inspection
from vision.localisation.localise import Localisation
from vision.localisation.verdict import Verdict, doubt_face, place_by_bases
from vision.localisation.views import Observation, ViewPoints, place_views, view_model
from vision.localisation.visibility import find_parts_in_view
from vision.matching import MatchedView
from vision.presence.states import Presence, assess
from vision.presence.surfaces import find_rival_face, measure_misfit
from vision.rig_check import LITTLE, compare_views, describe_overlap
from vision.scene import Scenes, StoredScene
from vision.stereo.epipolar import choose_pair
from vision.stereo.match import StereoMatches, check_method

NOT_AS_MODELLED = ("changed", "contradicted", "variant", "unchecked")


def parse_not_as_modelled(given: str, option: str) -> list[str]:
    """Words of NOT_AS_MODELLED, separated by commas.  Raises UsageError for others."""
    words = [word.strip() for word in given.split(",")]
    unknown = [word for word in words if word not in NOT_AS_MODELLED]
    if unknown:
        raise UsageError(f"{option} does not know {unknown[0]!r}: give some of {','.join(NOT_AS_MODELLED)}")
    return words


KERNELS = (
    "relmodel.find.rtree_kernels",
    *extraction.KERNELS,
    "vision.stereo.epipolar_kernels",
    "vision.constellations.ellipse_kernels",
    "relmodel.labelling.kernels",
    "vision.localisation.kernels",
    "vision.account.kernels",
    "vision.presence.kernels",
)
PACKAGES = ("duckdb", "embreex", "numba", "numpy", "opencv-python-headless", "scipy", "sqlalchemy")


@dataclass(frozen=True, kw_only=True)
class Task:
    """What is to be inspected, what is known of it beforehand, and what is kept.

    rig, prior: files, the rig in any format of `read_rig`; without a prior the rig is taken to be where the joints of
    what carries it put it, and where the world does not mount it several pictures are located by the circles that
    stereo finds, one by its ellipses, wherever in the world they were taken.
    pictures: by the names of their cameras, up to sixteen, files or arrays (grey, RGB or RGBA, of bytes, of 16 bits, or
    of floats from 0 to 1), or one alone where the rig has one camera.
    standpoints: instead of pictures, those of one unmoving object from several places of the rig: a file or a list of
    its entries; prior and pose are then of the first.  ignored: names of those that are left out.
    needs: how exactly the pose is needed, else as the prior file says, else the default.
    world: its name, where the store has several.
    against: names of loaded objects, all where there are none, to say which of them the pictures show, with no world
    and no prior.
    carrier: how the object stands that carries the rig, which is found by the rig's content.
    serial: the number of the physical part, by which the evidence of all its inspections adds up.
    operator: who makes it, else the user of this machine.
    keep_images: whether the store keeps the bytes of the pictures.
    full_audit: whether the rows that explain the decisions are kept, and not the decisions alone.
    match: whether to match arcs and regions of the pictures to the model's by their relations: this tells what each of
    them is, and decides nothing.
    variants: whether to weigh all loaded variants of the inspected objects at the pose found, None where something is
    not as the model says and they are few.
    overlay: a picture of the model drawn over the images, to be written.
    crops: a folder for pictures of what is not as the model says, worst first."""

    rig: str | Path
    pictures: Pictures | None = None
    standpoints: Standpoints | None = None
    ignored: Sequence[str] = ()
    prior: str | Path | None = None
    needs: Needs | None = None
    world: str | None = None
    against: Sequence[str] | None = None
    carrier: Carrier = field(default_factory=Carrier)
    serial: str | None = None
    operator: str | None = None
    keep_images: bool = True
    full_audit: bool = True
    match: bool = False
    variants: bool | None = None
    overlay: str | Path | None = None
    crops: str | Path | None = None

    def check(self, p: InspectionParameters) -> None:
        """Raise UsageError where it contradicts itself, or what it writes cannot be written."""
        if (self.overlay or self.crops or self.match) and not self.full_audit:
            raise UsageError("overlay, crops and match are of rows that a minimal audit leaves out: leave one out")
        if self.overlay is not None:
            check_writable(self.overlay)
        if self.crops is not None:
            make_folder(self.crops)
        if (self.pictures is None) == (self.standpoints is None) or (self.ignored and self.standpoints is None):
            raise UsageError("give pictures taken together, or standpoints, of which some may be ignored")
        given = (self.prior, self.world, self.variants, p.believe_pictures or None)
        if self.against is not None and (self.carrier.is_given or any(it is not None for it in given)):
            raise UsageError(
                "pictures compared with loaded objects have no world, prior or arm, and weigh all variants: leave out "
                "what says otherwise, or leave out against"
            )


def inspect(
    store: Store, task: Task, parameters: InspectionParameters = DEFAULTS, scenes: Scenes | None = None
) -> Inspection:
    """Inspect the pictures that one or more cameras of a rig took together, against a world of the store.

    scenes: those that earlier inspections of the store left, for more of them in a row.  The run records the
    parameters, defaults included.

    Raises InputError for bad inputs, UsageError where several objects carry the rig and the task does not choose; the
    run then ended as failed, and the store is otherwise as it was."""
    task.check(parameters)
    given = None if task.standpoints is None else read_standpoints(task.standpoints, task.ignored)
    files = pictures_as_files(pictures_of(given) if given else task.pictures if task.pictures is not None else {})
    request = InspectionRequest.of(store, task)
    listed = task.standpoints if isinstance(task.standpoints, str | Path) else None
    return_memory()
    with (
        store.one_thread(),
        Run.begin(
            store,
            "inspect",
            {**request.parameters(), **asdict(parameters)},
            inputs=digest_given(files, task.rig, prior=task.prior, standpoints=listed),
            packages=PACKAGES,
        ) as run,
    ):
        inputs = _read_inputs(task, files, parameters, lambda rig: _move(store, request, rig, given))
        run.step("read")
        carry_out(scenes or Scenes(store), run, request, inputs, parameters)
        answer = read_inspection(store, run.id)
        greys = {name: inputs.pictures[name].grey for name in answer.world_from_camera}
        if task.overlay is not None:
            write_overlay(task.overlay, store, run.id, greys)
        if task.crops is not None:
            write_crops(task.crops, store, run.id, greys)
        return answer


@dataclass(frozen=True, kw_only=True)
class InspectionRequest:
    """What a run records of its task: a world of the store, how the object in it stands that carries the rig, and what
    is kept; world_id: -1 where loaded objects are compared instead."""

    world_id: int
    world: str
    against: tuple[str, ...] | None
    carrier: Carrier
    serial: str | None
    operator: str | None
    keep_images: bool
    full_audit: bool
    match: bool
    variants: bool | None

    @classmethod
    def of(cls, store: Store, task: Task) -> InspectionRequest:
        """The request of a task.  Raises UsageError where the store holds no such world."""
        world_id, world = -1, ""
        if task.against is None:
            with store.read() as connection:
                world_id, world = world_named(store, connection, task.world)
            if world_id < 0:
                raise UsageError("the store holds no world: place the objects with relmodel world FILE")
        return cls(
            world_id=world_id,
            world=world,
            against=None if task.against is None else tuple(task.against),
            operator=task.operator or user_name(),
            **fields_of(task, "carrier serial keep_images full_audit match variants"),
        )

    def parameters(self) -> dict[str, Any]:
        """What a run records of it."""
        return {name: value for name, value in asdict(self).items() if name != "world_id"}


@dataclass(frozen=True)
class Inputs:
    """What an inspection is given: a rig, a picture of each of its cameras that took one, where the rig is thought to
    be, where that is known, how exactly its pose is needed, and what of the world to look for, where that is known."""

    rig: Rig
    pictures: dict[str, Picture]
    prior: Prior | None
    needs: Needs
    selection: Selection | None = None


def _move(store: Store, request: InspectionRequest, rig: Rig, given: Sequence[GivenStandpoint] | None) -> Rig:
    """A rig at its standpoints, where these are given; by joints where the world has it with these."""
    if given is None:
        return rig
    sigmas, stood = np.repeat(request.carrier.base_sigmas, 3), {}
    carriers = {it.on: _carried(store, request, rig, it.on) for it in given}
    for it in given:
        (own, mounted), pose = carriers[it.on], it.world_from_rig
        if pose is None:
            if mounted is None:
                raise UsageError("the world does not mount this rig: say by world_from_rig where it stood, or mount it")
            pose = mounted.moved(it.joints).world_from_rig
        name, sway = "", np.zeros((6, 6))
        if mounted is not None:
            name, sway = mounted.carrier, carry(inverse(pose) @ mounted.world_from_object) * sigmas
        stood[it.name] = Standpoint(pose, it.covariance, it.joints, it.ignored, name, sway, own)
    return rig.at_standpoints(stood)


def _carried(store: Store, request: InspectionRequest, rig: Rig, on: str) -> tuple[Rig, MountedRig | None]:
    """The only rig that the world mounts on an object, else this one, and how it is mounted."""
    with store.read() as connection:
        mounts = store.rows(connection, "world/mounts", world_id=request.world_id) if on else []
        own = {it.rig_id for it in mounts if it.carrier == on and it.rig_id is not None}
        if len(own) == 1 and find_rig(store, connection, rig) not in own:
            rig = read_recorded_rig(store.columns(connection, "cameras/rig", rig_id=own.pop()))
    return rig, _mounted(store, request.world_id, rig, request.carrier.named(on))


def _read_inputs(
    task: Task, files: dict[str, Path | PictureBytes], p: InspectionParameters, move: Callable[[Rig], Rig]
) -> Inputs:
    check_mode(p.matching.pose.search)
    check_method(p.stereo)
    whole, pictures = read_rig_with_pictures(Path(task.rig), files, move)
    choose_pair(whole.only(*pictures))  # refuses cameras that all are at one place
    prior = None if task.prior is None else Path(task.prior)
    needs = task.needs or (None if prior is None else read_needs(prior)) or DEFAULT_NEEDS
    return Inputs(whole, pictures, None if prior is None else read_prior(prior), needs)


class _PriorKnowledge(NamedTuple):
    """What is known before the pictures are looked at: the rig as the world mounts it, by the carrier of standpoints,
    where the rig is thought to be, what of the world may be in view, or the objects that may be shown."""

    arms: dict[str, MountedRig]
    prior: Prior | None
    target: Target | None
    among: list[Candidate]


def _select(
    scenes: Scenes, run: Run, request: InspectionRequest, inputs: Inputs, p: InspectionParameters
) -> _PriorKnowledge:
    """What the world, the arm and the prior tell."""
    if request.against is not None:
        among = place_candidates(scenes.store, run, request.against)
        scenes.keep_only({it.world_id for it in among})
        return _PriorKnowledge({}, None, None, among)
    scenes.keep_only({request.world_id})
    arms, prior = _find_arms(scenes.store, request, inputs.rig), inputs.prior
    first = inputs.rig.standpoints.get(inputs.rig.first)
    name = "" if first is None else first.carrier
    if prior is None and name in arms:
        covariance = predict_covariance(arms[name], request.carrier.named(name))
        prior = Prior(arms[name].world_from_rig, covariance + (0 if first is None else first.covariance))
    cameras = inputs.rig.only(*inputs.pictures)
    target = select_parts(scenes, request.world_id, request.world, cameras, prior, p.selection, inputs.selection)
    return _PriorKnowledge(arms, prior, target, [])


def _find_arms(store: Store, request: InspectionRequest, rig: Rig) -> dict[str, MountedRig]:
    """The rig as the world mounts it, by carrier where it has standpoints, with the joints of the first one there."""
    if rig.moved is None:
        mounted = _mounted(store, request.world_id, rig, request.carrier)
        return {} if mounted is None else {"": mounted}
    arms: dict[str, MountedRig] = {}
    for it in rig.standpoints.values():
        if it.joints and not it.ignored and it.carrier not in arms:
            mounted = _mounted(store, request.world_id, it.rig or rig.moved, request.carrier.named(it.carrier))
            arms |= {} if mounted is None else {it.carrier: mounted.moved(it.joints)}
    return arms


def carry_out(
    scenes: Scenes, run: Run, request: InspectionRequest, inputs: Inputs, parameters: InspectionParameters
) -> None:
    """Inspect what was read, within a run, and record it."""
    store, pictures, p = scenes.store, inputs.pictures, parameters
    known = _select(scenes, run, request, inputs, p)
    run.step("select")
    extracted = extract_pictures(run, pictures, p.extraction, keep_images=request.keep_images)
    run.step("extract")
    cameras = inputs.rig.only(*pictures)
    taken = measure_quality(run.id, store, cameras, extracted)
    run.step("look")
    seen = Observation(
        cameras,
        {name: one.primitives for name, one in extracted.items()},
        {name: picture.grey for name, picture in pictures.items()},
    )

    def locate() -> tuple[StereoMatches | None, Recognition]:
        """Where the cameras are that are not left out."""
        locator = Locator(run, scenes, request.world_id, request.world, seen, inputs.needs, p)
        if known.target is None:
            return locator.stereo, recognise(locator, known.among)
        return locator.stereo, Recognition(locator.locate(known.target, known.prior), [], [])

    ignored: dict[str, str] = {}
    leaves_out = p.ignore_blind_camera or seen.rig.moved is not None  # of many pictures a bad one is no great loss
    in_any_light = {name: replace(it, saturated=0.0) for name, it in taken.items()}
    blind, is_located = name_grave(find_faults(in_any_light, run.id, p.pictures)), False
    while not is_located:
        if leaves_out and 0 < len(blind) < len(seen.pictures):
            ignored |= blind
            seen = seen.only(name for name in seen.rig.cameras if name not in blind)
        stereo, (location, considered, variants) = locate()
        quality, found = taken, location.found
        if found.verdict.weighed.get("likely", 0.0) >= p.localisation.verdict.min_posterior:
            quality = in_light_of_model(taken, seen, location.target.stored.scene, found, p.pictures)
        faults = [it for it in find_faults(quality, run.id, p.pictures) if it.camera in seen.pictures]
        blind = name_grave(faults) | (dict(location.found.verdict.blind) if p.ignore_blind_camera else {})
        is_located = not (leaves_out and 0 < len(blind) < len(seen.pictures))
    notes = [it.words for it in faults if not it.refuses]
    notes += [f"camera {name} is ignored: {words}" for name, words in ignored.items()]
    verdict = doubt_pictures(location.found.verdict, faults)
    if verdict.weighed.get("likely", 0.0) < p.localisation.verdict.min_posterior:
        doubt = doubt_calibration(seen, location.target.stored.scene, known.prior)
        verdict = verdict if doubt is None else replace(verdict.refused(doubt), rig=doubt)
        run.step("doubt")
    location = location._replace(found=replace(location.found, verdict=verdict))
    found, best = location.found, location.found.best
    points: dict[str, ViewPoints] = {}
    matched: dict[str, MatchedView] = {}
    parts, presence, stored = None, None, location.target.stored
    if best is not None:
        arcs = {name: one.arcs for name, one in found.views.items()}
        view = view_model(stored.scene, found.rig, best.world_from_rig, arcs)
        points = place_views(found.rig, best, view)
    if points and request.match:
        matched = match_views(points, view, seen, p.matching)
        run.step("match")
    if best is not None and verdict.verdict != "refused":
        parts = find_parts_in_view(stored, found.rig, view.maps, best.world_from_rig)
        run.step("view")
        account = location.account or take_account(
            stored, found.rig, best, found.edge_indexes, view.arcs, p.presence.account
        )
        location = location._replace(account=account)
        presence = assess(stored, seen, found, view, parts, account, p.presence)
        run.step("presence")
    if presence is not None and request.against is None and is_to_be_weighed(presence, request.variants):
        most = None if request.variants else p.most_variants
        variants = weigh_variants(run, location.target, seen, found, presence, p, most)
        run.step("variants")
    if presence is not None and not shows_another(variants):
        verdict = doubt_presence(verdict, stored, presence, inputs.needs, p)
        location = location._replace(found=replace(found, verdict=verdict))
        if verdict.verdict == "refused":
            parts = presence = None
    notes += describe_reading(pictures[name] for name in seen.pictures)
    taking = [it.rig for it in cameras.standpoints.values() if it.rig is not None] or [cameras]
    if unstated := dict.fromkeys(name for rig in taking for name in rig.cameras if name not in rig.sigma):
        it = USUAL_CALIBRATION
        notes.append(
            f"the rig's file does not say how well {', '.join(unstated)} were calibrated: {100 * it.focal:g} % of the "
            f"focal length, {it.centre_px:g} px, {it.translation_mm:g} mm and {degrees(it.rotation):.2g} degrees are "
            "taken; state its sigma"
        )
    if best is not None and not best.sees_nothing and seen.rig.moved is None:
        notes += [
            f"at {best.distance:.0f} mm {names}: {describe_overlap(it['overlap'])}"
            for names, it in compare_views(seen.rig, best.distance).items()
            if it["overlap"] < LITTLE
        ]
    if inputs.prior is None and known.arms:
        bases = " and ".join(it.base for it in known.arms.values())
        notes.append(f"no prior was given: the rig is taken to be where {bases} has it")
    result = Result(
        serial=request.serial,
        rig=inputs.rig,
        prior=known.prior or location.prior,
        needs=inputs.needs,
        pictures=extracted,
        quality=quality,
        stereo=stereo,
        location=location,
        points=points,
        matched=matched,
        corrections=_correct_bases(known.arms, request.carrier, found),
        parts=parts,
        presence=presence,
        variants=variants,
        considered=considered,
        notes=notes,
    )
    run.conclude(_Record(result, inputs.rig.only(*seen.rig.cameras), p, request.full_audit))


def doubt_presence(
    verdict: Verdict, stored: StoredScene, it: Presence, needs: Needs, p: InspectionParameters
) -> Verdict:
    """The verdict on a pose by what is there: edges of the parts that hold it that should show and do not, beside what
    is told of by itself; too many features that differ; faces moved so far that they hold it elsewhere, or all off."""
    runs, surfaces = it.signs.runs, it.signs.surfaces
    parts = it.find_holding_parts(p.presence.states)
    holding = np.isin(stored.scene.surface_occurrence, parts)
    explained = (runs.surface >= 0) & it.find_explained_surfaces()[runs.surface]
    asked = holding[runs.surface[:, 0]] & ~explained.any(axis=1)
    said = weigh_lookalike(stored, runs, asked, it.cameras, p.presence.account.runs)
    verdict = verdict.limited("absent", *said, p.localisation.verdict.max_absent_odds)
    verdict = verdict.limited("features", *it.weigh_features(parts), p.localisation.verdict.max_features_odds)
    face = find_rival_face(surfaces, holding, needs.translation_mm)
    if face is not None and verdict.verdict != "refused":
        verdict = doubt_face(verdict, float(abs(surfaces.mm[face])), stored.name_surface(face))
    if (misfit := measure_misfit(surfaces, holding)) is not None:
        off, farthest = misfit
        words = f"faces lie {off:.1f} standard deviations (rms) from their places, most of all "
        words += f"{stored.name_surface(farthest)}: is the object another one, or another size?"
        verdict = verdict.limited("faces_off", off, words, p.localisation.verdict.max_faces_off)
    return verdict


@dataclass(frozen=True)
class _Record:
    """What an inspection by some cameras found, with some parameters, and whether all that it rests on is kept."""

    result: Result
    cameras: Rig
    parameters: InspectionParameters
    full: bool

    def record(self, run: Run, connection: Connection) -> None:
        """Append it and end the run."""
        it, p = self.result, self.parameters
        record_inspection(run, connection, it, p.matching.pose, full=self.full)
        record_decisions(run.writer(connection), self.cameras, it.location.prior, it.needs, it.found, p)
        record_digests(run, connection)
        run.finish(it.found.verdict.reason, connection, last="record")


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


def _correct_bases(arms: dict[str, MountedRig], carrier: Carrier, found: Localisation) -> list[Correction]:
    if found.best is None or found.verdict.verdict != "accepted":
        return []
    placed = {"": (found.best.world_from_rig, found.best.covariance)}
    if found.rig.moved is not None:
        placed = place_by_bases(found.rig, found.best)
    return [
        correct_base(mounted, *placed[name], **fields_of(carrier.named(name), "joint_sigmas base_covariance"))
        for name, mounted in arms.items()
        if name in placed
    ]
