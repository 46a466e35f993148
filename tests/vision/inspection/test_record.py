"""The rows of one inspection against its pictures' truth, projections, and each other."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from relmodel.app.api import OpenStore
from relmodel.arrays import Floats
from relmodel.geometry.transforms import matrices
from tests.vision.inspection.conftest import DEMO, Done
from vision.cameras.cameras import perturbation
from vision.cameras.files import read_prior
from vision.inspection.inspection_parameters import DEFAULTS


def rows(store: OpenStore, statement: str) -> list[tuple[Any, ...]]:
    return list(store.query(statement))


def poses(store: OpenStore, table: str, order: str, **keys: Any) -> Floats:
    """The poses (n, 4, 4) in some rows of a table."""
    with store.read() as connection:
        return matrices(store.select(connection, table, order=order, **keys))


def test_costs_add_up(done: Done) -> None:
    store, answer = done
    asked = "SELECT hypothesis_no, cost, distance, outline_evidence, evidence_ratio FROM hypothesis ORDER BY 1"
    found = rows(store, asked)
    supports = rows(
        store,
        "SELECT hypothesis_no, sum(evidence), sum(found), sum(expected) FROM hypothesis_support GROUP BY 1 ORDER BY 1",
    )
    assert len(found) == len(supports) == len(answer.hypotheses)
    for (number, cost, distance, outlines, ratio), (other, evidence, gathered, expected) in zip(
        found, supports, strict=True
    ):
        assert number == other
        assert cost == pytest.approx(distance**2 / 2 - evidence - outlines)
        assert ratio == pytest.approx(gathered / expected)
        assert answer.hypotheses[number]["cost"] == cost
    prior = read_prior(DEMO / "pair_00_prior.yaml")
    assert answer.world_from_rig is not None
    assert found[0][2] == pytest.approx(prior.distance(answer.world_from_rig), rel=1e-6)
    # What one camera gives by itself is told of each.
    alone = rows(store, "SELECT camera, log_odds FROM solved_pose WHERE kind = 'single_camera' ORDER BY solved_no")
    assert [name for name, _ in alone] == ["left", "right"]
    assert min(odds for _, odds in alone) > 10


def test_the_search_is_told_from_the_prior_on(done: Done) -> None:
    store, _ = done
    prior = read_prior(DEMO / "pair_00_prior.yaml")
    stages = rows(store, "SELECT DISTINCT stage_no, stage, looked_at FROM search_pose ORDER BY stage_no")
    assert [number for number, _, _ in stages] == list(range(len(stages)))
    assert all(looked_at > 0 for _, _, looked_at in stages)
    left = rows(store, "SELECT stage_no, pose_no, rule FROM search_pose ORDER BY stage_no, pose_no")
    where = poses(store, "search_pose", "stage_no pose_no")
    for number, _, looked_at in stages:
        own = [k for k, row in enumerate(left) if row[0] == number]
        assert [left[k][1] for k in own] == list(range(len(own)))
        assert 0 < len(own) <= looked_at
        assert all(prior.distance(where[k]) < 8 for k in own[:3])
    best = poses(store, "hypothesis", "hypothesis_no")[0]
    refined = [where[k] for k, row in enumerate(left) if row[2] == "refined"]
    assert min(np.linalg.norm(perturbation(best, one)[:3]) for one in refined) < 20


def test_what_is_in_view_is_what_the_cameras_cover(done: Done) -> None:
    store, answer = done
    found = rows(store, "SELECT path, visible_pixels, covered_pixels, level FROM part_in_view ORDER BY in_view_no")
    assert [row[0] for row in found] == [row["path"] for row in answer.parts_in_view]
    for row, said in zip(found, answer.parts_in_view, strict=True):
        assert 0 < row[1] <= row[2]
        assert said["visible_share"] == pytest.approx(row[1] / row[2], abs=1e-4)
        assert (row[3] == "part") == (said["level"] == "part")
    arcs = rows(store, "SELECT kind, arc_no IS NULL, surface_no IS NULL, length FROM view_arc")
    assert {kind for kind, *_ in arcs} == {"sharp", "smooth", "silhouette"}
    assert all((kind == "silhouette") == no_arc and no_arc != no_surface for kind, no_arc, no_surface, _ in arcs)
    # Edges that were measured lie on arcs that the view shows, of no more px than these have.
    few = rows(
        store,
        "SELECT m.view_no, m.view_arc_no, count(*), any_value(a.length) FROM edge_measurement AS m"
        " JOIN view_arc AS a USING (run_id, view_no, view_arc_no) GROUP BY 1, 2",
    )
    assert len(few) > 100
    assert sum(n for *_, n, _ in few) > 0.9 * rows(store, "SELECT count(*) FROM edge_measurement")[0][0]


def test_thresholds_and_pictures_are_those_of_the_run(done: Done) -> None:
    store, _ = done
    thresholds = {
        (decision, name): value for decision, name, value in rows(store, "SELECT decision, name, value FROM threshold")
    }
    assert thresholds["verdict", "min_posterior"] == DEFAULTS.localisation.verdict.min_posterior
    assert thresholds["presence", "states.least_px"] == 30
    assert thresholds["presence", "account.support.chance_px[5]"] == 13
    assert thresholds["picture", "most_blur_px"] == 3.5
    assert thresholds["verdict", "needs_translation_mm"] == 3
    pictures = rows(
        store,
        "SELECT camera, camera_no, view_no, edges, blur_px, saturated, stale_run_id FROM inspection_image ORDER BY 2",
    )
    assert [(row[0], row[1], row[2]) for row in pictures] == [("left", 0, 0), ("right", 1, 1)]
    for _, _, _, edges, blur, saturated, stale in pictures:
        assert edges > 1
        assert 0 < blur < 2.5
        assert 0 <= saturated < 0.2
        assert stale is None
    expected = rows(store, "SELECT camera, name, expected, sigma FROM camera_unknown ORDER BY camera, name")
    assert len(expected) == 22
    told = {(camera, name): (mean, sigma) for camera, name, mean, sigma in expected}
    assert told["left", "response"] == told["right", "response"] == (0.25, 0.25)
    assert told["right", "centre_u"] == told["right", "centre_v"] == (0.0, 0.02)
    assert told["left", "focal"] == (0.0, 0.0)
    (values,) = rows(store, "SELECT singular_values FROM inspection")[0]
    assert sorted(values, reverse=True) == values
    assert len(values) == 6
    selected = rows(store, "SELECT count(*), count(*) FILTER (WHERE shown) FROM selected_part")[0]
    assert selected[0] >= selected[1] > 10


def test_views_are_matched_with_their_pictures(done: Done) -> None:
    store, _ = done
    problems = dict(rows(store, "SELECT problem_no, kind FROM problem ORDER BY problem_no"))
    assert problems == {0: "stereo", 1: "localisation", 2: "localisation"}
    accepted = rows(
        store,
        "SELECT c.view_no, a.length, c.residual, c.gate, c.angle, c.angle_gate FROM correspondence AS c"
        " JOIN view_arc AS a USING (run_id, view_no, view_arc_no) WHERE c.accepted",
    )
    assert len(accepted) > 60
    assert rows(store, "SELECT DISTINCT hypothesis_no FROM correspondence") == [(0,)]
    assert all(residual <= gate and angle <= widest for _, _, residual, gate, angle, widest in accepted)
    refused = rows(store, "SELECT count(*) FROM correspondence WHERE NOT accepted AND reason IS NULL")
    assert refused == [(0,)]
    units = dict(rows(store, "SELECT kind, count(*) FROM unit_set GROUP BY 1"))
    assert units["view"] == 2
    (counted,) = rows(
        store,
        "SELECT (SELECT count(*) FROM unit JOIN unit_set AS s ON s.id = unit_set_id"
        " WHERE s.kind = 'view' AND unit.kind = 'view_arc'),"
        " (SELECT count(*) FROM view_arc)",
    )
    assert counted[0] == counted[1]
