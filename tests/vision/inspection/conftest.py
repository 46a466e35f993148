"""One inspected store that the tests of this folder read."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
import yaml

import relmodel
from relmodel.app.api import OpenStore
from tests.reading import load
from vision.inspection import Inspection

DEMO = Path(__file__).parents[3] / "examples/demo"
Done = tuple[OpenStore, Inspection]


@pytest.fixture(scope="session")
def done(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Done]:
    file = tmp_path_factory.mktemp("inspected") / "cell.duckdb"
    relmodel.create(file).close()
    with relmodel.open(file, read_only=False) as store:
        load(store, DEMO / "bulkhead_A.step.gz", name="bulkhead", variant="A")
        store.place(DEMO / "world.yaml")
        pictures = {name: DEMO / f"pair_00_{name}.png" for name in ("left", "right")}
        # A rig that is exact: residuals are then of the cameras as the file has them.
        rig, prior = file.parent / "rig.yaml", DEMO / "pair_00_prior.yaml"
        stated = yaml.safe_load((DEMO / "pair_00_rig.yaml").read_text())
        rig.write_text(yaml.safe_dump(stated | {"sigma": {"centre_px": 0}}))
        yield store, store.inspect(rig=rig, pictures=pictures, prior=prior, serial="SN-1", operator="me")
