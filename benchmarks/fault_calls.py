"""Calls whose answers `benchmarks.faults` compares with and without a fault."""

from __future__ import annotations

import hashlib
import os
import re
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.load_snapshot import OF_THE_RUN

DEMO = Path(__file__).parents[1] / "examples/demo"


def make_stores(folder: Path) -> None:
    """What calls begin with: an empty store, one of the demonstration, and its first pair at half size."""
    import relmodel

    folder.mkdir()
    _halve(DEMO / "pair_00_rig.yaml", folder)
    relmodel.create(folder / "empty.duckdb").close()
    shutil.copy(folder / "empty.duckdb", folder / "demo.duckdb")
    with relmodel.open(folder / "demo.duckdb", read_only=False) as store:
        store.load(DEMO / "bulkhead_A.step.gz", name="bulkhead", variant="A")
        store.place(DEMO / "world.yaml")


def _halve(rig: Path, folder: Path) -> None:
    """Write pictures of half the size and the rig that takes them: an inspection of them costs two thirds."""
    import cv2
    import yaml

    told = yaml.safe_load(rig.read_text())
    for name, camera in told["cameras"].items():
        picture = cv2.imread(str(rig.with_name(f"pair_00_{name}.png")), cv2.IMREAD_UNCHANGED)
        assert picture is not None
        half = cv2.resize(picture, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA)
        cv2.imwrite(str(folder / f"{name}.png"), half)
        camera["width"], camera["height"] = camera["width"] // 2, camera["height"] // 2
        matrix = np.array(camera["matrix"])
        matrix[:2, :2] /= 2
        matrix[:2, 2] = (matrix[:2, 2] + 0.5) / 2 - 0.5
        camera["matrix"] = matrix.tolist()
    for name in ("focal_px", "centre_px"):
        told["sigma"][name] /= 2
    (folder / "rig.yaml").write_text(yaml.safe_dump(told))


def plain(value: Any) -> Any:
    """A value as what JSON has, numbers to six digits."""
    if isinstance(value, dict):
        return {str(key): plain(one) for key, one in value.items() if key not in ("timings_s", "run", "run_id")}
    if isinstance(value, np.ndarray | np.generic):
        return plain(value.tolist())
    if isinstance(value, list | tuple):
        return [plain(one) for one in value]
    if isinstance(value, float):
        return None if value != value else float(f"{value:.6g}") + 0.0
    return value if isinstance(value, str | int | bool | None) else str(value)


def _columns(table: Any) -> tuple[list[str], list[bytes]]:
    """Names of columns of an Arrow table, and the values of each in ascending order, numbers to six digits."""
    import pyarrow as pa
    import pyarrow.compute as pc

    found = []
    for column in table.columns:
        while pa.types.is_list(column.type):
            column = pc.list_flatten(column)
        column = column.drop_null()
        if pa.types.is_floating(column.type):
            mantissa, exponent = np.frexp(column.to_numpy())
            rounded = np.ldexp(np.round(mantissa * 2**20), exponent)
            found.append(np.sort(rounded + 0.0).tobytes())
        else:
            found.append("\n".join(sorted(map(str, column.to_pylist()))).encode())
    return list(table.column_names), found


def rows_of(file: Path) -> dict[str, Any]:
    """What the tables of a store hold but keys and what tells of the run, by column, in whatever order rows stand."""
    import duckdb

    out: dict[str, Any] = {}
    with duckdb.connect(str(file), read_only=True) as connection:
        tables = connection.execute("SELECT table_name FROM duckdb_tables() WHERE estimated_size > 0 ORDER BY ALL")
        for (table,) in tables.fetchall():
            if table in OF_THE_RUN:
                continue
            for name, column in zip(*_columns(connection.table(table).to_arrow_table()), strict=True):
                if not re.search("_key$|_at$|version", name):
                    out[f"{table}.{name}"] = hashlib.sha256(column).hexdigest()
    return out


def call_load(folder: Path) -> Any:
    import relmodel

    answers = []
    files = [DEMO / "bulkhead_A.step.gz"]
    if data := os.environ.get("RELMODEL_TEST_DATA"):
        files += [Path(data) / "step" / name for name in ("nist_ctc_01_asme1_ap203.stp", "featuretype.STEP")]
    for file in files:
        target = folder / "loaded.duckdb"
        target.unlink(missing_ok=True)
        shutil.copy(folder / "empty.duckdb", target)
        with relmodel.open(target, read_only=False) as store:
            store.load(file, name="one")
        answers.append(rows_of(target))
    return answers


