"""What other programs take from a store: objects and results of inspections as GLB, JSON, QIF, Parquet and CSV."""

from __future__ import annotations

import json
import uuid
from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping, Sequence
from datetime import datetime
from itertools import count
from operator import itemgetter
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np
import pyarrow as pa
from sqlalchemy import Connection

import relmodel
from relmodel.app.tree import Tree, read_tree
from relmodel.arrays import Floats
from relmodel.drawing.solid import read_meshes
from relmodel.errors import UsageError
from relmodel.geometry.transforms import MATRIX_COLUMNS, inverse, matrices, matrix_columns
from relmodel.names import check_writable, make_folder, visible
from relmodel.printing import finite, json_text
from relmodel.progress import Progress, silent
from relmodel.store import Store, sql

# Endings of other model formats, which are not written.
_OTHER_FORMS = (".gltf", ".json", ".qif", ".xlsx", ".csv", ".parquet", ".obj", ".stl", ".ply", ".3mf", ".step", ".stp")


def export_object(
    store: Store,
    connection: Connection,
    name: str,
    variant: str,
    out: Path,
    tables: str = "parquet",
    progress: Progress = silent,
) -> list[Path]:
    """Write an object as .glb, or its tables into a folder; the files written."""
    form = _form(out, (".glb",))
    tree = read_tree(store, connection, name, variant)
    if form == ".glb":
        export_glb(store, connection, tree, out, progress)
        return [out]
    return write_tables(read_tables(store, connection, tree), out, tables, progress)


def export_run(
    store: Store,
    connection: Connection,
    results: dict[str, pa.Table],
    out: Path,
    tables: str = "parquet",
    progress: Progress = silent,
) -> list[Path]:
    """Write what an inspection found, tables of `read_results`, as .json, .qif or .glb, or into a folder; the files."""
    form = _form(out, (".glb", ".json", ".qif"))
    if form == ".json":
        check_writable(out, "file")
        out.write_text(json.dumps(results_json(results), indent=1) + "\n", encoding="utf-8")
    elif form == ".qif":
        write_qif(results, out)
    elif form == ".glb":
        write_scene(store, connection, results, out, progress)
    else:
        return write_tables(results, out, tables, progress)
    return [out]


def _form(out: Path, forms: Sequence[str]) -> str:
    """The ending of a file's name.  Raises UsageError where it is of a form that is not written."""
    ending = out.suffix.lower()
    if ending in set(_OTHER_FORMS) - set(forms):
        raise UsageError(f"{out} has the suffix of another model format: use {', '.join(forms)}, or name a folder")
    return ending


_METRES = 1e-3  # GLB is in metres
_PLAIN = "#b0b4b8"  # of parts without a colour
# A shape's identity and a colour, None where the part has none.
Painted = tuple[int, str | None]


def export_glb(store: Store, connection: Connection, tree: Tree, path: Path, progress: Progress = silent) -> None:
    """Write the tree as GLB: a node an object or part, each shape once, however often it is placed; metres.

    Parts that share a shape in unlike colours have a geometry each, since GLB colours geometry.  Raises UsageError for
    a tree without parts, InputError where the file cannot be written."""
    check_writable(path, "file")
    if not (tree.shape_id >= 0).any():
        raise UsageError(f"{tree.name} has no geometry to write as GLB")
    parts = store.rows(connection, "object/parts", part_ids=np.unique(tree.part_id[tree.part_id >= 0]).tolist())
    painted: dict[int, Painted] = {int(p.id): (int(p.shape_id), p.colour) for p in parts}
    names: dict[Painted, str] = {}
    for p in parts:
        names.setdefault(painted[int(p.id)], f"{p.number} {p.shape_id} {p.colour or ''}".rstrip())
    scene = painted_scene(store, connection, names, path.name, progress)
    row_of = {p: i for i, p in enumerate(tree.path)}
    for i, name in enumerate(tree.path):
        parent = name.rpartition("/")[0]
        above = row_of.get(parent)
        local = tree.pose[i] if above is None else inverse(tree.pose[above]) @ tree.pose[i]
        geometry = names.get(painted.get(int(tree.part_id[i]), (-1, None)))
        scene.graph.update(
            frame_to=name,
            frame_from=parent if above is not None else "world",
            matrix=in_metres(local),
            geometry=geometry if geometry in scene.geometry else None,
        )
    path.write_bytes(scene.export(file_type="glb"))


