"""Edge elements and arcs against the exact visible edges of rendered bulkheads."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import cKDTree

from vision.cameras.images import read_picture
from vision.extraction.extract import Extraction, extract

pytestmark = pytest.mark.data

PICTURES = ("C/pairs/pair_00_left",)


@pytest.fixture(scope="module", params=PICTURES)
def case(request: pytest.FixtureRequest, data_dir: Path) -> tuple[Extraction, dict[str, np.ndarray]]:
    base = data_dir / "bulkhead" / request.param
    with np.load(f"{base}_edges.npz") as truth:
        seen = np.isin(truth["kind"], (0, 3)) & (np.abs(truth["contrast"]) > 10)
        inside = (np.abs(truth["uv"] - [639.5, 479.5]) < [630, 470]).all(axis=1)
        samples = {name: truth[name][seen & inside].astype(np.float64) for name in ("uv", "normal2d", "contrast")}
    return extract(read_picture(f"{base}.png").grey), samples


def test_visible_edges_have_elements(case: tuple[Extraction, dict[str, np.ndarray]]) -> None:
    found, truth = case
    distance, _ = cKDTree(np.column_stack([found.edges.x, found.edges.y])).query(truth["uv"])
    assert np.mean(distance < 2.0) > 0.96


def test_arcs_cover_the_visible_edges_and_lie_on_them(case: tuple[Extraction, dict[str, np.ndarray]]) -> None:
    found, truth = case
    element = found.arcs.elements
    tree = cKDTree(np.column_stack([found.edges.x, found.edges.y])[element])
    distance, nearest = (np.asarray(column) for column in tree.query(truth["uv"]))
    assert np.mean(distance < 2.0) > 0.85
    strong = (distance < 2.0) & (np.abs(truth["contrast"]) > 50)
    at = element[nearest[strong]]
    normal, uv = truth["normal2d"][strong], truth["uv"][strong]
    offset = np.abs((found.edges.x[at] - uv[:, 0]) * normal[:, 0] + (found.edges.y[at] - uv[:, 1]) * normal[:, 1])
    assert np.median(offset) < 0.4


def test_predicted_sigma_is_plausible_and_regions_cover_the_picture(
    case: tuple[Extraction, dict[str, np.ndarray]],
) -> None:
    found, _ = case
    assert found.regions.area.sum() == 1280 * 960
    assert 50 < len(found.regions) < 500
    assert np.all(found.edges.sigma <= 0.5)
    assert np.median(found.noise) == pytest.approx(255 / (2 * np.sqrt(7000)), rel=0.25)  # shot noise through gamma 1/2


def test_an_arc_takes_part_in_a_junction_once_and_relations_are_of_two(
    case: tuple[Extraction, dict[str, np.ndarray]],
) -> None:
    junctions, relations = case[0].junctions, case[0].relations
    met = np.column_stack([junctions.junction, junctions.arc])
    assert len(np.unique(met, axis=0)) == len(met) > 100
    assert np.bincount(junctions.junction).min() > 1
    rows = np.column_stack([relations.kind, relations.a, relations.b])
    assert len(np.unique(rows, axis=0)) == len(rows)
    assert np.all(relations.a != relations.b)
