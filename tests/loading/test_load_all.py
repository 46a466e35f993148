"""Several files at once: rows as of one after another, and one that is refused leaves the others."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import pytest
import trimesh

from relmodel.app.cli.main import main
from relmodel.errors import InputError
from relmodel.loading import load as loading
from relmodel.loading.load import LoadRequest
from relmodel.store import Store
from tests.reading import load, load_all

# What differs from run to run: clocks and processes.
TIMES = {"began_at", "happened_at", "seconds", "process", "loaded_at", "made_at"}


def boxes(folder: Path) -> list[Path]:
    """Files of two formats, two of them alike."""
    files = []
    for name, height in (("a.stl", 10), ("b.ply", 11), ("c.stl", 10), ("d.stl", 12)):
        trimesh.creation.box((30, 20, height)).export(folder / name)
        files.append(folder / name)
    return files


def contents(store: Store) -> dict[str, list[Any]]:
    """All rows of all tables, but for times."""
    with store.read() as connection:
        names = [r.relation for r in connection.execute(store.table("sds_relation").select()) if r.standing != "view"]
        out = {}
        for name in sorted(names):
            table = store.table(name)
            columns = [c for c in table.columns if c.name not in TIMES]
            out[name] = sorted(
                repr(tuple(row)) for row in connection.execute(table.select().with_only_columns(*columns))
            )
        return out


def test_rows_are_those_of_one_after_another(duckdb_file: Path, duckdb_template: Path, tmp_path: Path) -> None:
    files = boxes(tmp_path)
    shutil.copy(duckdb_template, tmp_path / "turns.duckdb")
    with Store.open(duckdb_file) as together, Store.open(tmp_path / "turns.duckdb") as turns:
        told: list[tuple[str, int, int]] = []
        requests = [LoadRequest(file, file.stem, unit="mm") for file in files]
        outcomes = list(load_all(together, requests, lambda *step: told.append(step)))
        assert [request for request, _ in outcomes] == requests
        assert [(done, of) for _, done, of in told] == sorted((done, 4) for _, done, _ in told)
        for i, file in enumerate(files):
            first, *_, last = [what for what, done, _ in told if done == i]
            assert (first, last) == (f"{file.name}: reading", f"{file.name}: storing")
        assert "a.stl: recognising features, shape 1 of 1" in [what for what, _, _ in told]
        assert [outcome for _, outcome in outcomes] == [load(turns, f, name=f.stem, unit="mm") for f in files]
        assert contents(together) == contents(turns)


def test_one_that_is_refused_leaves_the_others(duckdb_template: Path, tmp_path: Path) -> None:
    files = boxes(tmp_path)
    files[1].write_bytes(b"no mesh")
    shutil.copy(duckdb_template, tmp_path / "store.duckdb")
    with Store.open(tmp_path / "store.duckdb") as store:
        requests = [LoadRequest(f, f.stem, unit="mm") for f in (tmp_path / "gone.stl", *files)]
        outcomes = [outcome for _, outcome in load_all(store, requests)]
        assert [isinstance(o, InputError) for o in outcomes] == [True, False, True, False, False]
        with store.read() as connection:
            names = {r.name for r in connection.execute(store.table("object_variant").select())}
            assert names == {"a", "c", "d"}
            statuses = [r.status for r in connection.execute(store.table("load_report").select())]
            assert sorted(statuses) == ["added", "added", "added", "refused", "refused"]


@pytest.mark.usefixtures("reads_here")
def test_several_files_on_the_command_line(
    duckdb_template: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    files = [str(f) for f in boxes(tmp_path)]
    shutil.copy(duckdb_template, tmp_path / "store.duckdb")
    target = ["--unit", "mm", "--store", str(tmp_path / "store.duckdb")]
    assert main(["load", *files[:2], *target]) == 0
    assert main(["load", *files[:2], "--object", "box", *target]) == 0
    capsys.readouterr()
    assert main(["load", files[2], str(tmp_path / "gone.stl"), files[3], *target]) == 3
    said = capsys.readouterr().err.splitlines()
    assert [line.split(",")[0] for line in said] == [
        "c",
        f"relmodel load: there is no file {tmp_path}/gone.stl: check its name",
        "d",
    ]
    with Store.open(tmp_path / "store.duckdb", read_only=True) as store, store.read() as connection:
        named = {(r.name, r.variant) for r in connection.execute(store.table("object_variant").select())}
    assert named == {("a", ""), ("b", ""), ("c", ""), ("d", ""), ("box", "a"), ("box", "b")}
    assert main(["load", *files[:2], "--object", "box", "--variant", "A", *target]) == 2
    assert main(["load", files[0], files[0], *target]) == 2


@pytest.mark.usefixtures("reads_here")
def test_an_occluder_on_the_command_line_stays_triangles(
    duckdb_template: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A cylinder of 64 sides: a fitted cylinder between planes when inspected, else facets between two creases."""
    shutil.copy(duckdb_template, tmp_path / "store.duckdb")
    post = trimesh.creation.cylinder(radius=50, height=200, sections=64)
    post.export(tmp_path / "post.ply")
    target = [str(tmp_path / "post.ply"), "--unit", "mm", "--store", str(tmp_path / "store.duckdb")]
    assert main(["load", *target, "--object", "inspected"]) == 0
    assert main(["load", *target, "--object", "robot", "--occluder"]) == 0
    assert "1 parts placed 1 times" in capsys.readouterr().err
    with Store.open(tmp_path / "store.duckdb", read_only=True) as store, store.read() as connection:
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


@pytest.mark.data
def test_step_files_side_by_side(data_dir: Path, duckdb_template: Path, tmp_path: Path) -> None:
    """Read by children, and then one after another in this process."""
    files = [data_dir / "step" / name for name in ("cube-in.step", "cube-m.step")]
    stores = []
    for name in ("together", "turns"):
        shutil.copy(duckdb_template, tmp_path / f"{name}.duckdb")
        stores.append(Store.open(tmp_path / f"{name}.duckdb"))
    with stores[0] as together, stores[1] as turns:
        reports = [report for _, report in loading.load_all(together, [LoadRequest(f, f.stem) for f in files])]
        assert reports == [load(turns, f, name=f.stem) for f in files]
        assert contents(together) == contents(turns)