def painted_scene(
    store: Store, connection: Connection, names: Mapping[Painted, str], what: str, progress: Progress = silent
) -> Any:
    """A scene (trimesh, m) with a geometry of each shape in each colour that is named, if it has triangles."""
    import trimesh

    scene = trimesh.Scene(base_frame="world")
    colours: dict[int, list[str | None]] = {}
    for shape, colour in names:
        colours.setdefault(shape, []).append(colour)
    for done, (shape, vertices, triangles, _) in enumerate(read_meshes(store, connection, sorted(colours))):
        progress(f"{what}: shapes", done, len(colours))
        mesh = trimesh.Trimesh(vertices * _METRES, triangles, process=False)
        for colour in colours[shape]:
            one = mesh.copy()
            rgba = [*(int((colour or _PLAIN)[i : i + 2], 16) for i in (1, 3, 5)), 255]
            paint = trimesh.visual.material.PBRMaterial(baseColorFactor=rgba, metallicFactor=0.3, roughnessFactor=0.6)
            one.visual = trimesh.visual.TextureVisuals(material=paint)
            scene.geometry[names[shape, colour]] = one
    progress(f"{what}: writing", len(colours), len(colours))
    return scene


def in_metres(pose: Floats) -> Floats:
    """A rigid transform (4, 4) of mm as one of metres."""
    scaled = pose.copy()
    scaled[:3, 3] *= _METRES
    return scaled


# What a stored inspection found, for other programs: JSON, tables, and a GLB of the world with the rig in it.

# The transform that each table's rows hold; no table has two.
_TRANSFORMS = {
    "inspection": "world_from_rig",
    "prior": "world_from_rig",
    "hypothesis": "world_from_rig",
    "camera": "rig_from_camera",
    "base_correction": "world_from_base",
    "considered_object": "object_from_rig",
}
# What every row says of its origin.
_CARRIED = ("store_id", "cell", "run")
# Tables of one row, which are objects in JSON.
_SINGLE = ("inspection", "prior")
# glTF's cameras look along -z with y up, OpenCV's along z with y down.
_CAMERA_FROM_GLTF = np.diag([1.0, -1.0, -1.0, 1.0])
_NEAR_M = 0.01
_CALIBRATION = ("width", "height", "fx", "fy", "cx", "cy", "skew", "distortion", "file_name")  # no fields of glTF


def read_results(store: Store, connection: Connection, run_id: int) -> dict[str, pa.Table]:
    """The tables of an inspection's results, by name: those of `queries/result`, `inspection` first; every row says of
    which store and run.  Raises UsageError where the run is not an inspection that ended."""
    names = sorted(sql.query_names("result"), key=lambda name: (name != "result/inspection", name))
    tables = {name.partition("/")[2]: store.arrow(connection, name, run_id=run_id) for name in names}
    if not tables["inspection"].num_rows:
        raise UsageError(f"run {run_id} is no inspection with an answer: relmodel runs --kind inspect lists them")
    return _of_store(store, connection, tables, run=run_id)


def results_json(tables: dict[str, pa.Table]) -> dict[str, Any]:
    """The tables as plain numbers, texts and lists.

    The answer, its store and its time stand on top (such a file serves as a prior), the other tables under their names:
    lists of rows, or one object for a single row.  Transforms are 4x4, covariances 6x6."""
    said: dict[str, Any] = {n: [_plain_row(n, row) for row in table.to_pylist()] for n, table in tables.items()}
    said |= {name: next(iter(said[name]), None) for name in _SINGLE}
    plain: dict[str, Any] = finite((said.pop("inspection") or {}) | said)
    return plain


