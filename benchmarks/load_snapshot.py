"""What loading gives, kept as Parquet and compared later: whether a change of the loaders changed any row that counts.

    python benchmarks/load_snapshot.py make FOLDER        loads every STEP and URDF file into a store of its own
    python benchmarks/load_snapshot.py compare OLD NEW    lists every difference, with its size

Files are those of examples/ and of the folder that RELMODEL_TEST_DATA names.  Kinds, topology, frames, trims, names,
features and occurrences must be equal, areas and volumes to 1e-6 of their size, centroids to 1e-5 mm; boxes must hold
the old ones and exceed them by at most 0.05 mm.  Faces and edges are paired by where they lie, so that another order of
the same rows is no difference.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator
from functools import cached_property
from pathlib import Path
from typing import Any

import duckdb
import numpy as np
import numpy.typing as npt
from scipy.optimize import linear_sum_assignment
from scipy.spatial.distance import cdist

Columns = dict[str, npt.NDArray[Any]]
CHECKOUT = Path(__file__).resolve().parents[1]
SUFFIXES = (".step", ".stp", ".p21", ".step.gz", ".urdf")
BOX = ("x0", "y0", "z0", "x1", "y1", "z1")
MATRIX = tuple(f"m{i}{j}" for i in range(3) for j in range(4))
AREA_SHARE, CENTROID_MM, FRAME, BOX_MM, BOX_SLACK_MM = 1e-6, 1e-5, 1e-9, 0.05, 2e-5


def files() -> list[tuple[str, Path]]:
    """Every model file with a name for its folder."""
    roots = {"examples": CHECKOUT / "examples"}
    if data := os.environ.get("RELMODEL_TEST_DATA"):
        roots |= {f"data_{name}": Path(data) / name for name in ("step", "bulkhead")}
    found = [
        ("__".join((name, *path.relative_to(root).parts)), path)
        for name, root in roots.items()
        for path in sorted(root.rglob("*"))
        if path.name.lower().endswith(SUFFIXES)
    ]
    return sorted(found)


def make(folder: Path) -> None:
    """Load each file with this checkout's `relmodel load` and keep every table."""
    for name, path in files():
        out = folder / name
        out.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory() as scratch:
            store = Path(scratch) / "one.duckdb"
            run: list[str | Path] = [sys.executable, "-m", "relmodel"]
            subprocess.run([*run, "init", "--store", store], cwd=CHECKOUT, check=True, capture_output=True)
            load = [*run, "load", path, "--object", "one", "--variant", "A", "--store", store]
            done = subprocess.run(load, cwd=CHECKOUT, check=False, capture_output=True, text=True)
            (out / "outcome.txt").write_text(f"{done.returncode}\n{done.stdout}{done.stderr}")
            with duckdb.connect(str(store), read_only=True) as connection:
                for (table,) in connection.execute(
                    "SELECT table_name FROM duckdb_tables() WHERE estimated_size > 0"
                ).fetchall():
                    connection.table(table).write_parquet(str(out / f"{table}.parquet"))
        print(done.returncode, name, flush=True)


