"""What loading gives, kept as Parquet and compared later: whether a change of the loaders changed the model.

    python benchmarks/load_snapshot.py make FOLDER [CHECKOUT]   loads every STEP and URDF file by the code of a checkout
                                                                into a store of its own
    python benchmarks/load_snapshot.py compare OLD NEW          rows that one has alone; what the schema lost is named

Files are those of examples/ and of the folder that RELMODEL_TEST_DATA names.  Models are the same where rows pair off:
each with one of the same words, whole numbers and references (to rows paired before), and of numbers equal to 1e-9.
Identities do not count, nor does what tells of the run or of the schema.  The corners of a hull are rows in any order;
samples of arcs that are not kept, as they are on a line or equal, are filled in.  Not of the model are parts that the
store calls supplemental (annotations, construction geometry), with all that only they have."""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
from collections import Counter, defaultdict
from collections.abc import Iterator, Sequence
from graphlib import TopologicalSorter
from pathlib import Path
from typing import Any

import duckdb
import numpy as np
import pyarrow.parquet as pq
from scipy.spatial import cKDTree

Tables = dict[str, list[dict[str, Any]]]
CHECKOUT = Path(__file__).resolve().parents[1]
SUFFIXES = (".step", ".stp", ".p21", ".step.gz", ".urdf")
# Of the run, or of the schema: no rows of the model.
OF_THE_RUN = {"store", "run", "run_event", "row_digest", "ledger", "sds_relation", "sds_reference"}
GONE = "gone"
_FILLED = "SELECT table_name FROM duckdb_tables() WHERE estimated_size > 0"
# Identities, which references are followed by, and hashes of what is compared; who loaded it; how many rows there are.
UNCOMPARED = {"id", "content_key", "support_key", "loaded_at", "loader_version", "shapes_added", "surfaces_added"}
UNCOMPARED |= {"made_at", "arcs_added"}
# References that a store does not list: of a table without keys, and of corners of hulls, which are made rows here.
UNLISTED = [("object_node", [f"{name}_id"], name, ["id"]) for name in ("object", "part", "shape")]
UNLISTED += [("object_node", ["child_id"], "object", ["id"]), ("hull", ["shape_id"], "shape", ["id"])]
# Who has a row that can be shared: where nobody does any more it goes as well.
HAD_BY = {
    "shape": ["part.shape_id"],
    "surface": ["shape_surface.surface_id", "surface_swept.basis_surface_id"],
    "arc": ["shape_arc.arc_id", "coedge.arc_id", "surface_swept.basis_arc_id", "arc_offset.basis_arc_id"],
    "feature_class": ["feature.feature_class_id"],
}
CLOSE, CLOSE_REAL = 1e-9, 3e-7  # absolute and relative; of directions, which are kept as REAL, five of its last places
DIRECTIONS = {"tangents", "normals", "normals_a", "normals_b"}
# What was changed on purpose since: file, table, and the column that is not compared or what is said of the rows.
_RENAMED = ("data_step__abstract_pca.step", "data_step__box_sides.STEP", "data_step__dm1-oc-214.stp")
_COLUMNS = (("object_object", "name"), ("object_part", "name"), ("object_node", "path"))
MENDED = {(file, *at): "an instance named by a number has its part's name" for file in _RENAMED for at in _COLUMNS}
_MOVED = (("part_pmi", "1 of 44 rows are new or others"), ("part_pmi_datum", "1 of 67 rows are new or others"))
_OF_WHICH = "datum target 10 was of a supplemental part, and is of the part now"
MENDED |= {("data_step__nist_ctc_02_asme1_ap242.stp", *said): _OF_WHICH for said in _MOVED}


def files() -> list[tuple[str, Path]]:
    """Every model file with a name for its folder."""
    roots = {"examples": CHECKOUT / "examples"}
    if data := os.environ.get("RELMODEL_TEST_DATA"):
        roots |= {f"data_{name}": Path(data) / name for name in ("step", "bulkhead")}
    return sorted(
        ("__".join((name, *path.relative_to(root).parts)), path)
        for name, root in roots.items()
        for path in root.rglob("*")
        if path.name.lower().endswith(SUFFIXES)
    )


