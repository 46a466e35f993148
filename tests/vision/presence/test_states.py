"""States by hand-made evidence: each limit from both sides, and which of several signs is told."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from relmodel.arrays import Floats
from relmodel.geometry.transforms import rotation_matrix
from vision.account.runs import EdgeRuns
from vision.presence.displaced import Displacements, Measures, Uncovered
from vision.presence.items import NONE, Appearance, Items, UnexplainedElements
from vision.presence.presence_parameters import DEFAULTS as P
from vision.presence.presence_parameters import DistanceParameters
from vision.presence.states import REASONS, STATES, Presence, Signs, decide, measure_distances
from vision.presence.surfaces import FacePairs, SceneSurfaces
from vision.scene import Scene

Edge = tuple[tuple[int, int], float, float, float, float, float]  # surfaces, px, distinct px, found, log odds, expected
SURFACES = 5  # 0 and 1 make a web, 2 is the wall of a hole in face 0, 3 and 4 belong to a second part
EMPTY: Any = [np.zeros(0)]
NAMES = ["part", "web", "hole", "face", "other"]


def items() -> Items:
    count, nan = len(NAMES), np.full(len(NAMES), np.nan)
    return Items(
        level=["part", "feature", "feature", "surface", "part"], occurrence=np.array([0, 0, 0, 0, 1]),
        feature_no=np.array([NONE, 0, 1, NONE, NONE]), surface_no=np.array([NONE, NONE, NONE, 0, NONE]),
        path=NAMES, kind=["", "web", "through_hole", "", ""], visible_px=np.ones(count), thickness=nan,
        member=np.array([0, 0, 0, 1, 1, 2, 3, 4, 4]), surface=np.array([0, 1, 2, 0, 1, 2, 0, 3, 4]),
        inset=np.arange(SURFACES) == 2,
    )  # fmt: skip


def signs(*edges: Edge, cameras: int = 1, stopped: int | None = None, looks: tuple[int, float] = (0, 0.0)) -> Signs:
    """What the edges say, each in every camera; the hole looks stopped, or an item as it does with such log odds."""
    surface, px, distinct, found, odds, expected = zip(*edges, strict=True)
    n, whole = len(edges), np.zeros(SURFACES)
    lit = np.tile(np.array(odds)[:, None], (1, 3))
    camera, none = np.repeat(np.arange(cameras), n), np.tile(np.arange(n), cameras)
    runs = EdgeRuns(
        np.zeros(n, int), np.arange(n), np.zeros(n, int), np.arange(n), np.array(surface), np.array(px),
        np.array(distinct), np.array(found), np.zeros(n), np.ones(n), np.array(odds), np.array(expected), lit,
    ).take(none)  # fmt: skip
    nan, vectors = np.full(SURFACES, np.nan), np.full((SURFACES, 3), np.nan)
    nothing = FacePairs(*(np.zeros(0, int) for _ in range(6)))
    faces = SceneSurfaces(
        whole > 0, whole - 9, nan, nan, vectors, nan, whole > 0, np.zeros((SURFACES, 3)), np.zeros((SURFACES, 3)),
        whole + 100, nothing,
    )  # fmt: skip
    seen, two = np.array([looks[0], 2]), np.zeros(2)
    look = Appearance(
        seen, np.zeros(2, int), two, two, two, two, np.array([looks[1], 0.0]), np.array([False, stopped is not None])
    )
    places = Displacements(np.zeros(0, int), np.zeros((0, 3)), np.zeros((0, 3, 3)), *EMPTY * 5)
    return Signs(
        runs=replace(runs, camera=camera), absent=np.full(len(NAMES), -9.0), surfaces=faces, appearance=look,
        displacements=replace(places, far=np.zeros(0, bool), turned=np.zeros(0, bool)),
        uncovered=Uncovered(*np.full((2, 2), np.nan)), distances=Measures.stack([no_measures()]),
        unexplained=UnexplainedElements(*EMPTY * 8),
    )  # fmt: skip


def known(it: Signs) -> Signs:
    """With all faces measured in their places."""
    return replace(it, surfaces=replace(it.surfaces, mm=np.zeros(SURFACES), sigma=np.full(SURFACES, 0.1)))


def no_measures() -> Measures:
    return Measures(np.zeros(0, int), np.zeros(0, int), [], np.zeros(0), np.zeros(0), np.zeros(0), np.zeros(0, bool))


def said(it: Presence) -> dict[str, tuple[str, str]]:
    return {name: (STATES[s], REASONS[r]) for name, s, r in zip(NAMES, it.state, it.reason, strict=True)}


def decided(it: Signs, cameras: int = 1) -> Presence:
    return decide(items(), np.full(SURFACES, np.nan), it, [str(k) for k in range(cameras)], P.states)


@pytest.mark.parametrize(
    ("edge", "state", "why"),
    [
        ((60, 60, 0.9, 3.0, 4), "confirmed", "its edges are found"),
        ((60, 60, 0.9, 2.9, 4), "undecidable", "some of its edges are found, some are not"),
        ((60, 60, 1.0, 2.9, 4), "undecidable", "its edges are found, which may be chance"),
        ((60, 60, 0.0, -2.9, 4), "undecidable", "none of its edges is found, which so few may hide"),
        ((60, 60, 0.0, -2.9, 1.9), "undecidable", "little contrast is expected of its edges"),
        ((60, 60, 0.0, -3.0, 1.9), "undecidable", "little contrast is expected of its edges"),
        ((60, 60, 0.0, -3.0, 2.0), "not_confirmed", "its edges are not found, where they would show"),
        ((60, 60, 0.0, -6.9, 2.0), "not_confirmed", "its edges are not found, where they would show"),
        ((60, 60, 0.0, -7.0, 1.9), "undecidable", "little contrast is expected of its edges"),
        ((60, 60, 0.0, -7.0, 2.0), "contradicted", "its edges are not found, where they would show"),
        ((60, 60, 0.2, -10.1, 9), "not_confirmed", "its edges are not found, where they would show"),
        ((60, 60, 0.2, -10.3, 9), "contradicted", "its edges are not found, where they would show"),
        (
            (60, 29, 0.9, 9.0, 9),
            "undecidable",
            "its edges lie too near to others, to the picture's border, or in light that hides them",
        ),
        ((29, 29, 0.9, 9.0, 9), "undecidable", "its edges are too short in the picture"),
        ((30, 30, 0.9, 9.0, 9), "confirmed", "its edges are found"),
        ((0, 0, 0.0, 0.0, 0), "undecidable", "no sharp edge of it is in view"),
    ],
)
def test_each_limit_holds_from_both_sides(edge: tuple[float, ...], state: str, why: str) -> None:
    px, distinct, found, odds, expected = edge
    assert said(decided(signs(((3, 4), px, distinct, found, odds, expected))))["other"] == (state, why)


def test_cameras_and_edges_add_up() -> None:
    """Two edges of 20 px in two cameras are 80 px, and their log odds the sum."""
    it = decided(signs(((3, 4), 20, 20, 0.5, 0.8, 1), ((3, 3), 20, 15, 1.0, 0.8, 1), cameras=2), 2)
    row = NAMES.index("other")
    assert it.evidence.log_odds[row] == pytest.approx([1.6, 1.6])
    assert it.evidence.edge_px[row].tolist() == [40, 40]
    assert it.evidence.distinct_px[row].tolist() == [35, 35]
    assert it.evidence.supported_px[row].tolist() == [25, 25]
    assert it.evidence.expected_log_odds[row].tolist() == [2, 2]
    assert said(it)["other"][0] == "confirmed"


@pytest.mark.parametrize(
    ("odds", "state"),
    [
        ([-8, -2], "contradicted"),
        ([-3, -7], "contradicted"),
        ([-5, -4.8], "not_confirmed"),
        ([-7.1, 2], "not_confirmed"),
        ([-7, 0, 0, 0], "contradicted"),  # the last three see nothing of it
    ],
)
def test_two_pictures_of_what_is_not_seen_are_worth_the_root_of_two(odds: list[float], state: str) -> None:
    """Seven log odds are asked of one."""
    both = signs(((3, 4), 60, 60, 0.0, 1.0, 9), cameras=len(odds))
    each = np.array(odds)[both.runs.camera]
    lit = np.zeros_like(both.runs.in_light) + each[:, None]
    runs = replace(both.runs, log_odds=each, in_light=lit, weight_px=np.where(each != 0, both.runs.weight_px, 0.0))
    assert said(decided(replace(both, runs=runs), len(odds)))["other"][0] == state


@pytest.mark.parametrize(
    ("px", "distinct", "why"),
    [
        (20, 20, "its edges are found"),
        (20, 10, "its edges lie too near to others, to the picture's border, or in light that hides them"),
        (10, 10, "its edges are too short in the picture"),
    ],
)
def test_what_cameras_see_of_an_edge_is_long_enough_together(px: float, distinct: float, why: str) -> None:
    """Of 30 px."""
    assert said(decided(signs(((3, 4), px, distinct, 0.9, 2.0, 3), cameras=2), 2))["other"][1] == why


@pytest.mark.parametrize("odds", [4.0, -4.0])
def test_the_rim_of_a_hole_speaks_for_the_face_that_it_is_in_and_never_against_it(odds: float) -> None:
    it = decided(signs(((0, 2), 60, 60, 0.5, odds, 3)))
    total = dict(zip(NAMES, it.evidence.log_odds.sum(axis=1), strict=True))
    assert total["hole"] == total["part"] == pytest.approx(odds)
    assert total["face"] == total["web"] == pytest.approx(max(odds, 0.0))
    expected = dict(zip(NAMES, it.evidence.expected_log_odds.sum(axis=1), strict=True))
    assert (expected["hole"], expected["face"]) == (3, 0)


def test_of_a_hole_that_shows_nothing_less_is_asked() -> None:
    for odds, state in ((-4.9, "not_confirmed"), (-5.0, "contradicted")):
        assert said(decided(signs(((0, 2), 60, 60, 0.0, odds, 2.0))))["hole"][0] == state


def test_the_rim_of_a_hole_beneath_a_spot_face_is_an_edge_of_that_too() -> None:
    nested = replace(items(), inset=np.isin(np.arange(SURFACES), [0, 2]))  # face 0 is the floor of the spot face
    it = decide(nested, np.full(SURFACES, np.nan), signs(((0, 2), 60, 60, 0.0, -7.0, 3)), ["0"], P.states)
    assert said(it)["hole"] == said(it)["face"] == ("contradicted", "its edges are not found, where they would show")


def test_looks_count_with_edges_and_a_stopped_hole_is_contradicted() -> None:
    edge: Edge = ((0, 2), 60, 60, 0.9, 2.0, 3)
    assert said(decided(signs(edge)))["hole"][0] == "undecidable"
    looks = signs(edge, looks=(2, 1.0))
    assert said(decided(known(looks)))["hole"][0] == "confirmed"
    assert said(decided(looks))["hole"] == ("undecidable", "a size of it may differ from the model's")
    stopped = said(decided(signs(((0, 2), 60, 60, 0.9, 9.0, 3), stopped=2)))
    assert stopped["hole"] == ("contradicted", "something else shows through it than lies behind")
    assert stopped["part"] == ("changed", "a feature of it is not as modelled")
    gone = said(decided(signs(((0, 2), 60, 60, 0.1, -9.0, 5), stopped=2)))
    assert gone["hole"] == ("contradicted", "its edges are not found, where they would show")


LARGE: Edge = ((0, 1), 600, 600, 0.9, 9.0, 9)
SMALL: Edge = ((3, 4), 60, 60, 0.9, 9.0, 9)


@pytest.mark.parametrize(
    ("name", "odds", "state"),
    [("part", -0.1, "confirmed"), ("part", 0.0, "not_confirmed"),
     ("other", 2.9, "confirmed"), ("other", 3.0, "not_confirmed")],
)  # fmt: skip
def test_what_is_found_pays_for_no_edge_that_should_show(name: str, odds: float, state: str) -> None:
    """The part of nine tenths of the edges holds the pose: there even odds are too much."""
    absent = np.where(np.array(NAMES) == name, odds, -9.0)
    it = decided(replace(signs(LARGE, SMALL), absent=absent))
    why = {"confirmed": "its edges are found", "not_confirmed": "an edge of it that should show does not"}
    assert said(it)[name] == (state, why[state])


@pytest.mark.parametrize(("absent", "holding"), [(-1.0, [0, 1]), (0.1, [1]), (0.1, [0, 1])])
def test_the_pose_is_held_by_what_lacks_no_edge_where_that_shows_enough(absent: float, holding: list[int]) -> None:
    other = SMALL if holding == [0, 1] else ((3, 4), 300, 300, 0.9, 9.0, 9)
    it = decided(replace(signs(LARGE, other), absent=np.array([absent, -9, -9, -9, -9.0])))
    assert it.find_holding_parts(P.states).tolist() == holding


@pytest.mark.parametrize(("odds", "explained"), [(9.0, []), (-5.0, [2]), (-9.0, [2])])
def test_what_is_told_missing_explains_its_edges(odds: float, explained: list[int]) -> None:
    """A hole that is not found does; a body whose edge is not found does not."""
    it = decided(signs(((0, 2), 60, 60, float(odds > 0), odds, 9), ((3, 4), 60, 60, 0.0, -9.0, 9)))
    assert np.flatnonzero(it.find_explained_surfaces()).tolist() == explained
    assert np.flatnonzero(decided(moved(signs(SMALL))).find_explained_surfaces()).tolist() == [0, 3]


@pytest.mark.parametrize(("kind", "explained"), [("web", []), ("rib", [1])])
def test_a_missing_rib_explains_its_edges_but_those_of_faces_that_are_found(kind: str, explained: list[int]) -> None:
    """Face 0, which belongs to it too, is found; a web says nothing of what is missing of it."""
    of = replace(items(), kind=["", kind, "through_hole", "", ""])
    edges = signs(((0, 0), 60, 60, 1.0, 4.0, 9), ((1, 1), 90, 90, 0.0, -29.0, 19))
    it = decide(of, np.full(SURFACES, np.nan), known(edges), ["0"], P.states)
    assert said(it)["web"][0] == "contradicted"
    assert np.flatnonzero(it.find_explained_surfaces()).tolist() == explained


@pytest.mark.parametrize(
    ("odds", "expected", "inset", "state"),
    [(-3.0, 4.0, 2, "not_confirmed"), (-2.9, 3.0, 2, "confirmed"), (3.0, 3.0, 2, "confirmed"),
     (-3.0, 4.0, 1, "confirmed"), (-9.0, 4.0, 2, "contradicted"), (-9.0, 4.0, 1, "confirmed")],
)  # fmt: skip
def test_no_hole_passes_with_a_wall_that_does_not_show(odds: float, expected: float, inset: int, state: str) -> None:
    """As that of a spot face, of a hole whose other edges are found; faces that are not set in may be hidden."""
    of = items()
    member, surface = np.array([0, 0, 0, 1, 2, 2, 3, 4, 4]), np.array([0, 1, 2, 0, 1, 2, 2, 3, 4])
    hole = replace(of, member=member, surface=surface, inset=np.arange(SURFACES) == inset)
    edges = signs(((2, 2), 60, 60, 0.1, odds, expected), ((1, 1), 60, 60, 0.9, 12, 12))
    told = said(decide(hole, np.full(SURFACES, np.nan), known(edges), ["0"], P.states))
    assert told["hole"][0] == state
    assert told["part"][0] == {"not_confirmed": state, "contradicted": "changed"}.get(state, "confirmed")
    assert told["face"][0] == {-9.0: "contradicted", -3.0: "not_confirmed", 3.0: "confirmed"}.get(odds, "undecidable")


@pytest.mark.parametrize(
    ("mm", "sigma", "aside", "log_odds", "state", "why"),
    [
        (0.5, 0.14, 0.0, 2.0, "changed", "its size differs from the model's"),  # 3.6 sigma
        (0.5, 0.15, 0.0, 2.0, "not_confirmed", "a size of it may differ from the model's"),
        (0.5, 0.17, 0.0, -0.1, "confirmed", "its edges are found"),
        (0.5, 0.17, 0.0, 0.0, "undecidable", "a size of it may differ from the model's"),  # as likely moved as not
        (0.5, 0.14, 0.0, 0.0, "changed", "its size differs from the model's"),  # wherever its rims count as found
        (-0.5, 0.14, 0.0, 0.0, "changed", "its size differs from the model's"),
        (-0.5, 0.14, 0.3, 0.0, "changed", "its size differs from the model's"),
        (-0.5, 0.14, 0.31, 0.0, "not_confirmed", "a size of it may differ from the model's"),  # one side is in place
        (0.39, 0.12, 0.0, 2.0, "not_confirmed", "a size of it may differ from the model's"),
        (0.39, 0.095, 0.0, 2.0, "changed", "its size differs from the model's"),  # 4.1 sigma, however little that is
        (0.1, 0.25, 0.0, -0.1, "confirmed", "its edges are found"),
        (0.1, 0.26, 0.0, -0.1, "undecidable", "a size of it may differ from the model's"),  # known to .52 mm of 10
        (0.39, 0.14, 0.0, -0.1, "confirmed", "its edges are found"),
    ],
)
def test_a_diameter_has_changed_from_so_many_sigmas_and_mm(
    mm: float, sigma: float, aside: float, log_odds: float, state: str, why: str
) -> None:
    """A bore of 10 mm, of which either side lies so far inward of a middle that lies aside."""
    it, wall = signs(((0, 2), 60, 60, 0.9, 9.0, 9)), np.arange(SURFACES) == 2
    faces = replace(
        it.surfaces, mm=np.where(wall, mm, np.nan), sigma=np.where(wall, sigma, np.nan), inward=wall,
        shift=np.where(wall[:, None], [aside, 0.0, 0.0], np.nan), shift_sigma=np.where(wall, sigma, np.nan),
        log_odds=np.where(wall, log_odds, 0.0),
    )  # fmt: skip
    told = said(decide(items(), np.where(wall, 5.0, np.nan), replace(it, surfaces=faces), ["0"], P.states))
    assert told["hole"] == (state, why)
    of_part = {"changed": "a feature of it is not as modelled", "not_confirmed": "a feature of it is in doubt"}
    found = ("confirmed", "its edges are found")
    assert told["part"] == ((state, of_part[state]) if state in of_part else found)


@pytest.mark.parametrize(("mm", "sigma", "doubted"), [(0.85, 0.28, 1), (-0.85, 0.28, 1), (0.85, 0.29, 0),
                                                      (0.79, 0.1, 0), (0.1, 1.0, 0), (0.1, 1.01, 2)])  # fmt: skip
def test_a_face_that_is_off_with_its_edges_in_place_is_in_doubt(mm: float, sigma: float, doubted: int) -> None:
    """Or, where its place is not known to 1 mm, undecidable."""
    it, face = signs(((0, 1), 60, 60, 0.9, 5.0, 6)), np.arange(SURFACES) == 0
    faces = replace(it.surfaces, mm=np.where(face, mm, np.nan), sigma=np.where(face, sigma, np.nan))
    assert (
        said(decided(replace(it, surfaces=faces)))["face"][0] == ("confirmed", "not_confirmed", "undecidable")[doubted]
    )


@pytest.mark.parametrize(("sigma", "doubted"), [(0.1249, 1), (0.1251, 0)])
def test_a_bore_of_which_half_a_rim_is_off_is_in_doubt_however_little(sigma: float, doubted: int) -> None:
    it, wall = signs(((0, 2), 60, 60, 0.9, 9.0, 9)), np.arange(SURFACES) == 2
    faces = replace(it.surfaces, mm=np.where(wall, -0.5, np.nan), sigma=np.where(wall, sigma, np.nan))
    assert said(decided(replace(it, surfaces=faces)))["hole"][0] == ("confirmed", "not_confirmed")[doubted]


def moved(it: Signs, odds: float = 8.0) -> Signs:
    """Faces 0 and 3 are found 1.5 mm outward, surely."""
    at = np.isin(np.arange(SURFACES), [0, 3])
    mm, sigma = np.where(at, 1.5, np.nan), np.where(at, 0.1, np.nan)
    return replace(it, surfaces=replace(it.surfaces, moved=at, log_odds=np.where(at, odds, 0.0), mm=mm, sigma=sigma))


def test_a_face_that_has_moved_changes_what_it_belongs_to() -> None:
    """Unless too little of it shows, which is undecidable: then none of its sizes counts as changed."""
    it = decided(moved(signs(((0, 1), 60, 60, 0.9, 5.0, 6))))
    told = said(it)
    assert told["face"] == told["web"] == ("changed", "its edges are found displaced")
    assert told["part"] == ("changed", "a feature of it is not as modelled")
    row = NAMES.index("face")
    assert (it.moved_mm[row], it.moved_sigma_mm[row], it.moved_log_odds[row]) == (1.5, 0.1, 8.0)
    assert {NAMES[k] for k in it.measures.item[it.measures.changed]} == {"face", "web"}
    short = decided(moved(signs(((0, 1), 29, 29, 0.9, 5.0, 6))))
    assert {state for state, _ in said(short).values()} == {"undecidable"}
    assert not short.measures.changed.any()


@pytest.mark.parametrize(("face", "missing"), [(15.9, True), (16.1, False)])
def test_a_part_in_whose_place_shows_what_it_covers_is_missing(face: float, missing: bool) -> None:
    """Where that, 7 + 9 nats, is likelier than that its face has moved to the rim beneath it."""
    seen = moved(signs(((3, 4), 60, 60, 0.4, 2.0, 6), ((0, 1), 60, 60, 0.9, 5.0, 6)), face)
    it = decided(replace(seen, uncovered=Uncovered(np.array([np.nan, 7.0]), np.array([np.nan, -9.0]))))
    told, row = said(it), NAMES.index("other")
    assert (told["other"] == ("contradicted", "what it covers shows in its place")) == missing
    assert told["face"][0] == told["web"][0] == "changed"
    assert it.uncovered_log_odds[row] == 16
    assert np.isnan(np.delete(it.uncovered_log_odds, row)).all()


CENTRES = np.array([[0.0, 0, 0], [100.0, 0, 0], [100.0, 60, 4], [400.0, 0, 0], [50.0, 20, 80]])
RADIUS = 12.0
TILT = rotation_matrix(np.array([[0.4, -0.3, 1.1]]))[0]


def measured(shift: Floats, sigma: Floats) -> Measures:
    """Bores 10 deep, the fourth 70, all but the last with middles equally deep, each aside by a shift (n, 3)."""
    depth = np.array([10.0, 10, 10, 70, 10])
    angle = np.linspace(0, 4 * np.pi / 3, 24) + 1.3 * np.arange(len(CENTRES))[:, None]
    around = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=2)
    ends = depth[:, None, None] * np.array([-0.5, 0.5])[:, None] * [0, 0, 1.0]
    ring = CENTRES[:, None, None] + RADIUS * around[:, None] + ends[:, :, None]
    strip = np.array([[k, k + 1, k + 24] for k in range(23)] + [[k + 1, k + 25, k + 24] for k in range(23)])
    count = len(CENTRES)
    scene = SimpleNamespace(
        vertices=ring.reshape(-1, 3) @ TILT.T,
        vertex_normals=-np.repeat(around[:, None], 2, axis=1).reshape(-1, 3) @ TILT.T,
        triangles=np.concatenate([strip + 48 * k for k in range(count)]),
        triangle_surface=np.repeat(np.arange(count), len(strip)),
    )
    items = SimpleNamespace(
        level=["part", *["feature"] * count],
        occurrence=np.zeros(count + 1, np.int64),
        member=np.arange(1, count + 1),
        surface=np.arange(count),
        inset=np.ones(count, bool),
    )
    surfaces = SimpleNamespace(shift=shift @ TILT.T, shift_sigma=sigma, mm=np.where(np.isnan(sigma), np.nan, 0.0))
    parts = (cast(Items, items), cast(Scene, scene), np.full(count, RADIUS), cast(SceneSurfaces, surfaces))
    return measure_distances(*parts, DistanceParameters())


def between(found: Measures, a: int, b: int) -> int:
    (row,) = np.flatnonzero((found.item == a + 1) & (found.other == b + 1))
    return int(row)


def test_distances_are_those_of_the_axes_where_they_were_found() -> None:
    shift = np.array([[0.3, 0, 0], [-2.0, 0, 0], [0.0, 3, 0], [0.0, 0, 0], [0.0, 0, 0]])
    found = measured(shift, np.array([0.1, 0.2, 0.3, 0.1, 0.1]))
    for a, b in ((0, 1), (1, 2), (0, 2)):
        row = between(found, a, b)
        assert found.nominal[row] == pytest.approx(np.linalg.norm((CENTRES[b] - CENTRES[a])[:2]), abs=1e-6)
        away = (CENTRES + shift)[b] - (CENTRES + shift)[a]
        assert found.value[row] == pytest.approx(np.linalg.norm(away[:2]), abs=1e-6)
    assert found.sigma[between(found, 0, 1)] == pytest.approx(np.hypot(0.1, 0.2))
    assert found.changed[between(found, 0, 1)]
    assert not found.changed[between(found, 0, 3)]


def test_what_shifts_all_alike_is_the_pose_and_changes_nothing() -> None:
    found = measured(np.tile([3.0, -1.0, 0.0], (5, 1)), np.full(5, 0.1))
    np.testing.assert_allclose(found.value, found.nominal, atol=1e-6)
    assert not found.changed.any()


def test_other_levels_and_what_was_not_measured_are_left_out() -> None:
    found = measured(np.zeros((5, 3)), np.array([0.1, np.nan, 0.1, 0.1, 0.1]))
    assert set(found.item.tolist()) | set(found.other.tolist()) == {1, 3, 4}
