"""A pair matched by itself: what its arcs are in space lies on the model where the truth has it."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import cKDTree

from relmodel.errors import UsageError
from relmodel.store import Store
from tests.app.cli.conftest import Pair
from tests.vision.inspection.conftest import DEMO, Done
from vision.inspection.stereo_pair import match_pair
from vision.scene import read_scene


@pytest.fixture(scope="module")
def apart(duckdb_template: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    file = tmp_path_factory.mktemp("stereo") / "apart.duckdb"
    file.write_bytes(duckdb_template.read_bytes())
    return file


def test_matched_arcs_lie_on_the_model(done: Done, apart: Path, pair: Pair) -> None:
    store, _ = done
    with Store.open(apart, read_only=False) as own:
        answer = match_pair(own, rig=pair.rig_file, pictures={"left": pair.left, "right": pair.right})
        with own.read() as connection:
            assert own.select(connection, "run", "kind", id=answer.run)["kind"].tolist() == ["stereo"]
    names, rows = answer.rows()
    assert names == ("kind", "left", "right", "curve", "start", "end", "sigma_mm")
    truth = json.loads((DEMO / "pair_00_truth.json").read_text())
    pose = np.array(truth["world_from_rig"])
    with store.read() as connection:
        (world,) = store.rows(connection, "world/current")
        scene = read_scene(store, connection, world.world_id).scene
    tree = cKDTree(scene.sample_point)
    arcs = [row for row in rows if row[0] == "arc"]
    ends = np.array([[row[4], row[5]] for row in arcs]).reshape(-1, 3)
    sigma = np.repeat([row[6] for row in arcs], 2)
    away = np.asarray(tree.query(ends @ pose[:3, :3].T + pose[:3, 3])[0])
    # Shadows and reflections are matched too: half of the ends are sure to lie where the model has an arc.
    assert (sigma < 4).sum() > 40
    assert np.median(away[sigma < 4]) < 1.5
    assert np.median(away[sigma > 10]) > 2 * np.median(away[sigma < 4])
    assert {row[3] for row in arcs} <= {"line", "circle", "ellipse", "free"}
    numbers = [row[1] for row in arcs]
    assert numbers == sorted(set(numbers))
    regions = [row for row in rows if row[0] == "region"]
    assert len(regions) > 5
    assert all(row[3:] == (None, None, None, None) for row in regions)
    assert len({row[2] for row in regions}) == len(regions)


def test_a_pair_is_two_pictures_of_two_places(apart: Path) -> None:
    with Store.open(apart, read_only=False) as own, pytest.raises(UsageError, match="stereo is of two pictures"):
        match_pair(own, rig=DEMO / "pair_00_rig.yaml", pictures={"left": DEMO / "pair_00_left.png"})