def make(folder: Path, code: Path = CHECKOUT) -> None:
    """Load each file with a checkout's `relmodel load` and keep every table."""
    for name, path in files():
        out = folder / name
        out.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory() as scratch:
            store = Path(scratch) / "one.duckdb"
            run: list[str | Path] = [sys.executable, "-m", "relmodel"]
            subprocess.run([*run, "init", "--store", store], cwd=code, check=True, capture_output=True)
            load = [*run, "load", path, "--object", "one", "--variant", "A", "--store", store]
            done = subprocess.run(load, cwd=code, check=False, capture_output=True, text=True)
            (out / "outcome.txt").write_text(f"{done.returncode}\n{done.stdout}{done.stderr}")
            keep(store, out)
        print(done.returncode, name, flush=True)


def keep(store: Path, folder: Path) -> None:
    with duckdb.connect(str(store), read_only=True) as connection:
        for (table,) in connection.execute(_FILLED).fetchall():
            connection.table(table).write_parquet(str(folder / f"{table}.parquet"))


def differences(old: Path, new: Path) -> Iterator[str]:
    """What differs between the tables of one file, a table or a list of it a line."""
    status, now = ((side / "outcome.txt").read_text().partition("\n")[0] for side in (old, new))
    if status != now:
        yield f"exit status {status} -> {now}"
    sides = [_read(side) for side in (old, new)]
    schema = {"hull", *(row["relation"] for row in sides[1]["sds_relation"])}
    yield from (f"{GONE}: table {name}" for name in sorted(sides[0].keys() - schema))
    tables, references = schema & {*sides[0], *sides[1]} - OF_THE_RUN, _references(sides[1])
    parents = {table: {of for child, _, of, _ in references if child == table} for table in tables}
    pairs: dict[tuple[str, int], dict[Any, int]] = {}  # of a table's keys on a side, the pair of rows that has them
    for table in TopologicalSorter(parents).static_order():
        rows = [side.get(table, []) for side in sides]
        columns = [{name for row in (some or rows[0] or rows[1])[:1] for name in row} for some in rows]
        yield from (f"{GONE}: column {table} {name}" for name in sorted(columns[0] - columns[1]))
        yield from (f"{table}: column {name} is new" for name in sorted(columns[1] - columns[0]))
        own = [one for one in references if one[0] == table]
        mended = {name for file, of, name in MENDED if (file, of) == (old.name, table)}
        names = sorted(columns[0] & columns[1] - UNCOMPARED - mended - {name for one in own for name in one[1]})
        contents = [
            [_content(row, names, [pairs[of, side].get(_key(row, refer)) for _, refer, of, _ in own]) for row in some]
            for side, some in enumerate(rows)
        ]
        partners = _pair(*contents)
        for key in [one[3] for one in references if one[2] == table][:1]:
            pairs[table, 0] = {_key(row, key): no for no, row in enumerate(rows[0])}
            pairs[table, 1] = {_key(row, key): partners.get(no, -1 - no) for no, row in enumerate(rows[1])}
        for some, word in zip(rows, ("gone", "new"), strict=True):
            said = f"{len(some) - len(partners)} of {len(some)} rows are {word} or others"
            if len(some) > len(partners) and (old.name, table, said) not in MENDED:
                yield f"{table}: {said}"
        for name in names:
            both = [(rows[0][i], rows[1][j]) for j, i in partners.items() if isinstance(rows[1][j][name], list)]
            if off := sum(not _alike(name, *pair) for pair in both):
                yield f"{table} {name}: {off} of {len(both)} lists"


