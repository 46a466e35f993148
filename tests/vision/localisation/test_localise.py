"""The whole localisation on pictures whose pose is known: ray-cast boxes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cache
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from relmodel.arrays import Bytes, Floats, Ints
from tests.vision.localisation.scenes import above, blocks, endless_blocks, off, picture, stereo_rig, thinned
from vision.cameras.cameras import Needs, Prior, Rig, perturb, perturbation
from vision.extraction.extract import extract
from vision.extraction.rows import Primitives, make_primitives
from vision.localisation import hypotheses
from vision.localisation import localise as localise_module
from vision.localisation.hypotheses import Perturbations, Prediction, Stage
from vision.localisation.localisation_parameters import DEFAULTS
from vision.localisation.localise import Localisation, Solver, keep_worthy, localise, partner_odds, say_why_nothing
from vision.localisation.refine import RefinedPose
from vision.localisation.support import Outlines, Support
from vision.localisation.views import Observation
from vision.scene import Scene

RIG = stereo_rig(0.5)
LEFT = RIG.only("left")


@pytest.fixture(autouse=True)
def few_climb(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of what a scan found: half of the time is theirs."""
    monkeypatch.setattr(hypotheses, "SCAN_KEPT", 30)


@cache
def shown(name: str) -> tuple[Scene, Floats]:
    """A scene, and the pose of the rig that pictures it."""
    if name == "endless":
        return thinned(endless_blocks(110.0), 3), above(20, 15, 500)
    return thinned(blocks(5), 3), above(10, -20, 560)


@cache
def pictures(name: str) -> dict[str, Bytes]:
    """Pictures of a scene by camera."""
    (scene, truth), rig = shown(name), LEFT if name == "endless" else RIG
    return {n: picture(scene, c, truth @ rig.rig_from_camera[n], 0) for n, c in rig.cameras.items()}


@cache
def seen(name: str) -> dict[str, Primitives]:
    """What pictures of a scene hold, by camera."""
    return {camera: make_primitives(extract(image)) for camera, image in pictures(name).items()}


def error(found: Localisation, truth: Floats) -> Floats:
    assert found.best is not None
    return np.abs(perturbation(truth, found.best.world_from_rig))


def test_pose_of_unlike_blocks_by_a_wide_prior() -> None:
    """Off by a draw from which a climb ends 300 mm off where a look past the object costs nothing: that is no view."""
    scene, truth = shown("blocks")
    prior = off(truth, 100.0, np.radians(10), 3)
    found = localise(scene, Observation(RIG, seen("blocks"), pictures("blocks")), prior)
    assert found.verdict.verdict == "accepted", found.verdict.reason
    e = error(found, truth)
    assert e[:3].max() < 0.5
    assert e[3:].max() < np.radians(0.05)
    for view in found.views.values():
        assert np.sqrt(np.average(view.measurements.residual**2, weights=view.measurements.weight)) < 0.3


def test_equal_blocks_are_ambiguous_and_the_true_cell_is_listed() -> None:
    pitch = 110.0
    scene, truth = shown("endless")
    prior = Prior.isotropic(truth.copy(), 30.0, np.radians(1.0))
    prior.world_from_rig[:3, 3] += [0.4 * pitch, 0, 0]
    found = localise(scene, Observation(LEFT, seen("endless"), pictures("endless")), prior)
    assert found.verdict.verdict == "ambiguous", found.verdict.reason
    shifts = [h.world_from_rig[:3, 3] - truth[:3, 3] for h in found.hypotheses]
    assert min(np.linalg.norm(s) for s in shifts) < 1.0
    assert min(np.linalg.norm(s - [pitch, 0, 0]) for s in shifts) < 1.0


def test_pictures_of_something_else_are_refused() -> None:
    scene, truth = shown("blocks")
    found = localise(scene, Observation(LEFT, seen("endless"), pictures("endless")), off(truth, 20.0, np.radians(2), 1))
    assert found.verdict.verdict == "refused"


def test_nothing_in_view_is_refused() -> None:
    scene, truth = shown("blocks")
    away = Prior.isotropic(truth @ np.diag([1.0, -1, -1, 1]), 5.0, 0.01)
    found = localise(scene, Observation(RIG, seen("blocks"), pictures("blocks")), away)
    assert found.verdict.verdict == "refused"
    assert found.best is None


