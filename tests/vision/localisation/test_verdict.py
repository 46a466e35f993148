"""The sentences of a verdict, by numbers given by hand."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from relmodel.arrays import Floats, Ints
from tests.vision.localisation.scenes import above, blocks, stereo_rig
from tests.vision.localisation.simulation import Errors, draw_edges
from vision.cameras.cameras import CalibrationSigma, Needs, Prior, Rig
from vision.localisation.hypotheses import build_fine_evidence, predict, project_with_jacobians
from vision.localisation.localisation_parameters import DEFAULTS, ElsewhereParameters
from vision.localisation.measurements import describe_unknowns
from vision.localisation.refine import RefinedPose, Shown
from vision.localisation.verdict import (
    CameraSupport,
    Chance,
    HypothesisTable,
    Misfit,
    PoseEvidence,
    Verdict,
    VerdictStatistics,
    compute_disagreement,
    compute_precision,
    doubt_face,
    draw_elsewhere,
    draw_shifts,
    find_misfit,
    find_standing,
    gather_elsewhere,
    judge,
    measure_agreement,
    weigh_against_prior,
)

Numbers = float | list[float]
FIRST = np.zeros(1, np.int64)
LITTLE = Chance(level=-2.0, scale=1.0)  # poses elsewhere gather next to nothing


def table(
    *, told: float | list[float] = np.nan, outlines: float = 1.0, **given: float | list[float]
) -> HypothesisTable:
    """Poses that gather all that is expected of them, but for what is given."""
    known = {"prior_sigma": 1.0, "evidence": 2000.0, "found": 1e3, "expected": 1e3, "outline_px": 105.0} | given
    sigma, evidence, found, expected, px, nats = np.broadcast_arrays(*map(np.atleast_1d, (*known.values(), told)))
    none = np.zeros(len(sigma))
    return HypothesisTable(sigma, evidence, found, expected, px, none + outlines, none, none > 0, nats)


SURE = PoseEvidence(0.9, 0.0, {}, LITTLE, (0.01, 1e-5, "x"), 0)


def judged(poses: HypothesisTable, evidence: PoseEvidence = SURE, standing: Ints = FIRST, mm: float = 1.0) -> Verdict:
    return judge(poses, standing, evidence, Needs(mm, 0.01), DEFAULTS.verdict)


@pytest.mark.parametrize(("found", "accepted"), [(1.013, True), (1.013, False), (0.4, False)])
def test_no_more_is_found_than_is_expected_and_zero_has_no_sign(found: float, accepted: bool) -> None:
    verdict = judged(table(evidence=2000.0 if accepted else 1.0, found=1e3 * found, outlines=-0.04))
    assert (verdict.verdict == "accepted") is accepted
    assert f"{min(round(100 * found), 100)}% of the" in verdict.reason
    assert accepted or "contrast of 0.0 along 105 px" in verdict.reason


@pytest.mark.parametrize(
    ("prior_sigma", "evidence", "share", "agreement", "accepted"),
    [
        (5.7, 40.8, 0.41, 0.81, False),  # a small object, sought in the picture of a bulkhead
        (2.7, 48.7, 0.54, 0.92, True),  # of right poses in rendered pictures the one of least odds
    ],
)
def test_what_a_wrong_pose_gathered_is_refused_and_what_a_right_one_did_is_not(
    prior_sigma: float, evidence: float, share: float, agreement: float, accepted: bool
) -> None:
    columns = (prior_sigma, evidence, 100 * share, 100.0, 100.0, 1.0, 10.0, False, np.nan)
    gathered = HypothesisTable(*(np.array([value]) for value in columns))
    verdict = judged(gathered, PoseEvidence(agreement, 0.0, {}, LITTLE, (0.1, 1e-3, "x"), 0), mm=5.0)
    assert (verdict.verdict == "accepted") is accepted, verdict.reason
    sure = "probability > 99.9 %" if verdict.posterior > 0.999 else f"probability {100 * verdict.posterior:.1f} %"
    assert not accepted or verdict.reason.startswith(sure)


@pytest.mark.parametrize("what", ["nothing", "evidence", "found", "agreement", "sigma_mm", "sigma_rad"])
def test_what_is_no_number_is_refused(what: str) -> None:
    given = {"evidence": 2000.0, "found": 1e3, "agreement": 0.9, "sigma_mm": 0.01, "sigma_rad": 1e-5} | {what: np.nan}
    evidence = replace(SURE, agreement=given["agreement"], precision=(given["sigma_mm"], given["sigma_rad"], "x"))
    verdict = judged(table(evidence=given["evidence"], found=given["found"]), evidence)
    assert verdict.verdict == ("accepted" if what == "nothing" else "refused")


def test_a_turn_about_what_is_seen_moves_nothing_of_it() -> None:
    """The middle lies a metre ahead: a turn about the rig moves it by the lever arm, unless a shift makes up for it."""
    middle, turn = np.array([0.0, 0.0, 1000.0]), np.array([0.002, 0.0, 0.0])
    about_middle = np.concatenate([-np.cross(turn, middle), turn])
    for error, mm in ((about_middle, 0.0), (np.pad(turn, (3, 0)), 2.0)):
        sigma_mm, sigma_rad, words = compute_precision(np.outer(error, error), middle)
        assert [sigma_mm, sigma_rad] == pytest.approx([mm, 0.002], abs=1e-4)
        assert words.endswith("turn about x of the rig")


@pytest.mark.parametrize(("sigma", "beyond"), [(np.nan, 0.0), (0.0, 0.0), (6**0.5, 0.0), (3.0, -1.5), (4.0, -5.0)])
def test_a_prior_takes_off_what_is_beyond_its_mean_over_right_poses(sigma: float, beyond: float) -> None:
    p = DEFAULTS.verdict
    some = VerdictStatistics(1e3, 1.5, sigma, 0.5, 0.8, 0.0, 0.0, 0.0)
    assert some.columns(p) == pytest.approx([1.5, 0.5, 0.8, beyond])
    most = VerdictStatistics(1e3, 1e9, sigma, 1e9, 0.8, 0.0, 0.0, 0.0)
    assert most.columns(p) == pytest.approx([p.most_rarity, p.most_share, 0.8, beyond])


@pytest.mark.parametrize(
    ("rarity", "share", "says"), [(12.1, 0.25, True), (12.0, 0.9, False), (30.0, 0.249, False), (12.1, 0.9, True)]
)
def test_evidence_by_chance_or_little_of_what_is_expected_says_nothing(rarity: float, share: float, says: bool) -> None:
    found = VerdictStatistics(1e3, rarity, np.nan, share, 1.0, 0.0, 0.0, 0.0)
    sure = replace(DEFAULTS.verdict, offset=0.0)
    assert found.log_odds(sure) == (pytest.approx(0.26 * rarity + 6.4 * share + 9.5) if says else 0.0)
    assert found.log_odds(replace(sure, offset=-40.0)) < -20


def test_edges_agree_by_the_length_that_lies_near_of_all_that_is_found() -> None:
    limit = DEFAULTS.verdict.agreement_px
    measured = SimpleNamespace(found=np.array([3, 4, -1, 5]), offset=limit * np.array([0.9, 1.1, 0.0, -0.9]))
    predicted = SimpleNamespace(weight=np.array([4.0, 2.0, 8.0, 1.0]), view=np.array([0, 0, 0, 1]))
    best = cast(RefinedPose, SimpleNamespace(measurements=measured, prediction=predicted))
    each = [measure_agreement(best, DEFAULTS.verdict, camera) for camera in (None, 0, 1)]
    assert each == pytest.approx([5 / 7, 4 / 6, 1.0])


def test_a_camera_is_weighed_as_a_pose_without_a_prior() -> None:
    p = DEFAULTS.verdict
    camera = CameraSupport(evidence=12.0, found=30.0, expected=60.0, agreement=0.8, chance=Chance(2.0, 5.0))
    alike = VerdictStatistics(12.0, 2.0, np.nan, 0.5, 0.8, 0.0, 0.0, 0.0)
    assert camera.log_odds(p) == pytest.approx(alike.log_odds(p))


def test_what_cameras_find_adds_up() -> None:
    support = SimpleNamespace(found=np.array([30.0, 20.0]), expected=np.array([40.0, 60.0]))
    pose = SimpleNamespace(
        prior_sigma=2.0, evidence=9.0, support=support, outlines=None, is_symmetric=False, told=np.nan, strain=1.5
    )
    table = HypothesisTable.of([cast(RefinedPose, pose)])
    assert (table.found.tolist(), table.expected.tolist(), table.share.tolist()) == ([50.0], [100.0], [0.5])
    assert (table.believed.tolist(), table.cost.tolist()) == ([3.5], [-5.5])


def accepted() -> Verdict:
    return Verdict("accepted", "it fits", 0.99, [], 0.1, 0.001, "x", {"likely": 0.99})


@pytest.mark.parametrize(("value", "verdict"), [(0.5, "accepted"), (0.6, "refused")])
def test_a_statistic_beyond_its_limit_refuses_a_pose(value: float, verdict: str) -> None:
    it = accepted().limited("absent", value, "80 px of a and b", 0.5)
    assert (it.verdict, it.weighed) == (verdict, {"likely": 0.99, "absent": value})
    assert it.missing == ["80 px of a and b"] * (verdict == "refused")
    assert it.reason.startswith("80 px of a and b") == (verdict == "refused")


def test_a_face_that_may_hold_the_pose_leaves_two_poses() -> None:
    it = doubt_face(accepted(), 4.04, "it/face 3")
    assert it.verdict == "ambiguous"
    assert it.missing == ["it/face 3 lies 4.0 mm from its place, and as many faces say that it is the others that do"]
    assert it.weighed["rival_face_mm"] == 4.04


@pytest.mark.parametrize(
    ("told", "standing"),
    [
        ([np.nan, np.nan], [0, 1]),  # not asked: the edges do not say which it is
        ([1700.0, 1700.0], [0, 1]),
        ([1700.0, 1688.1], [0, 1]),
        ([1700.0, 1687.9], [0]),  # 12 nats in favour of the first
        ([1600.0, 1700.0], [0, 1]),  # against what the edges say: one of both errs
    ],
)
def test_the_account_of_edges_tells_rivals_apart(told: list[float], standing: list[int]) -> None:
    each = [1000.0, 990.0]
    gathered = table(prior_sigma=np.nan, evidence=each, found=each, outline_px=0.0, outlines=0.0, told=told)
    found = find_standing(gathered, DEFAULTS.verdict)
    assert found.tolist() == standing
    assert judged(gathered, standing=found).verdict == ("accepted" if len(standing) == 1 else "ambiguous")


def test_a_rival_takes_its_share_by_prior_and_tempered_evidence() -> None:
    gathered = table(prior_sigma=[2.0, 3.0], evidence=[1000.0, 990.0], outline_px=0.0, outlines=0.0)
    verdict = judged(gathered, standing=np.arange(2))
    share = 1 / (1 + np.exp(-10 * DEFAULTS.verdict.temper - (9 - 4) / 2))
    assert verdict.posterior == pytest.approx(share * verdict.weighed["likely"])
    assert verdict.weighed["rivals"] == 1


@pytest.mark.parametrize(
    ("own", "joint", "sigma"),
    [
        ((80.0, 75.0), (80.0, 75.0), 0.0),  # they agree
        ((72.0, 60.0), (80.0, 75.0), 0.0),  # alone each went elsewhere, and gathers no more there
        ((101.55, 75.0), (80.0, 75.0), np.sqrt(2 * 20.0)),  # 21.55 nats, of which samples explain 1.55
        ((1505.0, 1505.0), (1500.0, 1500.0), 0.0),
        # One in 1,000 exceeds 42.31 in 18 dimensions and 22.46 in six (tables of chi-square).
        ((125.156, 100.0, 100.0, 100.0), (100.0,) * 4, np.sqrt(22.458)),
        ((1000.0, 0.0, 0.0), (0.0, 0.0, 0.0), np.sqrt(2000.0)),
    ],
)
def test_cameras_disagree_by_their_gains(own: tuple[float, ...], joint: tuple[float, ...], sigma: float) -> None:
    assert compute_disagreement(own, joint, DEFAULTS.verdict) == pytest.approx(sigma, rel=1e-4)


STATED = CalibrationSigma(focal=0.001, centre_px=0.5, translation_mm=0.2, rotation=0.001, radial=0.01)


@pytest.mark.parametrize(
    ("unknown", "by", "words"),
    [
        (1, 3.0, "the principal point that right shows lies 3.0 px right of the file's, "),
        (2, -2.5, "the principal point that right shows lies 2.5 px above the file's, "),
        (3, 0.048, "the focal length that right shows is 4.8 % greater than the file's, "),
        (3, -0.005, "the focal length that right shows is 0.5 % less than the file's, "),
        (5, 1.0, "right sits 1 mm from its place in the rig along its y axis, 5 sigma: was the "),
        (6, -2.0, "right sits 2 mm from its place in the rig along its z axis, 10 sigma: was the "),
        (9, -0.005, "right is turned by 0.29 degrees about its z axis in the rig, "),
        (10, 0.05, "the radial distortion that right shows is 0.05 greater than the file's, "),
    ],
)
def test_what_the_pictures_show_otherwise_than_the_file_is_said(unknown: int, by: float, words: str) -> None:
    """Nothing is said of what is exact, nor of the response."""
    rig = stereo_rig()
    rig = Rig(rig.cameras, rig.rig_from_camera, rig.sigma | {"right": STATED})
    own = np.zeros((2, 11))
    own[:, 0], own[0, 1:], own[1, unknown] = 9.0, 5.0, by
    found = told(rig, own)
    assert found.sigmas == pytest.approx(abs(by) / describe_unknowns(rig).sigma[1, unknown])  # errs as stated
    assert found.words.startswith(words)
    assert find_misfit(stereo_rig(), Shown(own, own, own)) is None
    assert told(rig, describe_unknowns(rig).mean).sigmas == 0
    focal = np.tile(np.arange(11) == 3, (2, 1))
    assert told(Rig(rig.cameras, rig.rig_from_camera), 0.01 * focal).sigmas == pytest.approx(5.0)
    assert told(rig, 0.002 * focal, 0.36).words.startswith("the focal length that right shows is 0.56 % greater")


def told(rig: Rig, own: Floats, share: float = 1.0) -> Misfit:
    """What is said of what pictures show of cameras, a share of what is off, where it errs as the file does."""
    found = find_misfit(rig, Shown(own, np.full(own.shape, share), describe_unknowns(rig).sigma))
    assert found is not None
    return found


@pytest.mark.parametrize(
    ("cameras", "of", "sigmas", "verdict", "named"),
    [(2, "", 3.4, "accepted", 0), (2, "", 3.6, "refused", 1), (0, "", 2.7, "accepted", 0), (0, "", 2.9, "refused", 1),
     (4, "standpoint", 2.5, "accepted", 0), (4, "standpoint", 2.7, "accepted", 1), (4, "standpoint", 3.6, "refused", 1)]
)  # fmt: skip
def test_a_calibration_that_does_not_hold_refuses_sooner_of_one_picture_and_a_standpoint_is_named_before(
    cameras: int, of: str, sigmas: float, verdict: str, named: bool
) -> None:
    support = {str(k): CameraSupport(1000.0, 1000.0, 1000.0, 0.9, LITTLE) for k in range(cameras)}
    misfit = Misfit(sigmas, "so and so", of == "standpoint")
    evidence = PoseEvidence(0.9, 0.0, support, LITTLE, (0.01, 1e-5, "x"), 0, misfit)
    found = judged(table(), evidence)
    refused = ([], None) if verdict == "accepted" else (["so and so"], "so and so")
    assert (found.verdict, found.missing, found.rig) == (verdict, *refused)
    assert (found.weighed["calibration"], "so and so" in found.reason) == (sigmas, named)
    other = judged(table(), replace(evidence, agreement=0.1))
    assert (other.rig, other.reason.count("so and so")) == (None, named)


def test_a_pose_that_contradicts_the_prior_is_refused_unless_the_pictures_are_believed() -> None:
    prior, pose = Prior.isotropic(np.eye(4), 10.0, 0.01), np.eye(4)
    pose[0, 3] = 150.0
    accepted = Verdict("accepted", "enough", 0.99, [], 1.0, 0.1, "x")
    told = "the pictures put the rig 150 mm, 15.0 sigma, from the prior"
    refused, believed = (weigh_against_prior(accepted, prior, pose, believe_pictures=it) for it in (False, True))
    assert (refused.verdict, refused.reason, refused.missing) == ("refused", told, [told])
    assert (believed.verdict, believed.reason, believed.missing) == ("accepted", f"enough; {told}", [])
    assert [it.weighed["prior_left_out"] for it in (refused, believed)] == [0.0, 1.0]


def test_a_camera_that_does_not_see_what_the_other_sees_refuses_the_pose() -> None:
    each = (("one", 390.0, 1.0), ("two", 0.0, 0.1))
    support = {name: CameraSupport(found, found, 400.0, agreement, LITTLE) for name, found, agreement in each}
    found = judged(table(), PoseEvidence(1.0, 0.0, support, LITTLE, (0.01, 1e-5, "x"), 0))
    (words,) = found.missing
    assert (found.verdict, found.blind) == ("refused", {"two": words})
    assert words.startswith("camera two does not see this: evidence of 0 where 400 is expected")


P = DEFAULTS.elsewhere


@pytest.mark.parametrize(("shift", "scale"), [(0.0, 5.0), (-30.0, 70.0)])
def test_rarity_is_that_of_the_exponential_that_was_drawn(shift: float, scale: float) -> None:
    gathered = np.random.default_rng(1).exponential(scale, 200_000) + shift
    chance = Chance.of(gathered, P)
    for evidence in (shift + 2 * scale, shift + 6 * scale):
        assert chance.rarity(evidence) == pytest.approx((evidence - shift) / scale, rel=0.02)
        assert chance.reached(chance.rarity(evidence)) == pytest.approx(evidence)


def test_what_is_gathered_besides_shifts_and_widens_chance() -> None:
    gathered = np.random.default_rng(2).exponential(3.0, 1000)
    alone, both = Chance.of(gathered, P), Chance.of(gathered, P, mean=10.0, deviation=4.0)
    assert both.scale == pytest.approx(np.hypot(alone.scale, 4.0))
    threshold = np.quantile(gathered, 1 - P.share)
    assert both.rarity(threshold + 10.0) == pytest.approx(-np.log(P.share)) == alone.rarity(threshold)


def test_where_nothing_is_gathered_chance_is_that_of_independent_places() -> None:
    assert Chance.of(np.full(50, -3.0), P).scale == P.least_scale


def test_where_nothing_is_seen_nothing_is_rare() -> None:
    scene, rig, truth = blocks(), stereo_rig(), above(10, -20, 560)
    nothing = predict(scene, rig, truth, 400).take(np.zeros(0, np.int64))
    fields = build_fine_evidence(rig, draw_edges(scene, rig, truth, Errors(), np.random.default_rng(5)))
    elsewhere = gather_elsewhere(scene, rig, nothing, fields, [], truth, DEFAULTS)
    assert elsewhere.together.rarity(0.0) == 0.0
    assert len(elsewhere.by_camera) == 2


def test_poses_elsewhere_show_everything_elsewhere() -> None:
    scene, rig, truth = blocks(), stereo_rig(), above(10, -20, 560)
    prediction = predict(scene, rig, truth, 400)
    before, _ = project_with_jacobians(prediction)
    few = ElsewhereParameters(poses=40, near_px=10.0, far_px=20.0, least_px_per_unit=1.0)
    for delta in draw_elsewhere(prediction, few):
        after, _ = project_with_jacobians(prediction, delta)
        moved = np.sqrt(((after - before) ** 2).sum(axis=1).mean())
        assert 8.0 < moved < 23.0  # the steps are laid to first order


def test_what_moves_the_picture_next_to_nothing_does_not_have_to_move_it_so_far() -> None:
    """Where no motion moves it by enough px a unit, a unit of turn and of a shift by the depth count for that many."""
    scene, rig, truth = blocks(), stereo_rig(), above(10, -20, 560)
    prediction = predict(scene, rig, truth, 400)
    few = ElsewhereParameters(poses=40, near_px=10.0, far_px=20.0, least_px_per_unit=1e5)
    depth = np.median(np.linalg.norm(prediction.point, axis=1))
    units = np.linalg.norm(draw_elsewhere(prediction, few) / np.repeat([depth, 1.0], 3), axis=1)
    assert 10.0 <= 1e5 * units.min() < 12.0
    assert 18.0 < 1e5 * units.max() <= 20.0


def test_outlines_are_shifted_by_as_much_every_way() -> None:
    shift = draw_shifts(3, ElsewhereParameters(outlined=400, near_px=10.0, far_px=20.0))
    far = np.linalg.norm(shift, axis=2)
    assert shift.shape == (400, 3, 2)
    assert 10.0 <= far.min() < 10.5
    assert 19.5 < far.max() <= 20.0
    assert np.abs((shift / far[..., None]).mean(axis=(0, 1))).max() < 0.08
    np.testing.assert_allclose((shift / far[..., None]).std(axis=(0, 1)), 0.5**0.5, rtol=0.05)


def test_cameras_add_up_elsewhere_and_outlines_add_their_mean_and_deviation(monkeypatch: pytest.MonkeyPatch) -> None:
    scene, rig, truth = blocks(), stereo_rig(), above(10, -20, 560)
    fields = build_fine_evidence(rig, draw_edges(scene, rig, truth, Errors(), np.random.default_rng(5)))
    edges = np.random.default_rng(3).exponential(7.0, (200, 2))
    monkeypatch.setattr("vision.localisation.verdict.mix_over_arcs", lambda *_: edges)
    monkeypatch.setattr("vision.localisation.verdict.measure_shifted_outlines", lambda *_: np.array([2.0, 10.0]))
    found = gather_elsewhere(scene, rig, predict(scene, rig, truth, 400), fields, [], truth, DEFAULTS)
    assert found.together == Chance.of(edges[:, 0] + edges[:, 1], P, mean=6.0, deviation=4.0)
    assert found.by_camera == [Chance.of(edges[:, 0], P), Chance.of(edges[:, 1], P)]
