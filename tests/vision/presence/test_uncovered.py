"""What shows where a part should be: by simulated edges of two cameras, and in pictures of a missing bolt."""

from __future__ import annotations

from itertools import product
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
import yaml

import relmodel
from tests.reading import load
from tests.vision.localisation.scenes import box_scene
from tests.vision.presence.test_displaced_parts import RIG, RIG_POSE
from vision.account.runs import weigh_runs
from vision.account.samples import collect_samples, find_nearby, look_at_sides, measure_support
from vision.localisation.hypotheses import EdgePoints
from vision.localisation.measurements import EdgeIndex
from vision.localisation.views import view_model
from vision.presence.displaced import Displacements, Uncovered, look_beneath
from vision.presence.items import Items
from vision.presence.presence_parameters import DEFAULTS as P
from vision.presence.states import Signs, find_missing
from vision.presence.surfaces import SceneSurfaces
from vision.scene import StoredScene

BLOCK = np.array([60.0, 40.0, 12.0])
PLATE = (np.array([-250.0, -200.0, -30.0]), np.array([500.0, 400.0, 30.0]))
PAD = (np.array([-140.0, -92.0, 0.0]), np.array([36.0, 22.0, 4.0]))  # beneath the first of two blocks
SCENE = box_scene([PLATE, PAD, (np.array([-150.0, -100.0, 0.0]), BLOCK), (np.array([80.0, 50.0, 0.0]), BLOCK)])
PATHS = ["it/plate", "it/pad", "it/covering", "it/other"]


def stored() -> StoredScene:
    """The scene with its names: an arc along one axis lies between faces across the other two."""
    across = {axis: [2 * a for a in range(3) if a != axis] for axis in range(3)}
    sides = [[across[axis][0] + u, across[axis][1] + v] for axis, u, v in product(range(3), (0, 1), (0, 1))]
    arcs, faces, none = 12 * len(PATHS), 6 * len(PATHS), np.zeros(len(PATHS), np.int64)
    beside = np.concatenate([6 * box + np.array(sides) for box in range(len(PATHS))])
    radius, numbers = np.full(faces, np.nan), np.arange(len(PATHS))
    return StoredScene(SCENE, 1, numbers, PATHS, none, np.zeros(arcs, int), np.zeros(faces, int), beside, radius, {})


def uncovered(missing: list[int]) -> Uncovered:
    """What is found beneath pieces where the model has all and some boxes are missing in the pictures."""
    there = SCENE.without(np.isin(np.arange(len(PATHS)), missing))
    model, view, rng = stored(), view_model(SCENE, RIG, RIG_POSE), np.random.default_rng(5)
    indexes = []
    for arcs in view_model(there, RIG, RIG_POSE).arcs.values():
        seen, bounds = arcs.samples, (np.zeros(2), np.array([800.0, 600.0]))
        normal = np.stack([-seen.direction[:, 1], seen.direction[:, 0]], axis=1)
        place, count = seen.pixel + 0.2 * normal * rng.normal(size=(len(normal), 1)), len(normal)
        points = EdgePoints(place, normal, np.full(count, 40.0), np.full(count, 0.1), *bounds, 200.0)
        indexes.append(EdgeIndex(points))
    within = [(index.edges.low, index.edges.high) for index in indexes]
    samples = collect_samples(model, RIG, within, RIG_POSE, view.arcs, P.account.samples)
    sides = look_at_sides(SCENE, RIG, RIG_POSE, samples, P.account.sides)
    nearby = find_nearby(samples.camera, samples.pixel, samples.direction, indexes, np.zeros(2), P.account.samples)
    runs = weigh_runs(samples, measure_support(samples, nearby, P.account.support), sides, P.account.runs)
    maps = list(view.maps.values())
    return look_beneath(model, RIG, RIG_POSE, indexes, np.zeros(2), samples, sides, runs, maps, P)


def test_what_a_missing_part_covers_is_found_in_its_place() -> None:
    """A part that is surely found is not looked beneath, nor one that covers no edge; the plate determines the pose."""
    assert np.isnan(uncovered([]).log_odds).all()
    found = uncovered([2])
    assert found.beneath[2] > 5
    assert found.own[2] < -5
    assert np.isnan(found.log_odds[[0, 1, 3]]).all()
    bare = uncovered([1, 2])  # nothing of both shows
    assert bare.beneath[2] < 0
    assert bare.own[2] < -5
    assert np.isnan(uncovered([3]).log_odds).all()