def test_starts_go_on_that_explain_half_of_what_the_best_does() -> None:
    """Under a prior those too that explain enough for its volume not to be scanned."""
    stage = Stage("join", np.zeros((3, 6)), np.array([0.8, 0.4, 0.39]), ["goes_on"] * 3, 9)
    starts = Perturbations(np.arange(18.0).reshape(3, 6), np.array([0.8, 0.4, 0.39]), [stage], enough=0.5)
    some = keep_worthy(starts, Prior.open(np.eye(4)))
    assert some.score.tolist() == [0.8, 0.4]
    assert some.delta.tolist() == starts.delta[:2].tolist()
    assert some.stages[0].rule == ["goes_on", "goes_on", "little_evidence"]
    few = keep_worthy(starts, Prior.isotropic(np.eye(4), 5.0, 0.01))
    assert few.score.tolist() == [0.8]
    assert few.stages[0].rule == ["goes_on", "little_evidence", "little_evidence"]
    enough = replace(starts, enough=0.8)
    assert keep_worthy(enough, Prior.isotropic(np.eye(4), 5.0, 0.01)).score.tolist() == [0.8]


def test_elements_of_arcs_with_a_partner_are_likelier_of_the_object() -> None:
    picture = SimpleNamespace(elements=SimpleNamespace(arc=np.array([1, -1, 0, 2, 1])))
    found = partner_odds(cast(Primitives, picture), np.array([False, True, True]))
    assert found.tolist() == [1.1, 0.0, -0.63, 1.1, 1.1]


@pytest.mark.parametrize(
    ("cameras", "open_", "joined", "words"),
    [
        (("left", "right"), False, False, "no arc of the model is in view near the prior"),
        (("left", "right"), True, True, "the edges of the pictures speak against each pose that the circles and"),
        (("left", "right"), True, False, "too few circles and straight edges of the pictures lie to each other"),
        (("left",), True, True, "the edges of the picture speak against each pose that the circles give: give a prior"),
        (("left",), True, False, "too few circles of the picture lie to each other"),
    ],
)
def test_why_there_is_no_pose_is_said(cameras: tuple[str, ...], open_: bool, joined: bool, words: str) -> None:
    prior = Prior.open(np.eye(4)) if open_ else Prior.isotropic(np.eye(4), 5.0, 0.01)
    assert say_why_nothing(RIG.only(*cameras), prior, joined).startswith(words)


def test_the_world_and_the_order_and_names_of_cameras_do_not_matter() -> None:
    """The blocks elsewhere, turned, by cameras in the other order: the same pose of the same left camera, as sure."""
    scene, truth = shown("blocks")
    moved = perturb(np.eye(4), np.array([900.0, -300, 70, 0.8, -0.5, 1.9]))
    turned = ("vertex_normals", "sample_tangent", "sample_normal_a", "sample_normal_b")
    elsewhere = replace(
        scene,
        **{name: getattr(scene, name) @ moved[:3, :3].T + moved[:3, 3] for name in ("vertices", "sample_point")},
        **{name: getattr(scene, name) @ moved[:3, :3].T for name in turned},
    )
    names = {"b": "right", "a": "left"}
    given: tuple[Any, ...] = (RIG.cameras, RIG.rig_from_camera, RIG.sigma, seen("blocks"), pictures("blocks"))
    cameras, placed, sigma, primitives, greys = ({new: of[old] for new, old in names.items()} for of in given)
    prior = off(truth, 10.0, np.radians(1), 2)
    found = localise(scene, Observation(RIG, seen("blocks"), pictures("blocks")), prior)
    prior = replace(prior, world_from_rig=moved @ prior.world_from_rig)
    again = localise(elsewhere, Observation(Rig(cameras, placed, sigma), primitives, greys), prior)
    assert found.best is not None
    assert again.best is not None
    assert again.verdict.verdict == found.verdict.verdict == "accepted"
    apart = perturbation(moved @ found.best.world_from_rig, again.best.world_from_rig)
    assert apart @ np.linalg.solve(found.best.covariance, apart) < 0.3
    np.testing.assert_allclose(again.verdict.sigma_mm, found.verdict.sigma_mm, rtol=0.1)
    np.testing.assert_allclose(again.best.support.by_camera[::-1], found.best.support.by_camera, rtol=0.05)
    assert again.verdict.posterior == pytest.approx(found.verdict.posterior, abs=0.01)


