"""What is the same model however its rows lie, and what is another."""

from __future__ import annotations

import shutil
from pathlib import Path

import duckdb
import pytest

from benchmarks.load_snapshot import GONE, differences, keep
from relmodel.store import Store
from tests.reading import load

HEAD = Path(__file__).parents[1] / "examples/cell/head.urdf"
BACK = """
SELECT * REPLACE (list_reverse(hull_x) AS hull_x, list_reverse(hull_y) AS hull_y, list_reverse(hull_z) AS hull_z)
FROM rows
"""
SWAPPED = """
FROM rows WHERE shape_id <> 3 OR arc_no <> 0
UNION ALL
SELECT * REPLACE (normals_b AS normals_a, normals_a AS normals_b) FROM rows WHERE shape_id = 3 AND arc_no = 0
"""
MARKED = ("part", "SELECT *, shape_id = 3 AS supplemental FROM rows")
WITHOUT = ("part", "FROM rows WHERE shape_id <> 3")
Changes = list[tuple[str, str]]

SAME: dict[str, tuple[Changes, Changes]] = {
    "rows in another order": ([], [(table, "FROM rows ORDER BY id DESC") for table in ("arc", "surface", "shape")]),
    "corners in another order": ([], [("shape", BACK)]),
    "other identities": (
        [],
        [("arc", "SELECT * REPLACE (99 - id AS id) FROM rows")]
        + [(table, "SELECT * REPLACE (99 - arc_id AS arc_id) FROM rows") for table in ("shape_arc", "coedge")],
    ),
}
OTHER: dict[str, tuple[Changes, Changes]] = {
    "a radius": ([], [("arc", "SELECT * REPLACE (radius + 1e-6 AS radius) FROM rows")]),
    "a surface fewer": ([], [("surface", "FROM rows WHERE id > 1")]),
    "no surfaces": ([], [("surface", "FROM rows WHERE false")]),
    "a surface of another shape": (
        [],
        [("shape_surface", "SELECT * REPLACE (if(surface_id = 1, 2, surface_id) AS surface_id) FROM rows")],
    ),
    "a surface more": ([], [("surface", "FROM rows UNION ALL SELECT * REPLACE (0 AS id) FROM rows WHERE id = 1")]),
    "a part fewer": ([], [("object_part", "FROM rows WHERE part_id > 1")]),
    "exchanged normals": ([], [("shape_arc_sample", SWAPPED)]),
    "corners elsewhere": ([], [("shape", "SELECT * REPLACE (list_reverse(hull_x) AS hull_x) FROM rows")]),
    "a solid that is called construction geometry": ([MARKED], [WITHOUT]),
}


@pytest.fixture(scope="module")
def kept(tmp_path_factory: pytest.TempPathFactory, duckdb_template: Path) -> Path:
    folder = tmp_path_factory.mktemp("kept")
    store = shutil.copy(duckdb_template, tmp_path_factory.mktemp("store") / "head.duckdb")
    with Store.open(store) as opened:
        load(opened, HEAD, name="head")
    keep(Path(store), folder)
    (folder / "outcome.txt").write_text("0\n")
    return folder


@pytest.mark.parametrize("case", [*SAME, *OTHER])
def test_what_is_another_model(case: str, kept: Path, tmp_path: Path) -> None:
    for side, changes in zip(("old", "new"), (SAME | OTHER)[case], strict=True):
        shutil.copytree(kept, tmp_path / side)
        for table, ask in changes:
            rows = duckdb.read_parquet(str(kept / f"{table}.parquet"))
            rows.query("rows", ask).write_parquet(str(tmp_path / side / f"{table}.parquet"))
    said = [one for one in differences(tmp_path / "old", tmp_path / "new") if not one.startswith(GONE)]
    assert bool(said) == (case in OTHER), said