def write_scene(
    store: Store, connection: Connection, tables: dict[str, pa.Table], path: Path, progress: Progress = silent
) -> None:
    """Write a GLB of the world of an inspection, m: a node a placed part, a node `rig` at the pose found and `prior` at
    the prior, where there is one, each with the cameras below it as glTF's own, which have neither distortion nor
    principal point; `extras` have these and the verdict."""
    check_writable(path, "file")
    answer = results_json(tables)
    (world,) = store.select(connection, "inspection", "world_id", run_id=answer["run"])["world_id"].tolist()
    parts = store.arrow(connection, "scene/coloured_parts", world_id=world, run_id=answer["run"]).to_pylist()
    painted: list[Painted] = [(int(part["shape_id"]), part["colour"]) for part in parts]
    names = {key: f"{key[0]} {key[1] or ''}".rstrip() for key in painted}
    scene = painted_scene(store, connection, names, path.name, progress)
    poses = matrices({name: np.array([part[name] for part in parts], float) for name in MATRIX_COLUMNS})
    for part, key, pose in zip(parts, painted, poses, strict=True):
        geometry = names[key] if names[key] in scene.geometry else None
        seen = {"in_view": bool(part["in_view"])}
        scene.graph.update(part["path"], "world", matrix=in_metres(pose), geometry=geometry, metadata=seen)
    said = (*_CARRIED, "began_at", "verdict", "outcome", "reason", "posterior", "covariance")
    found = {name: answer[name] for name in said}
    cameras: dict[str, dict[str, Any]] = {}
    rigs = [("rig", answer["world_from_rig"], found)]
    if answer["prior"] is not None:
        rigs.append(("prior", answer["prior"]["world_from_rig"], {"covariance": answer["prior"]["covariance"]}))
    for name, pose, extras in rigs:
        scene.graph.update(name, "world", matrix=in_metres(np.array(pose)), metadata=extras)
        for camera in answer["camera"]:
            rig_from_camera = in_metres(np.array(camera["rig_from_camera"])) @ _CAMERA_FROM_GLTF
            node = f"{name}/{camera['camera']}"
            scene.graph.update(node, name, matrix=rig_from_camera, metadata={key: camera[key] for key in _CALIBRATION})
            cameras[node] = camera
    path.write_bytes(scene.export(file_type="glb", tree_postprocessor=lambda tree: _add_cameras(tree, cameras)))


def _add_cameras(tree: dict[str, Any], cameras: dict[str, dict[str, Any]]) -> None:
    """Attach a glTF camera to each camera node: trimesh writes only one."""
    nodes = {node["name"]: node for node in tree["nodes"]}
    tree["cameras"] = []
    for name, c in cameras.items():
        nodes[name]["camera"] = len(tree["cameras"])
        lens = {
            "yfov": 2 * float(np.arctan(0.5 * c["height"] / c["fy"])),
            "aspectRatio": (c["width"] / c["fx"]) / (c["height"] / c["fy"]),
            "znear": _NEAR_M,
        }
        tree["cameras"].append({"name": name, "type": "perspective", "perspective": lens})


def _plain_row(table: str, row: dict[str, Any]) -> dict[str, Any]:
    """A row with its transform as 4x4 and covariance as 6x6, and times as text, without what the top says already."""
    above = () if table == "inspection" else _CARRIED
    out = {
        name: value.isoformat() if isinstance(value, datetime) else value
        for name, value in row.items()
        if name not in (*MATRIX_COLUMNS, *above)
    }
    if table in _TRANSFORMS:
        stated = {name: np.array([row[name]]) for name in MATRIX_COLUMNS if row[name] is not None}
        out[_TRANSFORMS[table]] = matrices(stated)[0].tolist() if stated else None
    if row.get("covariance") is not None:
        out["covariance"] = np.reshape(row["covariance"], (6, 6)).tolist()
    return out


