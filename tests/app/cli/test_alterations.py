"""One value altered, or one row deleted, of what an inspection wrote: somebody notices."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from benchmarks.alterations import alter, measure
from relmodel.store import Store
from relmodel.store.check import check
from tests.app.cli.conftest import Inspection


def test_alterations_are_noticed(inspection: Inspection, tmp_path: Path) -> None:
    found = measure(Path(inspection.store), inspection.answer["run"], 4, 3, tmp_path)
    assert [one for one in found if one.noticed_by == "nobody"] == []


@pytest.mark.parametrize("relation", ["image_arc", "image_blob", "unit_relation", "run_input", "presence"])
def test_alterations_are_noticed_on_postgresql(
    relation: str, postgresql_inspection: Inspection, copy_store: Callable[[str], str]
) -> None:
    with Store.open(copy_store(postgresql_inspection.store)) as store:
        assert not any(finding.rows for finding in check(store))
        random = np.random.default_rng(1)
        assert alter(store, postgresql_inspection.answer["run"], relation, random).noticed_by != "nobody"