class Loaded:
    """The tables of one file, as columns."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.status = int((folder / "outcome.txt").read_text().splitlines()[0])

    def table(self, name: str, **equal: Any) -> Columns:
        """Columns of a table, those rows whose columns are as given; no columns where the table is empty."""
        path = self.folder / f"{name}.parquet"
        if not path.exists():
            return {}
        relation = duckdb.read_parquet(str(path))
        for column, value in equal.items():
            relation = relation.filter(duckdb.ColumnExpression(column) == duckdb.ConstantExpression(value))
        return {key: _without_nulls(column) for key, column in relation.fetchnumpy().items()}

    @cached_property
    def placed(self) -> list[tuple[str, int, npt.NDArray[np.float64]]]:
        """Path, part and transform of every placed part, sorted by path and place."""
        variant, nested, parts = self.table("object_variant"), self.table("object_object"), self.table("object_part")
        out: list[tuple[str, int, npt.NDArray[np.float64]]] = []

        def walk(parent: int, path: str, matrix: npt.NDArray[np.float64]) -> None:
            for row in np.flatnonzero(nested["parent_id"] == parent) if nested else ():
                walk(int(nested["child_id"][row]), f"{path}/{nested['name'][row]}", matrix @ _matrix(nested, int(row)))
            own: Any = np.flatnonzero(parts["object_id"] == parent) if parts else ()
            out.extend(
                (f"{path}/{parts['name'][i]}", int(parts["part_id"][i]), matrix @ _matrix(parts, i)) for i in own
            )

        walk(int(variant["object_id"][0]), "", np.eye(4))
        return sorted(out, key=lambda one: (one[0], *np.round(one[2][:3].ravel(), 3).tolist()))

    @cached_property
    def parts(self) -> dict[int, dict[str, Any]]:
        table = self.table("part")
        out = {int(key): {name: table[name][i] for name in table} for i, key in enumerate(table["id"])}
        for part, name, value in self._labels("part_attribute", "part_id"):
            out[part].setdefault(name, value)
        return out

    def surfaces(self, shape: int) -> Columns:
        return self._joined(shape, "surface")

    def arcs(self, shape: int) -> Columns:
        return self._joined(shape, "arc")

    def _joined(self, shape: int, kind: str) -> Columns:
        """Faces or edges of a shape in the order of their numbers."""
        use, rows = self.table(f"shape_{kind}", shape_id=shape), self.table(kind)
        if not use:
            return {}
        order = np.argsort(use[f"{kind}_no"])
        use = {name: column[order] for name, column in use.items()}
        place = {int(key): i for i, key in enumerate(rows["id"])}
        at = [place[int(key)] for key in use[f"{kind}_id"]]
        labels = {name: np.full(len(at), None, object) for name in ("colour", "layer") if kind == "surface"}
        for no, name, value in self._labels("surface_attribute", "surface_no", shape_id=shape) if labels else ():
            labels[name][no] = value
        return labels | {name: column[at] for name, column in rows.items()} | use

    def _labels(self, table: str, owner: str, **equal: Any) -> list[tuple[int, str, str]]:
        """Owner, name and value of the texts that a file states: columns of the owner until attributes had rows."""
        found = self.table(table, source="file", **equal)
        rows = zip(*(found[name].tolist() for name in (owner, "name", "value_text")), strict=True) if found else ()
        return [(int(of), name, value) for of, name, value in rows if value is not None]

    def loops(self, shape: int, arc_names: npt.NDArray[Any]) -> list[Any]:
        """Loops of each face: whether outer, and the directed edges, by the names given to edges (-1: left out)."""
        surfaces, arcs = self.surfaces(shape), self.arcs(shape)
        coedges, bounds = self.table("coedge"), self.table("loop")
        arc_of = dict(zip(arcs.get("arc_id", np.empty(0)).tolist(), arc_names.tolist(), strict=True))
        out = []
        for surface in surfaces["surface_id"].tolist():
            own: Any = np.flatnonzero(coedges["surface_id"] == surface) if coedges else []
            outer = {
                int(bounds["loop_no"][i]): bool(bounds["outer_loop"][i])
                for i in (np.flatnonzero(bounds["surface_id"] == surface) if bounds else ())
            }
            loops: dict[int, list[tuple[int, bool]]] = {}
            for i in own:
                edge = arc_of.get(int(coedges["arc_id"][i]), -2), bool(coedges["reversed"][i])
                loops.setdefault(int(coedges["loop_no"][i]), []).append(edge)
            out.append(sorted((outer.get(no), sorted(edges)) for no, edges in loops.items()))
        return out


def _without_nulls(column: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """The values of a column, with NaN, -1 or None for null."""
    none: Any = np.nan if column.dtype.kind == "f" else -1 if column.dtype.kind in "iu" else None
    return np.where(np.ma.getmaskarray(column), none, np.ma.getdata(column))


def _matrix(table: Columns, row: int) -> Any:
    return np.vstack([np.array([table[m][row] for m in MATRIX]).reshape(3, 4), [0, 0, 0, 1]])


def _vectors(table: Columns, *names: str) -> npt.NDArray[np.float64]:
    return np.stack([np.asarray(table[name], float) for name in names], axis=1)


def pair(old: Columns, new: Columns, places: tuple[str, ...]) -> tuple[npt.NDArray[Any], npt.NDArray[Any]]:
    """Rows of both tables that lie in the same place and are of one kind."""
    if not old or not new:
        return np.empty(0, int), np.empty(0, int)
    a, b = _vectors(old, *places), _vectors(new, *places)
    if len(a) == len(b) and np.allclose(a, b, rtol=0, atol=1e-4) and (old["kind"] == new["kind"]).all():
        return np.arange(len(a)), np.arange(len(b))
    cost = cdist(a, b) + 1e3 * (old["kind"][:, None] != new["kind"][None, :])
    rows, columns = linear_sum_assignment(np.minimum(cost, 1e4))
    near = cost[rows, columns] < 1.0
    return rows[near], columns[near]


def compare_shapes(old: Loaded, old_id: int, new: Loaded, new_id: int) -> Iterator[tuple[str, Any]]:
    """What differs, and how."""
    shapes = [{k: v[0] for k, v in side.table("shape", id=key).items()} for side, key in ((old, old_id), (new, new_id))]
    for name in ("kind", "surface_count", "arc_count"):
        if shapes[0][name] != shapes[1][name]:
            yield f"shape {name}", (shapes[0][name], shapes[1][name])
    for name in ("area", "volume"):
        before, after = float(shapes[0][name]), float(shapes[1][name])
        if not (abs(before - after) <= AREA_SHARE * abs(before) or (np.isnan(before) and np.isnan(after))):
            yield f"shape {name}", (before, after)
    rows: dict[str, tuple[npt.NDArray[Any], npt.NDArray[Any]]] = {}
    for kind, places in (("arc", (*BOX, "length")), ("surface", ("centroid_x", "centroid_y", "centroid_z", "area"))):
        tables = getattr(old, f"{kind}s")(old_id), getattr(new, f"{kind}s")(new_id)
        if kind == "surface":
            for table in tables:
                if table:
                    table["area"] = np.sqrt(table["area"])
        a, b = rows[kind] = pair(*tables, places)
        count = len(tables[0].get("id", ()))
        if len(a) < count:
            yield f"{kind} without partner", count - len(a)
        if len(a):
            yield from _compare_rows(
                kind, {k: v[a] for k, v in tables[0].items()}, {k: v[b] for k, v in tables[1].items()}
            )
    edges = [np.full(len(side.arcs(key).get("id", ())), -1) for side, key in ((old, old_id), (new, new_id))]
    for numbers, at in zip(edges, rows["arc"], strict=True):
        numbers[at] = np.arange(len(at))
    if len(rows["surface"][0]):
        before_loops, after_loops = old.loops(old_id, edges[0]), new.loops(new_id, edges[1])
        for i, j in zip(*rows["surface"], strict=True):
            if before_loops[i] != after_loops[j]:
                yield "loops of a surface", int(i)
    number = dict(zip(rows["surface"][1].tolist(), rows["surface"][0].tolist(), strict=True))
    same = {i: i for i in number.values()}
    a_features, b_features = _features(old, old_id, same), _features(new, new_id, number)
    for feature in (a_features - b_features).elements():
        yield "feature lost", feature
    for feature in (b_features - a_features).elements():
        yield "feature new", feature


def _compare_rows(kind: str, a: Columns, b: Columns) -> Iterator[tuple[str, Any]]:
    frames = [f"{v}_{c}" for v in ("origin", "axis_x", "axis_z") for c in "xyz"] + ["radius", "radius2"]
    frames += ["semi_angle", "u0", "u1", "v0", "v1"] if kind == "surface" else ["t0", "t1"]
    for name in (*frames, "centroid_x", "centroid_y", "centroid_z", "area", "length"):
        if name not in a or name not in b:
            continue
        difference = np.abs(np.asarray(a[name], float) - np.asarray(b[name], float))
        size = np.maximum(np.abs(np.asarray(a[name], float)), 1.0)
        bound = CENTROID_MM if "centroid" in name else size * (AREA_SHARE if name in ("area", "length") else FRAME)
        off = ~((difference <= bound) | (np.isnan(a[name].astype(float)) & np.isnan(b[name].astype(float))))
        if off.any():
            yield f"{kind} {name}", f"{off.sum()} rows, worst {np.nanmax(difference[off], initial=0.0):.3g}"
    for name in ("kind", "recognised_kind", "reversed", "direct", "convexity", "name", "colour", "layer"):
        if name in a and name in b and (off := a[name] != b[name]).any():
            first = int(np.flatnonzero(off)[0])
            yield f"{kind} {name}", f"{off.sum()} rows, such as {a[name][first]} -> {b[name][first]}"
    outward = np.concatenate(
        [_vectors(a, *BOX[:3]) - _vectors(b, *BOX[:3]), _vectors(b, *BOX[3:]) - _vectors(a, *BOX[3:])]
    )
    if (short := outward < -BOX_SLACK_MM).any():
        yield f"{kind} box smaller", f"{short.sum()} sides, worst {-np.nanmin(outward):.3g} mm"
    if (wide := outward > BOX_MM).any():
        yield f"{kind} box larger", f"{wide.sum()} sides, worst {np.nanmax(outward):.3g} mm"


def _features(side: Loaded, shape: int, number: dict[int, int]) -> Counter[Any]:
    """Kind and faces of each feature, faces by the old side's numbers."""
    features, classes = side.table("feature", shape_id=shape), side.table("feature_class")
    uses = side.table("feature_surface", shape_id=shape)
    if not features:
        return Counter()
    kind = dict(zip(classes["id"].tolist(), classes["kind"].tolist(), strict=True))
    faces: dict[int, list[int]] = {}
    for no, surface in zip(uses["feature_no"].tolist(), uses["surface_no"].tolist(), strict=True):
        faces.setdefault(no, []).append(number.get(surface, -1))
    rows = zip(features["feature_no"].tolist(), features["feature_class_id"].tolist(), strict=True)
    return Counter((kind[of], tuple(sorted(faces.get(no, ())))) for no, of in rows)