# What an inspection found as a results document of QIF 3 (ISO 23952): characteristics with nominal, limit and result.
#
# The subset: a characteristic of attributes for each part and feature (its state), one of the fitting kind for each
# size measured of it; of each its definition (limits), nominal, item (a name that stays from run to run) and
# measurement with status, value and standard uncertainty. There are no product, features, devices or plan. The order of
# elements is that of the standard's schema files, which require a specification that characteristics are judged by:
# here this program's.

NAMESPACE = "http://qifstandards.org/xsd/qif3"
_STATES = {"as modelled": ("confirmed",), "not as modelled": ("changed", "contradicted")}
_KINDS = {"diameter": "Diameter", "thickness": "Thickness", "width": "Width"}


def write_qif(tables: dict[str, pa.Table], path: Path) -> None:
    """Write the results of an inspection, the tables of `read_results`."""
    check_writable(path, "file")
    (about,) = tables["inspection"].to_pylist()
    root = ET.Element("QIFDocument", {"xmlns": NAMESPACE, "versionQIF": "3.0.0"})
    _add(root, "QPId", str(uuid.uuid5(uuid.NAMESPACE_URL, f"relmodel:{about['store_id']}:{about['run']}")))
    header = _add(root, "Header")
    _add(_add(header, "Application"), "Name", f"relmodel {relmodel.__version__}")
    _add(header, "Description", f"run {about['run']} of the cell {about['cell']}, world {about['world']}")
    numbers = count(1)
    standard = _add(_add(root, "StandardsDefinitions", n="1"), "Standard", id=str(next(numbers)))
    _add(_add(standard, "Organization"), "OtherStandardsOrganization", "relmodel")
    _add(standard, "Designator", "as modelled")
    units = _add(_add(root, "FileUnits"), "PrimaryUnits")
    for kind, si, name, factor in (
        ("AngularUnit", "radian", "deg", "0.017453292519943295"),
        ("LinearUnit", "meter", "mm", "0.001"),
    ):
        unit = _add(units, kind)
        _add(unit, "SIUnitName", si)
        _add(unit, "UnitName", name)
        _add(_add(unit, "UnitConversion"), "Factor", factor)

    characteristics = _add(root, "Characteristics")
    _add(characteristics, "FormalStandardId", standard.get("id"))
    result = _add(_add(_add(root, "Results"), "MeasurementResultsSet", n="1"), "MeasurementResults")
    result.set("id", str(next(numbers)))
    of_result = _add(result, "MeasuredCharacteristics")
    blocks = {name: _add(characteristics, f"Characteristic{name}s") for name in ("Definition", "Nominal", "Item")}
    blocks["Measurement"] = _add(of_result, "CharacteristicMeasurements")
    _add(_add(result, "InspectionStatus"), "InspectionStatusEnum", _verdict(about))
    sizes: dict[str, list[dict[str, Any]]] = defaultdict(list)
    for row in sorted(tables["measured_size"].to_pylist(), key=itemgetter("measure_no")):
        sizes[row["path"]].append(row)
    judged = [row for row in tables["characteristic"].to_pylist() if row["qif"] is not None]
    stated = {(row["path"], row["measured"]) for row in judged}  # by the limits of the part, not those of a change
    for row in tables["presence"].to_pylist():
        if row["level"] != "surface":
            _add_state(row, blocks, numbers)
            seen: Counter[str] = Counter()
            for size in sizes[row["path"]]:
                seen[size["what"]] += 1  # of several faces each has an offset
                name = f"{row['path']}/{size['what']}" + (f" {seen[size['what']]}" if seen[size["what"]] > 1 else "")
                if (row["path"], size["value"]) not in stated:
                    _add_size(name, size, blocks, numbers)
    for row in judged:
        size = {**row, "unit": "mm", "value": row["measured"], "sigma": (row["expanded_uncertainty"] or 0) / 2}
        _add_size(f"{row['number']} {row['path']}/{row['what']}", size, blocks, numbers)
    for block in blocks.values():
        block.set("n", str(len(block)))
    if not len(blocks["Measurement"]):  # the standard has no empty lists
        root.remove(characteristics)
        result.remove(of_result)
    root.set("idMax", str(next(numbers) - 1))
    ET.indent(root)
    ET.ElementTree(root).write(path, encoding="utf-8", xml_declaration=True)