def _read(folder: Path) -> Tables:
    """The rows of each table, without supplemental parts and what only they have, and without what says so."""
    tables: Tables = defaultdict(list)
    tables |= {file.stem: pq.read_table(file).to_pylist() for file in folder.glob("*.parquet")}
    for shape in tables["shape"]:
        corners = zip(*(shape.pop(f"hull_{axis}") or [] for axis in "xyz"), strict=True)
        tables["hull"] += [{"shape_id": shape["id"], "x": x, "y": y, "z": z} for x, y, z in corners]
    solids = {shape["id"] for shape in tables["shape"] if shape["kind"] == "solid"}
    gone = [one for one in tables["part"] if one.get("supplemental") and one["shape_id"] not in solids]
    tables["part"] = [one for one in tables["part"] if one not in gone]
    tables["load_finding"] = [one for one in tables["load_finding"] if one["kind"] != "left_out"]
    before = -1
    while gone and before != (before := sum(map(len, tables.values()))):
        for table, names, parent, key in _references(tables):
            known = {_key(row, key) for row in tables[parent]}
            tables[table] = [row for row in tables[table] if None in _key(row, names) or _key(row, names) in known]
        for table, users in HAD_BY.items():
            used = {row[name] for of, name in (user.split(".") for user in users) for row in tables[of]}
            tables[table] = [row for row in tables[table] if row["id"] in used]
    return tables


def _references(tables: Tables) -> list[tuple[str, list[str], str, list[str]]]:
    """Who refers by which columns to whose key, of tables that have rows."""
    listed = [(of, names, to, key) for of, _, names, to, key in map(dict.values, tables["sds_reference"])]
    return [one for one in (*listed, *UNLISTED) if {one[0], one[2]} <= tables.keys() - OF_THE_RUN]


def _key(row: dict[str, Any], names: Sequence[str]) -> tuple[Any, ...]:
    return tuple(row[name] for name in names)


def _content(row: dict[str, Any], names: list[str], referred: list[Any]) -> tuple[tuple[Any, ...], tuple[float, ...]]:
    """What is equal wholly, and the numbers."""
    values = _key(row, names)
    words = (type(value) if isinstance(value, float | list) else value for value in values)
    return (*referred, *words), tuple(value for value in values if isinstance(value, float))


def _pair(old: list[Any], new: list[Any]) -> dict[int, int]:
    """By the ordinal of a new row that of the old row with its content: the nearest, if near enough and no other's."""
    groups: list[dict[Any, list[int]]] = [defaultdict(list), defaultdict(list)]
    for group, contents in zip(groups, (old, new), strict=True):
        seen: Counter[Any] = Counter()
        for no, content in enumerate(contents):
            group[content[0], seen[content]].append(no)  # equal rows pair off in their order
            seen[content] += 1
    found: dict[int, int] = {}  # by the old row's: one new row each
    for words in groups[0].keys() & groups[1].keys():
        both = zip((old, new), groups, strict=True)
        a, b = (np.array([(0.0, *of[no][1]) for no in group[words]]) for of, group in both)
        near = np.asarray(cKDTree(a).query(b, p=np.inf)[1])
        close = np.isclose(a[near], b, CLOSE, CLOSE).all(axis=1)
        found |= {groups[0][words][near[at]]: groups[1][words][at] for at in np.flatnonzero(close)}
    return {j: i for i, j in found.items()}


def _alike(name: str, *rows: dict[str, Any]) -> bool:
    """Whether two lists are, of points or directions along an arc with all that are left out."""
    a, b = (np.asarray(row[name]) for row in rows)
    if "sample_count" in rows[0]:
        kept = (a.reshape(-1, 3), rows[0]["sample_count"]), (b.reshape(-1, 3), rows[1]["sample_count"])
        a, b = (some if len(some) > 2 else np.linspace(some[0], some[-1], count) for some, count in kept)
    close = CLOSE_REAL if name in DIRECTIONS else CLOSE
    return a.shape == b.shape and np.allclose(a, b, close, close)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("verb", choices=("make", "compare"))
    parser.add_argument("folders", type=Path, nargs="+")
    options = parser.parse_args()
    if options.verb == "make":
        make(*options.folders)
        return
    old, new = options.folders
    for folder in sorted(path for path in old.iterdir() if path.is_dir()):
        found = list(differences(folder, new / folder.name))
        print(f"{folder.name}: {'' if found else 'equal'}", *found, sep="\n    ")


if __name__ == "__main__":
    main()
