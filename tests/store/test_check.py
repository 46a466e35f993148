"""Each integrity query finds the fault it is for, and finds nothing in a sound model."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from relmodel.store import Run, Store, sql
from relmodel.store.check import check
from tests.given import NewStore
from tests.store.amiss import amiss

Model = dict[str, dict[str, Any]]

CORNERS = np.array([[0, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, 0]], float)


def box(low: Any, high: Any) -> dict[str, list[float]]:
    low, high = np.atleast_2d(low).astype(float), np.atleast_2d(high).astype(float)
    columns = {f"{axis}0": low[:, i].tolist() for i, axis in enumerate("xyz")}
    return columns | {f"{axis}1": high[:, i].tolist() for i, axis in enumerate("xyz")}


def transform(degrees: float, shift: Any) -> dict[str, list[float]]:
    """A turn about z and a shift, as columns of one row."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    rows = np.column_stack([[[c, -s, 0], [s, c, 0], [0, 0, 1]], shift])
    return {f"m{i}{j}": [float(rows[i, j])] for i in range(3) for j in range(4)}


def plate() -> Model:
    """A rectangle of 2 x 1 mm as a part, in an object, in another, in a world, turned by 90 degrees and shifted."""
    ends = np.roll(CORNERS, -1, axis=0)
    arcs: dict[str, Any] = {
        "id": [1, 2, 3, 4],
        "content_key": list("abcd"),
        "kind": "line",
        "recognised_kind": "line",
        "t0": 0.0,
        "t1": 1.0,
        "length": [2.0, 1.0, 2.0, 1.0],
        "provenance": "exact",
    }
    for i, axis in enumerate("xyz"):
        arcs[f"start_{axis}"], arcs[f"end_{axis}"] = CORNERS[:, i].tolist(), ends[:, i].tolist()
    arcs |= box(np.minimum(CORNERS, ends), np.maximum(CORNERS, ends))
    surface: dict[str, Any] = {
        "id": [1],
        "content_key": "s",
        "support_key": "s",
        "kind": "plane",
        "provenance": "exact",
    }
    surface |= {"recognised_kind": "plane", "direct": True, "reversed": False, "area": 2.0}
    surface |= dict.fromkeys(("origin_x", "origin_y", "origin_z", "axis_x_y", "axis_x_z", "axis_z_x", "axis_z_y"), 0.0)
    surface |= {"axis_x_x": 1.0, "axis_z_z": 1.0, "u0": 0.0, "u1": 2.0, "v0": 0.0, "v1": 1.0}
    surface |= {"centroid_x": 1.0, "centroid_y": 0.5, "centroid_z": 0.0} | box([0, 0, 0], [2, 1, 0])
    # What swept surfaces are made from belongs to no shape.
    basis_arc = {name: values[-1:] if isinstance(values, list) else values for name, values in arcs.items()}
    basis_surface = surface | {"id": [2], "content_key": "basis"}
    root = {"object_id": [1], "node_no": 0, "body_no": 0, "path": "", "child_id": 1}
    nested = {"object_id": [1], "node_no": 1, "parent_no": 0, "body_no": 0, "path": "/b", "child_id": 2}
    leaf = {"object_id": [1], "node_no": 2, "parent_no": 1, "body_no": 0, "path": "/b/c", "part_id": 1, "shape_id": 1}
    return {
        "arc": arcs,
        "arc/basis": basis_arc | {"id": [9], "content_key": "basis"},
        "surface": surface,
        "surface/basis": basis_surface,
        "surface_swept": {"surface_id": [1, 2], "basis_arc_id": [None, 9], "basis_surface_id": [2, None]},
        "loop": {"surface_id": [1], "loop_no": 0, "outer_loop": True},
        "coedge": {"surface_id": 1, "loop_no": 0, "coedge_no": [0, 1, 2, 3], "arc_id": [1, 2, 3, 4], "reversed": False}
        | {"tolerance": 0.01},
        "shape": {"id": [1], "content_key": "s", "kind": "sheet", "surface_count": 1, "arc_count": 4, "area": 2.0}
        | box([0, 0, 0], [2, 1, 0]),
        "shape_surface": {"shape_id": [1], "surface_no": 0, "surface_id": 1},
        "shape_arc": {
            "shape_id": 1,
            "arc_no": [0, 1, 2, 3],
            "arc_id": [1, 2, 3, 4],
            "surface_a": 0,
            "convexity": "free",
        },
        "part": {"id": [1], "content_key": "p", "number": "1", "name": "plate", "shape_id": 1},
        "object": {"id": [1, 2], "content_key": ["o", "p"], "name": ["o", "p"], "kind": "assembly"},
        "object_object": {"parent_id": [1], "child_no": 0, "child_id": 2, "name": "b"} | transform(90, [10, 0, 0]),
        "object_part": {"object_id": [2], "child_no": 0, "part_id": 1, "name": "c"} | transform(0, [0, 0, 5]),
        "source": {"id": [1], "file_name": "f", "sha256": "0", "format": "step", "unit": "mm", "unit_mm": 1.0}
        | {"loader_version": "1"},
        "object_variant": {"id": [1], "name": "o", "variant": "", "revision": 1, "object_id": 1, "source_id": 1},
        "world": {"id": [1], "name": "w", "revision": 1, "content_key": "w"},
        "object_node": root | transform(0, [0, 0, 0]),
        "object_node/1": nested | transform(90, [10, 0, 0]),
        "object_node/2": leaf | {"page": 0} | transform(90, [10, 0, 5]) | box([9, 0, 5], [10, 2, 5]),
        "object_page": {"object_id": [1], "page": 0, "body_no": 0, "box_count": 1} | box([9, 0, 5], [10, 2, 5]),
        "placed_object": {"object_no": [1], "world": "w", "name": "a", "object_id": 1},
        "placed_body": {
            "object_no": [1],
            "body_no": 0,
            "first_revision": 1,
            "object_variant_id": 1,
            "role": "inspected",
            "tolerance_mm": 0.0,
        }
        | transform(0, [0, 100, 0])
        | box([9, 100, 5], [10, 102, 5]),
    }