PRIOR = Prior.isotropic(np.eye(4), 20.0, 0.01)
AHEAD = Prediction(
    np.tile([0.0, 0, 1000], (4, 1)), np.tile([1.0, 0, 0], (4, 1)), np.arange(1.0, 5), np.zeros(4),
    np.zeros(4, np.int64), np.array([0, 4, 4, 5]), np.eye(3)[None], np.zeros((1, 3)), 1000 * np.eye(3)[None, :2],
)  # fmt: skip
GATHERED = {
    0: 100.0, 10: 69.9, 30: 70.1, 40: 140, 50: 85, 60: 170, 70: 120, 80: 300, 90: 148, 100: 400, 110: 154, 120: 500,
}  # fmt: skip


def at(x: float, found: float = 0.0, **given: Any) -> RefinedPose:
    """The pose x mm beside the prior, by which all that is seen moves a px a mm, and what is gathered there."""
    pose, gathered = np.eye(4), np.array([found or GATHERED[round(x)]])
    pose[0, 3] = x
    return RefinedPose(
        pose, np.eye(6), np.zeros((1, 11)), AHEAD, cast(Any, None), np.zeros(1, bool),
        Support(gathered, gathered, gathered, np.ones(1)), PRIOR.distance(pose), **given,
    )  # fmt: skip


def places(poses: Sequence[RefinedPose]) -> list[int]:
    return [round(h.world_from_rig[0, 3]) for h in poses]


@pytest.mark.parametrize(("x", "left"), [(3.9, [0, 2]), (4.1, [0, 1, 2])])
def test_poses_within_what_is_needed_are_no_rivals_and_widen_what_is_known(x: float, left: list[int]) -> None:
    """Equally likely, with needs of 4 mm."""
    best, standing = localise_module.join_near([at(0, 9.0), at(x, 9.0), at(9, 9.0)], np.arange(3), Needs(4.0, 0.01))
    assert standing.tolist() == left
    wider = np.diag([1 + x**2 / 2 * (len(left) == 2), 1, 1, 1, 1, 1])
    np.testing.assert_allclose(best.covariance, wider, rtol=0.01)


class Landscape:
    """Climbs that lead to the nearest ten mm, and least squares that lead from 50 to 40 besides."""

    strays, halves = True, 0

    def climb(self, *given: Any) -> tuple[Floats, float] | None:
        *_, pose, information, steps = given
        np.testing.assert_allclose(information, 0.01 * PRIOR.information)
        assert steps == (2.0, 0.5)
        x = round(pose[0, 3], -1)
        return (at(x).world_from_rig, GATHERED[x]) if x in GATHERED else None

    def refine(self, pose: Floats) -> RefinedPose:
        x = round(pose[0, 3], -1)
        return at(40 if x == 50 else x, others=(at(x + 4, 50.0),))

    def refine_roughly(self, pose: Floats) -> RefinedPose:
        own = at(pose[0, 3], 60.0) if pose[0, 3] % 10 == 6 else self.refine(pose)
        return replace(own, others=(), is_rough=True)

    def follow_halves(self, refined: RefinedPose) -> Iterator[Floats]:
        for x in (0, 0, 0, 6, 6, 0) if self.strays else (0, 0, 1, 0, 6, 6):
            self.halves += 1
            yield at(refined.world_from_rig[0, 3] + x, 60.0).world_from_rig


@pytest.fixture
def solver(monkeypatch: pytest.MonkeyPatch) -> Solver:
    scene = cast(Scene, SimpleNamespace(arc_occurrence=np.zeros(5)))
    made = Solver(scene, scene, LEFT, {}, cast(Any, []), [], PRIOR, DEFAULTS)
    made.__dict__["fit"] = land = Landscape()
    outlines = Outlines(np.ones(1), np.ones(1), 5.0)
    told = {
        "climb_from": land.climb,
        "measure_outlines": lambda *_: outlines,
        "describe_arc_shapes": lambda _: "shapes",
    }
    for name, answer in told.items():
        monkeypatch.setattr(localise_module, name, answer)
    return made


