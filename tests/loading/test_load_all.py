"""Several files at once: rows as of one after another, and one that is refused leaves the others."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import pytest
import sqlalchemy as sa
import trimesh

from relmodel.app.cli.main import main
from relmodel.loading import load as loading
from relmodel.loading.load import LoadRequest
from relmodel.store import Store
from tests.reading import load, read_here

# What differs from run to run: clocks and processes.
TIMES = {"began_at", "happened_at", "seconds", "process", "loaded_at", "made_at"}


def boxes(folder: Path) -> list[Path]:
    """Files of two formats, two of them alike."""
    files = []
    for name, height in (("a.stl", 10), ("b.ply", 11), ("c.stl", 10)):
        trimesh.creation.box((30, 20, height)).export(folder / name)
        files.append(folder / name)
    return files


def contents(store: Store) -> dict[str, list[Any]]:
    """All rows of all tables, but for times."""
    with store.read() as connection:
        names = [r.relation for r in connection.execute(store.table("sds_relation").select()) if r.standing != "view"]
        asked = []  # in one statement: each takes longer to ask than to answer
        for table in map(store.table, names):
            row = sa.cast(sa.func.row(*(c for c in table.columns if c.name not in TIMES)), sa.Text)
            asked.append(sa.select(sa.literal(table.name), sa.func.list_sort(sa.func.list(row))).select_from(table))
        return dict(connection.execute(sa.union_all(*asked)).tuples().all())


def test_rows_are_those_of_one_after_another(duckdb_file: Path, duckdb_template: Path, tmp_path: Path) -> None:
    files = boxes(tmp_path)
    shutil.copy(duckdb_template, tmp_path / "turns.duckdb")
    with Store.open(duckdb_file) as together, Store.open(tmp_path / "turns.duckdb") as turns:
        told: list[tuple[str, int, int]] = []
        requests = [LoadRequest(file, file.stem, unit="mm") for file in files]
        outcomes = list(loading.load_all(together, requests, lambda *step: told.append(step), reader=read_here))
        assert [request for request, _ in outcomes] == requests
        assert [(done, of) for _, done, of in told] == sorted((done, 3) for _, done, _ in told)
        for i, file in enumerate(files):
            first, *_, last = [what for what, done, _ in told if done == i]
            assert (first, last) == (f"{file.name}: reading", f"{file.name}: storing")
        assert "a.stl: recognising features, shape 1 of 1" in [what for what, _, _ in told]
        assert [outcome for _, outcome in outcomes] == [load(turns, f, name=f.stem, unit="mm") for f in files]
        found = contents(together)
        assert found == contents(turns)
        assert len(found["surface"]) == 12


@pytest.mark.usefixtures("reads_here")
def test_one_that_is_refused_leaves_the_others_on_the_command_line(
    duckdb_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    a, b, c = (str(f) for f in boxes(tmp_path))
    (tmp_path / "bad.stl").write_bytes(b"no mesh")
    target = ["--unit", "mm", "--store", str(duckdb_file)]
    assert main(["load", a, b, "--object", "box", *target]) == 0
    capsys.readouterr()
    assert main(["load", c, str(tmp_path / "gone.stl"), str(tmp_path / "bad.stl"), a, *target]) == 3
    said = capsys.readouterr().err.splitlines()
    assert [line.split(",")[0] for line in said[:2]] == [
        "c",
        f"relmodel load: there is no file {tmp_path}/gone.stl: check its name",
    ]
    assert "bad.stl" in said[2]
    assert said[3].startswith("a,")
    with Store.open(duckdb_file, read_only=True) as store, store.read() as connection:
        named = {(r.name, r.variant) for r in connection.execute(store.table("object_variant").select())}
        statuses = [r.status for r in connection.execute(store.table("load_report").select())]
    assert named == {("a", ""), ("c", ""), ("box", "a"), ("box", "b")}
    assert sorted(statuses) == ["added"] * 4 + ["refused"] * 2
    assert main(["load", a, b, "--object", "box", "--variant", "A", *target]) == 2
    assert main(["load", a, a, *target]) == 2


@pytest.mark.usefixtures("reads_here")
def test_an_occluder_on_the_command_line_stays_triangles(
    duckdb_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A cylinder of 64 sides: a fitted cylinder between planes when inspected, else facets between two creases."""
    post = trimesh.creation.cylinder(radius=50, height=200, sections=64)
    post.export(tmp_path / "post.ply")
    target = [str(tmp_path / "post.ply"), "--unit", "mm", "--store", str(duckdb_file)]
    assert main(["load", *target, "--object", "inspected"]) == 0
    assert main(["load", *target, "--object", "robot", "--occluder"]) == 0
    assert "1 parts placed 1 times" in capsys.readouterr().err
    with Store.open(duckdb_file, read_only=True) as store, store.read() as connection:
        kinds = sorted(r.kind for r in connection.execute(store.table("surface").select()))
        shapes = connection.execute(store.table("shape").select()).all()
        triangles = [len(r.triangles) // 3 for r in connection.execute(store.table("shape_mesh").select())]
        run = max(connection.execute(store.table("run").select()), key=lambda r: r.id)
    assert kinds == ["cylinder", *["facets"] * 3, "plane", "plane"]
    assert sorted((s.surface_count, s.arc_count) for s in shapes) == [(3, 2), (3, 2)]
    assert triangles == [len(post.faces)] * 2
    assert run.parameters["occluder"] is True
    assert run.parameters["mesh"]["arcs"]["convexity_rad"] == pytest.approx(0.0174533)
    assert run.parameters["features"]["circles"]["least_distance"] == 20.0
    assert {"step", "snap"} <= run.parameters.keys()
