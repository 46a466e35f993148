"""Where a rig is in a world of a store: what to look for, where to start, and pictures matched to what a pose shows."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from relmodel.errors import InputError
from relmodel.store import Run, Store
from vision.account.runs import EdgeAccount, take_account, weigh_edges, weigh_lookalike
from vision.cameras.cameras import Needs, Prior, Rig, Selection, SelectionParameters, select_in_view
from vision.constellations.elements import Relations
from vision.constellations.find_poses import PoseCandidates, find_poses, find_poses_of_one_picture, gather_poses
from vision.inspection.inspection_parameters import InspectionParameters
from vision.localisation.hypotheses import Perturbations
from vision.localisation.localise import Localisation, localise
from vision.localisation.magnification import doubt_scale
from vision.localisation.measurements import EdgeIndex, correct_rig
from vision.localisation.refine import RefinedPose
from vision.localisation.verdict import weigh_against_prior
from vision.localisation.views import ModelView, Observation, ViewPoints, find_view_arcs
from vision.matching import MatchedView, MatchingParameters, describe_view, match_view
from vision.relations.relations import open_workspace
from vision.scene import Scene, Scenes, StoredScene
from vision.stereo.agreement import doubt_rig, doubt_unit, find_shared_points
from vision.stereo.epipolar import choose_pair
from vision.stereo.match import StereoMatches, match_stereo


class Target(NamedTuple):
    """What of a world is looked for: its scene, and which placed parts those are."""

    stored: StoredScene
    selection: Selection


class Location(NamedTuple):
    """Where the rig is: what was looked for, the prior that the pose was found with, an open one where none was used,
    what was found, the relations in space that the search started at, and the account of the edges seen from there,
    where that was doubted by it."""

    target: Target
    prior: Prior
    found: Localisation
    relations: dict[str, Relations]
    account: EdgeAccount | None = None


def select_parts(
    scenes: Scenes,
    world_id: int,
    world: str,
    rig: Rig,
    prior: Prior | None,
    p: SelectionParameters,
    selection: Selection | None = None,
) -> Target:
    """What of the world may be in view: all of it where nothing is known beforehand; selection: what that is, where
    it is known.

    Raises InputError where nothing of it lies where the prior looks."""
    if prior is None:
        with scenes.store.read() as connection:
            stored = scenes.read(connection, world_id)
        count = len(stored.occurrence_id)
        return Target(stored, Selection(stored.occurrence_id, np.full(count, -1), np.ones(count, bool)))
    selection = selection or select_in_view(scenes.store, rig, prior, p, world=world)
    if not len(selection.shown):
        raise InputError("nothing of the world lies where the prior looks: check the prior and the world file")
    with scenes.store.read() as connection:
        return Target(scenes.read(connection, world_id, selection.occurrence_id.tolist()), selection)


@dataclass(frozen=True)
class Locator:
    """Finds the rig in a world of kept scenes from what its cameras saw, in steps that the run times."""

    run: Run
    scenes: Scenes
    world_id: int
    world: str
    seen: Observation
    needs: Needs
    p: InspectionParameters

    @property
    def store(self) -> Store:
        return self.scenes.store

    @cached_property
    def stereo(self) -> StereoMatches | None:
        """What two of the pictures show alike; None where no two make a pair."""
        return self._match(self.seen.rig)

    def _match(self, rig: Rig) -> StereoMatches | None:
        found = None
        if pair := choose_pair(rig):
            one, other = (self.seen.pictures[name] for name in pair)
            found = match_stereo(rig.only(*pair), one, other, self.p.stereo)
        self.run.step("stereo")
        return found

    def locate(self, target: Target, prior: Prior | None) -> Location:
        """The rig from the poses of the join; where the pictures do not show the model at these, from a scan of the
        prior's volume; and where that is refused too, without the prior, which the pictures then contradict."""
        scene = target.stored.scene
        used, starts, relations = self.join(scene, prior)
        located = Location(target, used, self.localise(target.stored, used, starts), relations)
        if prior is None:
            return self.doubt(located)
        likely = located.found.verdict.weighed.get("likely", 0.0)
        if likely < self.p.localisation.verdict.min_posterior and starts.score.max(initial=0.0) >= starts.enough:
            scanned = self.localise(target.stored, prior, replace(starts, enough=np.inf))
            located = max(located, located._replace(found=scanned), key=lambda it: it.found.verdict.posterior)
        doubted = self._without(prior) if located.found.verdict.verdict == "refused" else None
        return doubted or located

    def _without(self, prior: Prior) -> Location | None:
        """What the pictures show without the prior; None where that is nothing sure, or agrees with it, and in a world
        of too many parts to look for them all unasked."""
        with self.store.read() as connection:
            (size,) = self.store.rows(connection, "world/size", world_id=self.world_id)
        if size.parts > self.p.most_parts:
            return None
        everything = select_parts(self.scenes, self.world_id, self.world, self.seen.rig, None, self.p.selection)
        used, starts, relations = self.join(everything.stored.scene, None)
        if starts.score.max(initial=0.0) < starts.enough:
            return None
        found = self.localise(everything.stored, used, starts)
        located = self.doubt(Location(everything, used, found, relations))
        found = located.found
        if found.best is None or found.verdict.verdict != "accepted":
            return None
        pose = found.best.world_from_rig
        if prior.distance(pose) <= self.p.localisation.verdict.max_sigma:
            return None
        verdict = weigh_against_prior(found.verdict, prior, pose, believe_pictures=self.p.believe_pictures)
        return located._replace(found=replace(found, verdict=verdict))

    def join(self, scene: Scene, prior: Prior | None) -> PoseCandidates:
        """The poses that the join of circles gives, and what they are perturbations of: of what stereo puts in space,
        without a prior at every standpoint, else of the ellipses of all pictures."""
        p, seen, pairs = self.p.constellations, self.seen, [self.stereo]
        if prior is None and self.stereo is not None:
            used = seen.rig.standpoint_of(self.stereo.rectification.cameras[0])
            at = sorted({seen.rig.standpoint_of(name) for name in seen.rig.cameras} - {used})
            own = [[name for name in seen.rig.cameras if seen.rig.standpoint_of(name) == place] for place in at]
            pairs += [self._match(seen.rig.only(*names)) for names in own]
        with self.store.read(scratch=True) as connection:
            found = [
                find_poses(self.store, connection, scene, self.world_id, it.triangulated, prior, p)
                for it in pairs
                if it is not None
            ] or [
                find_poses_of_one_picture(self.store, connection, seen.rig.only(it), self.world_id, picture, prior, p)
                for it, picture in seen.pictures.items()
            ]
        self.store.release()
        self.run.step("join")
        return gather_poses(found, scene, prior)

    def localise(self, stored: StoredScene, prior: Prior, starts: Perturbations) -> Localisation:
        """The best pose from these starts, with its verdict."""
        scene, seen = stored.scene, self.seen

        def weigh(pose: RefinedPose, indexes: Mapping[str, EdgeIndex]) -> float:
            rig = correct_rig(self.seen.rig, pose.camera_unknowns)
            placed = {name: pose.world_from_rig @ it for name, it in rig.rig_from_camera.items()}
            arcs = {name: find_view_arcs(scene, camera, placed[name]) for name, camera in rig.cameras.items()}
            return weigh_edges(take_account(stored, rig, pose, indexes, arcs, self.p.presence.account).pieces)

        if self.stereo is not None:
            partnered = dict(zip(self.stereo.rectification.cameras, self.stereo.partnered, strict=True))
            seen = replace(seen, partnered=partnered)
        found = localise(scene, seen, prior, self.needs, self.p.localisation, starts, weigh)
        self.run.step("localise")
        return found

    def doubt(self, it: Location) -> Location:
        """The same, doubted by the edges that should show there and do not, where it was found without a prior."""
        found, stored, p = it.found, it.target.stored, self.p.presence.account
        if not it.prior.is_open or found.best is None:
            return it
        arcs = {name: view.arcs for name, view in found.views.items()}
        account = take_account(stored, found.rig, found.best, found.edge_indexes, arcs, p)
        every = stored.scene.inspected[stored.scene.surface_occurrence[account.pieces.surface[:, 0]]]
        said = weigh_lookalike(stored, account.pieces, every, list(found.rig.cameras), p.runs)
        most = self.p.localisation.verdict.max_absent_odds_anywhere
        verdict = found.verdict.limited("absent_anywhere", *said, most)
        self.run.step("doubt")
        return it._replace(found=replace(found, verdict=verdict), account=account)


def doubt_calibration(seen: Observation, scene: Scene, prior: Prior | None) -> str | None:
    """How pictures that show no pose say that the rig is, where not as its file says."""
    names = choose_pair(seen.rig) or ([] if seen.rig.moved else list(seen.pictures)[:2])
    if len(names) > 1:
        two = seen.rig.only(*names)
        points, size = find_shared_points(seen.greys, two), float(np.ptp(scene.vertices, axis=0).max())
        if words := doubt_rig(two, points) or doubt_unit(two, points, size):
            return words
    return None if prior is None else doubt_scale(scene, seen, prior)


def match_views(
    points: Mapping[str, ViewPoints], view: ModelView, seen: Observation, p: MatchingParameters
) -> dict[str, MatchedView]:
    """Match the pictures with their views, by camera: a problem of one workspace for each."""
    matched = {}
    with open_workspace() as workspace:
        for number, (name, placed) in enumerate(points.items()):
            units = describe_view(view.arcs[name], placed, view.maps[name])
            match = match_view(workspace, number, seen.pictures[name], units, view.maps[name], p.pose)
            matched[name] = MatchedView(units, match)
    return matched