def _add_state(row: dict[str, Any], blocks: dict[str, ET.Element], numbers: Iterator[int]) -> None:
    """The state of a part or feature."""
    definition, nominal, measurement = _add_four("UserDefinedAttribute", row["path"], row["qif"], blocks, numbers)
    _add(definition, "WhatToMeasure", "is as modelled")
    for name, words in (("PassValues", "as modelled"), ("FailValues", "not as modelled")):
        _add(_add(nominal, name, n="1"), "StringValue", words)
    said = next((words for words, states in _STATES.items() if row["state"] in states), None)
    if said is not None:  # what was not checked has no value
        _add(measurement, "Value", said)


def _add_size(name: str, row: dict[str, Any], blocks: dict[str, ET.Element], numbers: Iterator[int]) -> None:
    """A size of it; without a limit of its own the odds decided, and the definition has none."""
    kind = _KINDS.get(row["what"].rpartition("_")[2], f"UserDefined{'Angular' if row['unit'] == 'deg' else 'Linear'}")
    status, limits = row["qif"], [row.get("upper_limit"), row.get("lower_limit")]
    if "decision" not in row:
        status = "NOT_ANALYZED" if row["state"] == "undecidable" else "FAIL" if row["changed"] else "PASS"
        limits = [row["least_difference"], row["least_difference"] and -row["least_difference"]]
    definition, nominal, measurement = _add_four(kind, name, status, blocks, numbers)
    if limits == [None, None]:
        _add(definition, "NonTolerance", "MEASURED")
    else:
        tolerance = _add(definition, "Tolerance")
        for end, limit in zip(("MaxValue", "MinValue"), limits, strict=True):
            if limit is not None:
                _add(tolerance, end, _number(limit))
        _add(tolerance, "DefinedAsLimit", str("decision" in row).lower())
    if kind.startswith("UserDefined"):
        _add(definition, "WhatToMeasure", row["what"])
    _add(nominal, "TargetValue", _number(row["nominal"]))
    if row["value"] is not None:  # the standard has both attributes or none
        _add(measurement, "Value", _number(row["value"]), combinedUncertainty=_number(row["sigma"]), meanError="0")


def _add_four(
    kind: str, name: str, status: str, blocks: dict[str, ET.Element], numbers: Iterator[int]
) -> tuple[ET.Element, ET.Element, ET.Element]:
    """Definition, nominal and measurement of a characteristic, and its item, each named by the next."""
    made = [_add(block, f"{kind}Characteristic{what}", id=str(next(numbers))) for what, block in blocks.items()]
    definition, nominal, item, measurement = made
    _add(nominal, "CharacteristicDefinitionId", definition.get("id"))
    _add(item, "Name", visible(name))
    _add(item, "CharacteristicNominalId", nominal.get("id"))
    _add(_add(measurement, "Status"), "CharacteristicStatusEnum", status)
    _add(measurement, "CharacteristicItemId", item.get("id"))
    return definition, nominal, measurement


def _verdict(about: dict[str, Any]) -> str:
    """Whether the part passes, in QIF's words: unchecked is never passed."""
    if about["part_verdict"] in ("deviates", "another variant"):
        return "FAIL"
    return "PASS" if about["part_verdict"] == "as modelled" and about["checked"] == about["in_view"] else "UNKNOWN"


def _add(parent: ET.Element, name: str, text: str | None = None, **attributes: str) -> ET.Element:
    made = ET.SubElement(parent, name, attributes)
    made.text = text
    return made


def _number(value: float) -> str:
    """As XML Schema spells decimals: without an exponent."""
    return f"{value:.9f}".rstrip("0").rstrip(".")


