"""Loading files into stores on both engines: what is added, what is shared, what is left after a failure."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sqlalchemy as sa
import trimesh

from relmodel.errors import InputError, StoreError
from relmodel.loading import load as loading
from relmodel.model.model import Assembly, Instance, Model, Part
from relmodel.readers import ReadOptions
from relmodel.readers.step import shape as step_shape
from relmodel.store import Store
from tests.conftest import make_reader
from tests.given import NewStore
from tests.parts import solids
from tests.parts.step_parts import compound, write_solids
from tests.readers.test_exact import faces_of_rare_kinds
from tests.reading import load, read_here, store_model
from tests.store.amiss import MODEL, flaws

MODEL_LEVELS = {"object", "part", "surface"}
BOX = trimesh.creation.box((1, 2, 3)).export(file_type="stl")


def write_box(path: Path, height: float) -> Path:
    path.parent.mkdir(exist_ok=True)
    trimesh.creation.box(bounds=[[0, 0, 0], [30, 20, height]]).export(path)
    return path


def row_counts(store: Store) -> dict[str, int]:
    """Rows of each table of the model, and of the sources that it came from."""
    with store.read() as connection:
        catalogue = connection.execute(store.table("sds_relation").select()).all()
        mine = (r for r in catalogue if r.level in MODEL_LEVELS and r.standing != "view")
        names = sorted(r.relation for r in mine if r.relation not in ("load_report", "load_finding"))
        counts = (sa.select(sa.literal(n), sa.func.count()).select_from(store.table(n)) for n in [*names, "source"])
        return {name: int(count) for name, count in connection.execute(sa.union_all(*counts))}


def test_a_second_load_adds_nothing_and_a_variant_what_changed(duckdb_file: Path, tmp_path: Path) -> None:
    low, high = write_box(tmp_path / "box.stl", 10), write_box(tmp_path / "high" / "box.stl", 11)
    with Store.open(duckdb_file) as store:
        first = load(store, low, name="box", variant="A", unit="mm")
        assert (first.status, first.revision) == ("added", 1)
        assert str(first) == (
            "added: box variant A, revision 1: parts 1, placed 1, surfaces 6; "
            "new to the store: shapes 1, surfaces 6, arcs 12"
        )
        assert (first.parts, first.occurrences, first.faces_loaded) == (1, 1, 6)
        assert (first.shapes_added, first.surfaces_added, first.arcs_added) == (1, 6, 12)
        before = row_counts(store)
        assert before["surface"] == before["loop"] == 6
        assert before["arc"] == before["shape_arc"] == 12
        assert before["coedge"] == 24
        with store.read() as connection:
            sides = connection.execute(sa.text("SELECT convexity, angle FROM surface_adjacency")).all()
            levels = connection.execute(sa.text("SELECT level, count(*) FROM shape_box GROUP BY level")).all()
        assert {row.convexity for row in sides} == {"convex"}
        assert [row.angle for row in sides] == pytest.approx([np.pi / 2] * len(sides))
        assert sorted(map(tuple, levels)) == [("arc", 12), ("feature", 1), ("surface", 6)]

        again = load(store, low, name="box", variant="A", unit="mm")
        assert (again.status, again.object_variant_id) == ("unchanged", first.object_variant_id)
        assert row_counts(store) == before

        # The bottom and the four edges around it stay.
        second = load(store, high, name="box", variant="B", unit="mm")
        assert (second.status, second.revision) == ("added", 1)
        assert (second.shapes_added, second.surfaces_added, second.arcs_added) == (1, 5, 8)
        after = row_counts(store)
        assert after["surface"] == 11
        assert after["arc"] == 20
        assert after["shape_surface"] == 12

        assert not flaws(store, *MODEL)

        third = load(store, high, name="box", variant="A", unit="mm")
        assert (third.status, third.revision, third.object_id) == ("added", 2, second.object_id)
        changed = {name for name, count in row_counts(store).items() if count != after[name]}
        assert changed == {"object_variant"}


def test_the_hull_is_that_of_the_triangles_but_of_what_fills_its_box(duckdb_file: Path, tmp_path: Path) -> None:
    ball, write = trimesh.creation.icosphere(subdivisions=2, radius=10), tmp_path / "ball.stl"
    ball.export(write)
    with Store.open(duckdb_file) as store:
        load(store, write, name="ball", unit="mm")
        load(store, write_box(tmp_path / "box.stl", 10), name="box", unit="mm")
        with store.read() as connection:
            shapes = store.select(connection, "shape", "hull_x", "hull_y", "hull_z", order="id")
        assert [shapes[name][1] for name in shapes] == [None, None, None]
        corners = np.stack([np.asarray(shapes[name][0], float) for name in shapes], axis=1)
        far = np.linalg.norm(corners[:, None] - ball.vertices, axis=2)
        assert far.min(axis=0).max() < 1e-3, "each vertex of a ball is a corner of its hull"


def test_a_failure_leaves_only_the_run(fresh_store: str, tmp_path: Path) -> None:
    path = write_box(tmp_path / "box.stl", 10)
    with Store.open(fresh_store) as store:
        empty = row_counts(store)

        def within_itself(path: Path, options: ReadOptions) -> Model:
            model = read_here(path, options)
            loop = Instance("again", "assembly", model.root, np.eye(4))
            root = model.assemblies[model.root]
            return replace(model, assemblies=(replace(root, instances=(*root.instances, loop)),))

        with pytest.raises(InputError, match="contains itself"):
            loading.load(store, path, name="box", unit="mm", reader=within_itself)
        assert row_counts(store) == empty
        with store.read() as connection:
            (report,) = connection.execute(store.table("load_report").select())
            assert (report.status, report.source_id) == ("refused", None)
            assert "contains itself" in report.message
            events = connection.execute(store.table("run_event").select()).all()
            assert [e.name for e in events if e.kind == "step"] == ["read", "unfinished"]
            assert [e.state for e in events if e.kind != "step"] == [None, "failed"]


def write_step(path: Path, radii: list[float]) -> Path:
    """A plate with a pocket and a hole of each radius."""
    part = solids.Part(solids.box((0, 0, 0), (200, 60, 20)))
    part.cut(solids.box((150, 10, 8), (180, 50, 28)))
    part.cut(*(solids.cylinder((30 + 40 * i, 30, -1), radius, 30) for i, radius in enumerate(radii)))
    return write_solids(path, part.body)


def test_a_step_variant_adds_what_changed(duckdb_file: Path, tmp_path: Path) -> None:
    base, variant = (write_step(tmp_path / f"{n}.step", r) for n, r in (("a", [5.0, 6.0]), ("b", [5.0, 8.0])))
    with Store.open(duckdb_file) as store:
        first = load(store, base, name="plate", variant="A")
        assert first.faces_in_file == first.faces_loaded == first.surfaces_added == 6 + 5 + 2
        second = load(store, variant, name="plate", variant="B")
        # The bore, and the two planes that it pierces; its two rims and its seam.
        assert (second.shapes_added, second.surfaces_added, second.arcs_added) == (1, 3, 3)
        assert not flaws(store, *MODEL)
        with store.read() as connection:
            features = connection.execute(store.table("feature").select()).all()
            classes = {r.id: r.kind for r in connection.execute(store.table("feature_class").select())}
            kinds = [classes[f.feature_class_id] for f in features]
            assert (kinds.count("through_hole"), kinds.count("pocket")) == (4, 2)
            assert len(classes) == 5  # bores of 10, 12 and 16 mm, a pocket, and the body


@pytest.fixture(scope="module")
def refusing(new_store: NewStore) -> Iterator[Store]:
    with Store.open(new_store("duckdb")) as store:
        yield store


@pytest.mark.parametrize(
    ("name", "content", "given", "said"),
    [
        ("part.doc", b"x", {"unit": None}, "an unknown format"),
        ("part.stl", b"", {}, "is empty"),
        ("part.stl", b"x", {"unit": None}, "--unit mm"),
        ("part.stl", b"x", {"unit": "furlong"}, "not a unit of length"),
        ("part.glb", b"x", {}, "leave --unit out"),
        ("gone.stl", None, {}, "there is no file"),
        ("part.stl", BOX, {"name": None}, "under the name None: name the object"),
        ("part.stl", BOX, {"name": ""}, "under the name '': name the object"),
        ("part.stl", BOX, {"name": " \t"}, "name the object"),
        ("part.stl", BOX, {"variant": None}, "as the variant None: give text"),
    ],
)
def test_a_bad_call_leaves_a_run_that_failed(
    name: str, content: bytes | None, given: dict[str, Any], said: str, tmp_path: Path, refusing: Store
) -> None:
    path = tmp_path / name
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(InputError, match=said):
        load(refusing, path, **({"name": "part", "unit": "mm"} | given))
    with refusing.read() as connection:
        assert not connection.execute(refusing.table("object").select()).all()
        ended = [e for e in connection.execute(refusing.table("run_event").select()).all() if e.kind == "ended"]
        assert len(ended) == len(connection.execute(refusing.table("run").select()).all())
    assert {e.state for e in ended} == {"failed"}


def test_a_store_that_cannot_be_written_is_told_in_a_sentence(tmp_path: Path, fresh_store: str) -> None:
    """One that is open for reading only, one that a role may only read, and one that is closed."""
    trimesh.creation.box((1, 2, 3)).export(tmp_path / "box.stl")
    opened = Store.open(fresh_store)
    opened.close()
    with pytest.raises(StoreError, match="is closed: open it again"):
        load(opened, tmp_path / "box.stl", name="box", unit="mm")
    with Store.open(fresh_store, read_only=True) as store:
        with pytest.raises(StoreError, match="is open for reading only: open it without read_only"):
            load(store, tmp_path / "box.stl", name="box", unit="mm")
        with store.read() as connection:
            assert not connection.execute(store.table("run").select()).all()
    if store.dialect == "postgresql":
        with (
            Store.open(make_reader(fresh_store)) as store,
            pytest.raises(StoreError, match=r"^the store .* denies this \(permission denied for [^\n]*$"),
        ):
            load(store, tmp_path / "box.stl", name="box", unit="mm")


def test_what_offset_and_swept_ones_are_made_from_is_stored_and_shared(duckdb_file: Path) -> None:
    faces = faces_of_rare_kinds()
    shape = step_shape.extract(compound(*(faces[i] for i in (1, 3, 5, 8, -1))))
    assembly = Assembly("root", (Instance("sheet", "part", 0, np.eye(4)),))
    parts = (Part("1", "sheet", 0),)
    model = Model("STEP", "millimetre", 1.0, (shape,), parts, (assembly,), 0, 5, "test")
    with Store.open(duckdb_file) as store:
        first = store_model(store, model, "rare")
        counts = row_counts(store)
        assert counts["arc_offset"] > 0
        assert len(shape.surface_swept["surface_no"]) < counts["surface_swept"]
        assert store_model(store, model, "rare").status == "unchanged"
        assert {k: v for k, v in row_counts(store).items() if k.startswith(("arc", "surface"))} == {
            k: v for k, v in counts.items() if k.startswith(("arc", "surface"))
        }
        assert first.surfaces_added > 5
        assert not flaws(store, *MODEL)