# Of the functions that SQL has: volumes of all kinds about parts of the demonstration.
VOLUMES = (
    "SELECT * FROM parts_in_box(900, -600, 800, 1300, -400, 1100) ORDER BY ALL",
    "SELECT * FROM features_in_box(900, -600, 800, 1300, -400, 1400) ORDER BY ALL",
    "SELECT * FROM parts_within_box(900, -560, 800, 1300, -450, 1100) ORDER BY ALL",
    "SELECT * FROM surfaces_in_sphere(1000, -500, 900, 120) ORDER BY ALL",
    "SELECT * FROM parts_in_sphere(2200, -350, 1500, 260) ORDER BY ALL",
    "SELECT * FROM arcs_in_view(1, .8, 0, .6, 1000, 0, 1, 0, -500, -.6, 0, .8, 500, 100, 900) ORDER BY ALL",
    "SELECT * FROM parts_in_view(1, .6, -.8, 0, 2200, 0, 0, 1, -900, -.8, -.6, 0, 1800, 50, 1200) ORDER BY ALL",
    "SELECT * FROM nearest_parts(1700, -400, 1000, 7) ORDER BY ALL",
    "SELECT * FROM nearest_features(1700, -300, 1000, 9) ORDER BY ALL",
    "SELECT * FROM arcs_in_boxes('asked') ORDER BY ALL",
    "SELECT * FROM parts_in_volumes('asked') ORDER BY ALL",
    "SELECT * FROM surfaces_in_volumes('asked') ORDER BY ALL",
)
ASKED = """
INSERT INTO camera VALUES (1, '', 640, 480, 900, 950, 322, 238, 4, [], -3, -2, 641, 483);
CREATE TABLE asked AS
SELECT * FROM (VALUES
    (0, 900.0, -600.0, 800.0, 1100.0, -400.0, 1000.0, 1000.0, -500.0, 900.0, 100.0, NULL),
    (1, 2000.0, -450.0, 1400.0, 2300.0, -300.0, 1700.0, NULL, NULL, NULL, NULL, [.6, .8, 0, 1100, -.8, 0, .6, -700])
) AS v (volume_no, x0, y0, z0, x1, y1, z1, ball_x, ball_y, ball_z, ball_radius, half_spaces);
"""


def call_find(folder: Path) -> Any:
    import duckdb

    import relmodel
    from relmodel.find.find import in_volumes, nearest_parts
    from relmodel.find.indexes import WorldIndex, build
    from relmodel.find.volumes import Box, Frustum, OrientedBox, Polyhedron, Sphere, widened

    answers: list[Any] = []
    pose, view = np.eye(4), np.eye(4)
    pose[:3] = np.array([[0.8, -0.6, 0, 1600], [0.6, 0.8, 0, -400], [0, 0, 1, 1000]])
    view[:3, 3] = [1600, -400, -500]
    frustum = Frustum(640, 480, np.array([[900.0, 3, 320], [0, 950, 240], [0, 0, 1]]), view, 100.0, 2500.0)
    volumes = [
        Box(900.0, -600.0, 800.0, 1300.0, -400.0, 1100.0),
        OrientedBox(pose, np.array([300.0, 60, 90])),
        Sphere(2200.0, -350.0, 1500.0, 260.0),
        Polyhedron(frustum.planes),
        frustum,
        widened(frustum, np.diag([30.0, 20, 25, 1e-4, 2e-4, 1e-4]), 0.95),
    ]
    with relmodel.open(folder / "demo.duckdb") as store:
        for level in ("part", "feature", "surface", "arc"):
            asked = volumes if level in ("part", "feature") else volumes[:3]
            for precision, wholly in (("box", False), ("exact", False), ("box", True)):
                found = in_volumes(store, asked, level=level, precision=precision, wholly=wholly)
                answers.append([found["volume_no"], found["element_no"], found["path"]])
            near = nearest_parts(store, np.array([1700.0, -300, 1000]), 5, level=level, radius=3.0)
            answers.append([near["element_no"], near["distance_mm"]])
        everything = in_volumes(store, [Box(-1e5, -1e5, -1e5, 1e5, 1e5, 1e5)])
        boxes = np.stack([everything[name] for name in ("x0", "y0", "z0", "x1", "y1", "z1")], axis=1).astype(float)
        for kind in ("rtree", "grid", "octree", "rangetree"):
            index = build(kind, boxes)
            pairs = np.stack(index.in_boxes(boxes[::3] + 5.0))  # in any order
            answers.append(pairs[:, np.lexsort(pairs)])
            met = np.stack(WorldIndex.load(store, kind=kind).in_volumes(volumes, "surface"))
            answers.append(met[:, np.lexsort(met)])
    with duckdb.connect(str(folder / "demo.duckdb")) as connection:
        connection.execute(ASKED)
        return [answers, [connection.execute(statement).fetchall() for statement in VOLUMES]]