FORMS = ("parquet", "csv")


def read_tables(store: Store, connection: Connection, tree: Tree) -> dict[str, pa.Table]:
    """Placed parts, parts, features, surfaces and arcs of an object, by name of the table; rows say of which store."""
    placed = np.flatnonzero(tree.part_id >= 0)
    part_ids, shape_ids = np.unique(tree.part_id[placed]).tolist(), np.unique(tree.shape_id[placed]).tolist()
    columns: dict[str, Mapping[str, Any]] = {
        "placed_part": {
            "path": [tree.path[i] for i in placed.tolist()],
            "part_id": tree.part_id[placed],
            "shape_id": tree.shape_id[placed],
            **matrix_columns(tree.pose[placed]),
        },
        "part": store.columns(connection, "object/parts", part_ids=part_ids),
        "feature": store.columns(connection, "object/export_features", shape_ids=shape_ids),
        "surface": store.columns(connection, "object/export_surfaces", shape_ids=shape_ids),
        "arc": store.columns(connection, "object/export_arcs", shape_ids=shape_ids),
    }
    tables = {n: pa.table({c: pa.array(v, from_pandas=True) for c, v in it.items()}) for n, it in columns.items()}
    return _of_store(store, connection, tables)


def _of_store(
    store: Store, connection: Connection, tables: Mapping[str, pa.Table], **others: object
) -> dict[str, pa.Table]:
    """Tables whose every row carries store_id and cell, and the values of the `others`, where it does not already."""
    carried = {**store.rows(connection, "store/identity")[0]._mapping, **others}
    out = {}
    for name, table in tables.items():
        for column, value in carried.items():
            if column not in table.column_names:
                table = table.append_column(column, pa.repeat(value, len(table)))
        out[name] = table
    return out


def write_tables(tables: Mapping[str, pa.Table], folder: Path, form: str, progress: Progress = silent) -> list[Path]:
    """Write a file of `form` (parquet or csv) a table into a folder, which is made; returns the files.

    In CSV no text is left that a spreadsheet would take for a formula, and lists are JSON.  Files that are there are
    replaced.  Raises UsageError for another form, or where they are of another store, InputError where the folder
    cannot be made."""
    from pyarrow import csv, parquet

    if form not in FORMS:
        raise UsageError(f"there is no table format {form}: name parquet or csv")
    make_folder(folder)
    first = next(iter(tables))
    if not _stores_in(folder / f"{first}.{form}", form) <= set(tables[first]["store_id"].to_pylist()):
        raise UsageError(f"{folder} holds tables of another store: name another folder")
    files = []
    for done, (name, table) in enumerate(tables.items()):
        progress(f"{name}.{form}", done, len(tables))
        file = folder / f"{name}.{form}"
        if form == "parquet":
            parquet.write_table(table, file)
        else:
            csv.write_csv(_as_text(table), file)
        files.append(file)
    return files


def _stores_in(file: Path, form: str) -> set[str | None]:
    """The stores whose rows a file holds; None is one where it holds others."""
    from pyarrow import dataset

    try:
        return set(dataset.dataset(file, format=form).to_table(columns=["store_id"])["store_id"].to_pylist())
    except FileNotFoundError:
        return set()
    except pa.ArrowInvalid:
        return {None}


def _as_text(table: pa.Table) -> pa.Table:
    """A table that CSV can hold: lists as JSON, an apostrophe before what a spreadsheet would take for a formula."""
    from pyarrow import compute

    for number, field in enumerate(table.schema):
        column = table.column(number)
        if pa.types.is_list(field.type):
            lists = [None if value is None else json_text(value) for value in column.to_pylist()]
            table = table.set_column(number, field.name, pa.array(lists, pa.string()))
        elif pa.types.is_string(field.type):
            texts = compute.replace_substring_regex(column, r"\A([=+\-@\t\r\n])", r"'\1")
            table = table.set_column(number, field.name, texts)
    return table