def fill(store: Store, model: Model) -> None:
    with Run.begin(store, "load", {}) as run, run.write() as connection:
        for name, columns in model.items():
            store.append(connection, name.partition("/")[0], columns)


@pytest.fixture(scope="module")
def found_in(new_store: NewStore) -> Iterator[Any]:
    """Rows that a check finds where a sound model is changed, of which nothing stays in the store."""
    sound = plate()

    def find(model: Model, name: str) -> Any:
        changed = {key.partition("/")[0] for key in {**sound, **model} if sound.get(key) != model.get(key)}
        with store.engine.connect() as connection, connection.begin() as transaction:
            for table in changed:
                connection.execute(store.table(table).delete())
            for table, columns in model.items():
                if table.partition("/")[0] in changed:
                    store.append(connection, table.partition("/")[0], columns)
            found = store.rows(connection, f"check/{name}")
            transaction.rollback()
        return found

    with Store.open(new_store("duckdb")) as store:
        fill(store, sound)
        yield find


def test_sound_model_passes(fresh_store: str) -> None:
    with Store.open(fresh_store) as store:
        fill(store, plate())
        assert not [finding.query for finding in check(store) if finding.rows]


def fault(table: str, column: str, value: Any) -> Callable[[Model], None]:
    def make(model: Model) -> None:
        model[table][column] = value

    return make


def nest_in_itself(model: Model) -> None:
    back: dict[str, Any] = {"parent_id": [2], "child_no": 9, "child_id": 1, "name": "back"}
    model["object_object/back"] = back | transform(0, [0, 0, 0])


def leave_link(model: Model) -> None:
    """A robot whose joint is bent and whose link is not."""
    joint: dict[str, Any] = {"object_id": [1], "joint_no": 0, "name": "j", "kind": "revolute", "parent_link": "base"}
    axis = {"axis_x": 0.0, "axis_y": 0.0, "axis_z": 1.0}
    model["joint"] = joint | axis | {"child_link": "b"} | transform(90, [10, 0, 0])
    model["joint_state"] = {"object_no": [1], "robot": "", "joint": "j", "first_revision": 1, "value": 0.5}


def mount_nowhere(model: Model) -> None:
    """A rig on a link that is not placed."""
    model["rig"] = {"id": [1], "content_key": "rig"}
    mount: dict[str, Any] = {"world": ["w"], "mount_no": 0, "first_revision": 1, "name": "head", "object_no": 1}
    model["world_mount"] = mount | {"rig_id": 1, "link": "flange", "object_path": "flange"} | transform(90, [10, 0, 1])