def _inspected(folder: Path, given: dict[str, Any], names: tuple[str, ...]) -> Any:
    import relmodel

    target = folder / "inspected.duckdb"
    shutil.copy(folder / "demo.duckdb", target)
    pictures = {name: folder / f"{name}.png" for name in names}
    with relmodel.open(target, read_only=False) as store:
        found = store.inspect(rig=folder / "rig.yaml", pictures=pictures, **given)
        said = found.to_json()
        tables = {name: list(table) for name, table in store.results().items() if name != "inspection"}
        return [said, tables, list(store.why())]


def call_inspect(folder: Path) -> Any:
    return _inspected(folder, {"prior": DEMO / "pair_00_prior.yaml", "match": True}, ("left", "right"))


def call_no_prior(folder: Path) -> Any:
    return _inspected(folder, {}, ("left", "right"))


def call_one_picture(folder: Path) -> Any:
    return _inspected(folder, {}, ("left",))


def call_stereo(folder: Path) -> Any:
    from relmodel.store import Store
    from vision.inspection.stereo_pair import match_pair

    target = folder / "stereo.duckdb"
    shutil.copy(folder / "empty.duckdb", target)
    pictures = {name: folder / f"{name}.png" for name in ("left", "right")}
    with Store.open(target, read_only=False) as store:
        answer = match_pair(store, rig=folder / "rig.yaml", pictures=pictures)
    return [answer.rows(), rows_of(target)]


def call_labelling(_: Path) -> Any:
    from relmodel.labelling.problem import NONE, matching_problem, result_rows
    from relmodel.labelling.solve import MODES, solve

    answers = []
    for seed in range(3):
        rng = np.random.default_rng(seed)
        units, labels = 5, 6
        nulls = rng.integers(3, 9, units)
        candidates = np.array(
            [(u, c, rng.integers(0, 6)) for u in range(units) for c in range(labels) if rng.random() < 0.6]
        )
        near = np.array(
            [(u, v, rng.integers(1, 4)) for u in range(units) for v in range(u + 1, units) if rng.random() < 0.6]
        )
        pairs = np.array(
            [(u, a, v, b) for u, v, _ in near for a in range(labels) for b in range(labels) if rng.random() < 0.5]
        )
        for mode in MODES:
            problem = matching_problem(nulls, labels, candidates, near, pairs, injective=mode != "paper")
            found = solve(problem, mode=mode)
            answers.append([found.label, result_rows(problem, found), int(NONE)])
    return answers


def call_plan(folder: Path) -> Any:
    """Poses about the bulkhead, and which of some views are chosen: a whole plan takes a minute."""
    from relmodel.store import Store
    from vision.cameras.files import read_rig
    from vision.planning import choose_views, find_table, lay_grid
    from vision.scene import read_scene

    rng = np.random.default_rng(0)
    px = rng.gamma(1.0, 60.0, (40, 25))
    with Store.open(folder / "demo.duckdb") as store, store.read() as connection:
        (world,) = store.rows(connection, "world/current")
        stored = read_scene(store, connection, world.world_id)
    rig = read_rig(folder / "rig.yaml")
    grid = lay_grid(stored.scene, np.arange(2), rig, 4000.0, find_table(stored.scene))
    return [grid.world_from_rig, grid.target, choose_views(px > 120, px, 0.95), choose_views(px > 90, px, 0.9, 3)]


CALLS: dict[str, Callable[[Path], Any]] = {
    "labelling": call_labelling, "find": call_find, "stereo": call_stereo, "inspect": call_inspect,
    "one_picture": call_one_picture, "no_prior": call_no_prior, "load": call_load, "plan": call_plan,
}  # fmt: skip