@pytest.mark.parametrize(
    ("x", "rule", "score", "reached"),
    [
        (1.49, "like_a_refined_one", np.nan, []), (1.51, "like_a_refined_one", 100.0, []),  # it climbs to one
        (200, "nothing_in_view", np.nan, []), (10, "little_evidence", 69.9, []), (31, "refined", 70.1, [30]),
        (50, "like_a_refined_one", 85.0, []),  # refined, it is one
    ],
)  # fmt: skip
def test_a_pose_is_followed_to_where_none_was_found(
    solver: Solver, x: float, rule: str, score: float, reached: list[int]
) -> None:
    done, pose = [at(40, 90.0), at(0)], at(x, 1.0).world_from_rig
    np.testing.assert_equal(solver.follow(pose, done), (rule, score))
    assert places(done[2:]) == reached
    assert all(h.is_rough and h.outlines for h in done[2:])
    full = [at(40, 90.0), at(0)] * 30
    assert [solver.follow(pose, some)[0] for some in (full, full[1:])] == ["beyond", rule]


def test_what_repeats_is_looked_for_within_the_prior_nearest_to_it_first(
    solver: Solver, monkeypatch: pytest.MonkeyPatch
) -> None:
    shifts: list[float] = []

    def displace(shapes: object, arc: Ints, weight: Floats, reach: float) -> Floats:
        assert (shapes, arc.tolist(), weight.tolist()) == ("shapes", [0, 4, 4], [1, 2, 3])
        assert reach == pytest.approx(6 * (20 + 0.01 * 1000))
        return np.array([[x, 0, 0] for x in shifts])

    monkeypatch.setattr(localise_module, "find_displacements", displace)
    for shifts[:], kept in (([134.9, 135.1, -144.9, -145.1], [139.9, -139.9]), (range(100, 0, -5), range(10, 70, 5))):
        found = solver.shift(at(5, 1.0), cast(Any, "shapes"))
        np.testing.assert_allclose(found[:, 0, 3], kept)


@pytest.mark.parametrize("is_open", [False, True])
def test_candidates_are_refined_and_what_repeats_about_the_best_three_times(
    solver: Solver, monkeypatch: pytest.MonkeyPatch, is_open: bool
) -> None:
    """As long as the best changes; and by halves of its arcs.  Where no prior is, the candidates alone."""
    monkeypatch.setattr(localise_module, "find_displacements", lambda *_: np.array([[20.0, 0, 0]]))
    delta, score = np.zeros((10, 6)), np.array([100.0, 31, 29, 95, 40, 50, 60, 93, 94.5, 20])
    delta[:, 0] = [0, 30, 29, 50, 0.5, 10, 200, 30, 30, 30]
    stages = [Stage("scan", delta, score, ["x"], 5), Stage("climb", delta, score, [], 7)]
    if is_open:
        solver = replace(solver, prior=Prior.open(np.eye(4)))
        solver.__dict__["fit"] = Landscape()
        monkeypatch.setattr(localise_module, "climb_from", lambda *_: (at(30).world_from_rig, 70.1))
    done, (scan, climb, *shifts) = solver.hypotheses(Perturbations(delta[:9], score[:9], stages))
    like, little, none = "like_a_refined_one", "little_evidence", "nothing_in_view"
    followed = [like, like, like, like] if is_open else ["refined", like, little, none]
    assert climb.rule == ["refined", "refined", little, *followed, little, like, "beyond"]
    assert (scan.rule, climb.looked_at) == (["x"], 7)
    assert places(done) == ([0, 30, 4] if is_open else [100, 80, 60, 40, 0, 30, 66, 86, 4, 44, 106, 64, 84, 104])
    assert [h.world_from_rig[0, 3] for h in done if h.is_rough] == ([30] if is_open else [30, 66, 86, 106])
    assert all(h.outlines for h in done)
    told = [(s.name, *s.delta[:, 0], *s.score, *s.rule, s.looked_at) for s in shifts]
    steps = [(f"shift {n}", x, reached, "refined", 1) for n, x, reached in ((1, 60, 170), (2, 80, 300), (3, 100, 400))]
    assert told == ([] if is_open else steps)
    land = cast(Any, solver.fit)
    land.strays = False  # all lead back: four are enough, three times
    assert len(solver.hypotheses(Perturbations(delta[:9], score[:9], stages))[0]) == (3 if is_open else 11)
    assert land.halves == (0 if is_open else 18 + 12)