def test_a_scene_without_a_part_neither_shows_nor_hides_it() -> None:
    rest = SCENE.without(np.array([False, False, True, False]))
    eye = np.array([-120.0, -80, 500])
    (through,) = rest.rays.nearest(eye, np.array([[0.0, 0, -1]]))
    (onto,) = SCENE.rays.nearest(eye, np.array([[0.0, 0, -1]]))
    assert SCENE.surface_occurrence[SCENE.triangle_surface[onto]] == 2
    assert rest.surface_occurrence[rest.triangle_surface[through]] == 1
    assert np.unique(rest.arc_occurrence[rest.sample_arc]).tolist() == [0, 1, 3]
    assert len(rest.arc_occurrence) == len(SCENE.arc_occurrence)


@pytest.mark.parametrize("kind", ["far", "turned"])
@pytest.mark.parametrize(
    ("beneath", "own", "displaced", "resized", "missing"),
    [
        (3.1, -4.0, 0.0, 0.0, True),
        (0.1, -7.0, 0.0, 0.0, True),
        (-0.1, -9.0, 0.0, 0.0, False),  # what lies beneath rather does not show
        (3.1, -3.8, 0.0, 0.0, False),  # it is not sure in the place of the part
        (6.0, -6.0, 11.9, 0.0, True),
        (6.0, -6.0, 12.1, 0.0, False),  # it is likelier displaced
        (6.0, -6.0, 0.0, 5.9, True),
        (6.0, -6.0, 0.0, 6.1, False),  # or two faces of it are
        (np.nan, np.nan, 0.0, 0.0, False),
    ],
)
def test_a_part_is_missing_where_that_is_the_likeliest(
    beneath: float, own: float, displaced: float, resized: float, missing: bool, kind: str
) -> None:
    """Of two parts with two faces each, of which the second part is in question."""
    items = SimpleNamespace(
        occurrence=np.array([0, 1, 0, 0, 1, 1]),
        member=np.array([0, 0, 1, 1, 2, 3, 4, 5]),
        surface=np.array([0, 1, 2, 3, 0, 1, 2, 3]),
    )
    moved = {name: np.array([displaced > 0 and name == kind]) for name in ("far", "turned")}
    places = SimpleNamespace(occurrence=np.array([1]), log_odds=np.array([displaced]), **moved)
    faces = SimpleNamespace(moved=np.array([True, False, True, True]), log_odds=np.array([50, 0, resized, resized]))
    it = Uncovered(np.array([np.nan, beneath]), np.array([np.nan, own]))
    signs = SimpleNamespace(
        displacements=cast(Displacements, places), surfaces=cast(SceneSurfaces, faces), uncovered=it
    )
    found = find_missing(cast(Items, items), cast(Signs, signs), P.states)
    assert found.tolist() == [False, missing, False, False, missing, missing]


@pytest.mark.data
def test_a_missing_bolt_is_told_as_missing_and_not_as_the_hole_beneath_it(
    data_dir: Path, duckdb_file: Path, tmp_path: Path
) -> None:
    folder = data_dir / "gearbox"
    truth = np.loadtxt(folder / "truth_view0.txt")
    stated = {"world_from_rig": truth.tolist(), "sigma": {"translation_mm": 3, "rotation_deg": 0.5}}
    (tmp_path / "prior.yaml").write_text(yaml.safe_dump(stated))
    with relmodel.open(duckdb_file, read_only=False) as store:
        load(store, folder / "gearbox_A.step", name="gearbox", variant="A")
        store.place(folder / "world.yaml")
        picture = {"right": folder / "bolt0_right.png"}
        found = store.inspect(rig=folder / "stereo.yaml", pictures=picture, prior=tmp_path / "prior.yaml")
    assert found.presence is not None
    said = {item["path"]: item for item in found.presence["items"] if item["level"] == "part"}
    bolt = said["gearbox/BOLT_3"]
    assert (bolt["state"], bolt["reason"]) == ("contradicted", "what it covers shows in its place")
    assert bolt["measured"] == []
    assert {path for path, item in said.items() if item["state"] == "confirmed"} >= {
        "gearbox/HOUSING",
        "gearbox/BOLT_4",
    }
    assert all(path.startswith("gearbox/BOLT_3") for path in found.presence["look_at"])