def add(table: str, **row: Any) -> Callable[[Model], None]:
    """One row of what an extraction found, where there is no extraction."""

    def make(model: Model) -> None:
        model[table] = {name: [value] for name, value in row.items()}

    return make


def add_presence(model: Model) -> None:
    """A part in view that no camera says anything of."""
    model["rig"] = {"id": [1], "content_key": "rig"}
    given: dict[str, Any] = {"run_id": [1], "world_id": 1, "rig_id": 1, "prior_covariance": [[0.0] * 36]}
    given |= {"needs_translation_mm": 1.0, "needs_rotation": 1.0}
    given |= {"verdict": "accepted", "reason": "so", "posterior": 1.0}
    model["inspection"] = given | transform(0, [0, 0, 0])
    item: dict[str, Any] = {"run_id": [1], "item_no": 0, "level": "part", "occurrence_id": 3, "path": "plate"}
    item |= {"state": "confirmed", "qif": "PASS", "reason": "its edges are found"}
    evidence = ("log_odds", "expected_log_odds", "absent_log_odds", "visible_pixels", "edge_px", "distinct_px")
    model["presence"] = item | dict.fromkeys((*evidence, "supported_px"), 5.0)


def leave_feature_undecided(model: Model) -> None:
    """A part with presence, and a feature of it in view without."""
    add_presence(model)
    seen: dict[str, Any] = {"run_id": [1], "in_view_no": 0, "occurrence_id": 3, "feature_no": 0, "level": "feature"}
    model["part_in_view"] = seen | {"path": "plate/hole", "visible_pixels": 9.0, "covered_pixels": 9.0}


ELEMENT = dict.fromkeys(("x", "y", "normal_x", "normal_y", "contrast", "width", "sigma"), 1.0)


def leave_standpoint(model: Model) -> None:
    """A standpoint that counts, and took no picture."""
    add_presence(model)
    given: dict[str, Any] = {"run_id": [1], "standpoint_no": 0, "name": "a", "rig_id": 1, "ignored": False}
    square = {name: [[0.0] * 36] for name in ("covariance", "sway")}
    model["standpoint"] = given | square | {"joints": "{}"} | transform(0, [0, 0, 0])


FAULTS = {
    "standpoint": leave_standpoint,
    "edge_element": add("edge_element", extraction_id=7, edge_element_no=0, **ELEMENT),
    "presence": add_presence,
    "final_decision": leave_feature_undecided,
    "image_arc_point": add("image_arc_point", extraction_id=7, image_arc_no=0, point_no=0, x=1.0, y=1.0, sigma=0.1),
    "image_junction": add(
        "image_junction", extraction_id=7, junction_no=0, kind="L", x=1.0, y=1.0, xx=1.0, xy=0.0, yy=1.0
    ),
    "image_junction_arc": add("image_junction_arc", extraction_id=7, junction_no=0, image_arc_no=0, meets_with="end"),
    "image_blob": add("image_blob", image_id=7, bytes=b"picture"),
    "image_primitive": add("unit", unit_set_id=7, unit_no=0, kind="arc", ref_no=0),
    "region_arc": add("region_arc", extraction_id=7, region_no=0, image_arc_no=0, side="left", length=9.0),
    "region_outline": add("region_outline", extraction_id=7, region_no=0, ring_no=0, point_no=0, x=1, y=1),
    "unit_relation": add(
        "unit_relation",
        unit_set_id=7,
        kind="bounds",
        unit_a=0,
        unit_b=1,
        distance=1.0,
        distance_sigma=0.1,
        angle=0.0,
        angle_sigma=0.1,
    ),
    "matching_cost": add("problem_relation", run_id=7, problem_no=0, unit_no=0, neighbour_no=1, weight=1),
    "loop_open": fault("arc", "end_x", [2.0, 2.02, 0.0, 0.0]),
    "arc_off_surface": fault("surface", "origin_z", 0.02),
    "surface_without_loop": lambda model: [model.pop(name) for name in ("coedge", "loop")],
    "shape_counts": fault("shape", "arc_count", 5),
    "orphans": lambda model: [model.pop(name) for name in ("object_part",)],
    "nesting_cycle": nest_in_itself,
    "object_node_transform": fault("object_node/2", "m03", [10.001]),
    "object_node_box": lambda model: [model[name].update(x0=[9.001]) for name in ("object_node/2", "object_page")],
    "object_node_path": fault("object_node/2", "path", "/b"),
    "object_node_reference": fault("object_node/1", "child_id", 7),
    "object_page": fault("object_page", "y1", [1.9]),
    "placed_body": fault("placed_body", "x1", 9.2),
    "occurrence": add_presence,
    "world_link": leave_link,
    "world_mount": mount_nowhere,
    "element_outside_shape": fault("shape", "x1", 1.99),
}


