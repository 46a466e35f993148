"""STEP files of many kernels load, and the store says what of."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from relmodel.store import Store
from relmodel.store.check import check
from tests.reading import load

# Faces that a product of the file has, distinct parts, placed parts.  What other files give is read by `test_exact.py`.
EXPECTED = {
    "abstract_pca.step": (9, 2, 2),
    "as1-tu-203.stp": (53, 5, 18),
    "conical-surface.step": (5, 1, 1),
    "nist_ftc_08_asme1_ap242-e1-tg.stp": (273, 1, 1),
}


@pytest.mark.data
def test_files_load_and_are_reported(data_dir: Path, duckdb_file: Path) -> None:
    with Store.open(duckdb_file) as store:
        for name in EXPECTED:
            load(store, data_dir / "step" / name, name=name)
        assert not [finding for finding in check(store) if finding.rows]
        with store.read() as connection:
            rows = connection.exec_driver_sql(
                "SELECT v.name, r.status, r.message, r.faces_in_file, r.faces_loaded, r.parts, r.occurrences"
                " FROM load_report AS r JOIN object_variant AS v ON v.id = r.object_variant_id"
            ).all()
    assert {row[0]: tuple(row[4:]) for row in rows} == EXPECTED
    for name, status, message, in_file, came, *_ in rows:
        assert (status, message, in_file) == ("added", None, came), name
        text = (data_dir / "step" / name).read_text("latin-1")
        listed = len(re.findall(r"=\s*(?:ADVANCED|COMPLEX_TRIANGULATED)_FACE\s*\(", text))
        assert listed == came, name