def compare(old_folder: Path, new_folder: Path) -> int:
    """Print every difference; how many kinds of difference there are over all files."""
    count = 0
    for folder in sorted(path for path in old_folder.iterdir() if path.is_dir()):
        old, new = Loaded(folder), Loaded(new_folder / folder.name)
        lines: Counter[str] = Counter()
        if old.status != new.status:
            lines[f"exit status {old.status} -> {new.status}"] += 1
        elif old.status == 0:
            if [one[0] for one in old.placed] != [one[0] for one in new.placed]:
                lines["paths of placed parts differ"] += 1
            pairs: dict[tuple[int, int], None] = {}
            for (_, a, a_from), (_, b, b_from) in zip(old.placed, new.placed, strict=False):
                if np.abs(a_from - b_from).max() > 1e-6:
                    lines["placed elsewhere"] += 1
                pairs[a, b] = None
            for a, b in pairs:
                for name in ("number", "name", "material", "colour", "supplemental"):
                    if old.parts[a].get(name) != new.parts[b].get(name):
                        lines[f"part {name}: {old.parts[a].get(name)} -> {new.parts[b].get(name)}"] += 1
                shapes = int(old.parts[a]["shape_id"]), int(new.parts[b]["shape_id"])
                for what, how in compare_shapes(old, shapes[0], new, shapes[1]):
                    lines[f"{what}: {how}"] += 1
        print(f"{folder.name}: {'equal' if not lines else ''}")
        for line, times in lines.items():
            print(f"    {line}" + (f" (x {times})" if times > 1 else ""))
        count += len(lines)
    return count


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("verb", choices=("make", "compare"))
    parser.add_argument("folders", type=Path, nargs="+")
    options = parser.parse_args()
    if options.verb == "make":
        make(options.folders[0])
    else:
        old, new = options.folders
        print(f"{compare(old, new)} differences")


if __name__ == "__main__":
    main()