@pytest.mark.parametrize("name", FAULTS)
def test_fault_is_found(name: str, found_in: Any) -> None:
    model = plate()
    FAULTS[name](model)
    assert found_in(model, name)


def test_run_without_a_beginning_is_found(duckdb_file: Path) -> None:
    with Store.open(duckdb_file) as store:
        with Run.begin(store, "load", {}):
            pass
        with store.write() as connection:
            events = store.table("run_event")
            connection.execute(events.delete().where(events.c.kind == "begun"))
        assert "check/run_events" in amiss(store)


BROKEN = [
    ("part", "shape_id = 99", "shape_id", "shape", 1, "99"),
    ("loop", "loop_no = 5", "surface_id, loop_no", "loop", 4, "1, 0"),
    ("shape_arc", "surface_a = 7 WHERE arc_no > 1", "shape_id, surface_a", "shape_surface", 2, "1, 7"),
    ("surface_swept", "basis_arc_id = 8 WHERE basis_arc_id IS NOT NULL", "basis_arc_id", "arc", 1, "8"),
    ("ledger", "relation = 'nowhere' WHERE relation = 'part'", "relation", "sds_relation", 1, "nowhere"),
]


def test_rows_whose_reference_leads_nowhere_are_found(fresh_store: str) -> None:
    """Columns that are null, as surface_b of all arcs here, refer to nothing."""
    with Store.open(fresh_store) as store:
        fill(store, plate())
        with store.write() as connection:
            if store.dialect == "postgresql":  # whose foreign keys are triggers
                connection.exec_driver_sql("SET LOCAL session_replication_role = replica")
            for table, change, *_ in BROKEN:
                connection.exec_driver_sql(f"UPDATE {table} SET {change}")  # noqa: S608
        found = amiss(store)["references"]
    names = ("relation", "column_names", "parent", "row_count", "one_key")
    expected = [
        dict(zip(names, ("coedge" if table == "loop" else table, *rest), strict=True)) for table, _, *rest in BROKEN
    ]
    assert sorted(found, key=repr) == sorted(expected, key=repr)


def test_every_query_has_a_fault_here() -> None:
    # of an inspection (tests/app/cli/test_alterations.py) and of problems (tests/labelling/test_rows.py)
    elsewhere = ("run_events", "matching_rows", "matching_bound")
    assert {f"check/{name}" for name in (*FAULTS, *elsewhere)} == set(sql.query_names("check"))


@pytest.mark.parametrize(
    ("kind", "columns", "point", "distance"),
    [
        # axis z through the origin; what the closed forms say of the distance of a point from the surface
        ("cylinder", {"radius": 3.0}, (3.0, 4.0, 7.0), 2.0),
        ("cone", {"radius": 1.0, "semi_angle": np.pi / 4}, (3.0, 0.0, 0.0), np.sqrt(2)),
        ("sphere", {"radius": 3.0}, (2.0, 3.0, 6.0), 4.0),
        ("torus", {"radius": 5.0, "radius2": 1.0}, (8.0, 0.0, 4.0), 4.0),
        ("torus", {"radius": 1.0, "radius2": 5.0}, (3.0, 0.0, 2.0), 5 - np.sqrt(20)),
    ],
)
def test_distance_from_surface(
    kind: str, columns: dict[str, float], point: tuple[float, ...], distance: float, found_in: Any
) -> None:
    model = plate()
    model["surface"] |= columns | {"kind": kind}
    for end in ("start", "end"):
        for axis, value in zip("xyz", point, strict=True):
            model["arc"][f"{end}_{axis}"] = value
    model["arc"] |= box([point] * 4, [point] * 4)
    assert [row.distance for row in found_in(model, "arc_off_surface")] == pytest.approx([distance] * 4)
