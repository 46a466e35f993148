"""What a stored inspection found, for other programs: JSON, tables, and a GLB of the world with the rig in it."""

from __future__ import annotations

import json
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from sqlalchemy import Connection

from relmodel.app.export.glb import Painted, in_metres, painted_meshes
from relmodel.app.export.tables import of_store
from relmodel.errors import UsageError
from relmodel.geometry.transforms import MATRIX_COLUMNS, matrices
from relmodel.paths import check_writable
from relmodel.printing import finite
from relmodel.progress import Progress, silent
from relmodel.store import Store, sql

if TYPE_CHECKING:
    import pyarrow as pa

# The transform that each table's rows hold; no table has two.
_TRANSFORMS = {
    "inspection": "world_from_rig",
    "prior": "world_from_rig",
    "hypothesis": "world_from_rig",
    "camera": "rig_from_camera",
    "base_correction": "world_from_base",
}
# What every row says of its origin.
_CARRIED = ("store_id", "cell", "run")
# Tables of one row, which are objects in JSON.
_SINGLE = ("inspection", "prior", "base_correction")
# glTF's cameras look along -z with y up, OpenCV's along z with y down.
_CAMERA_FROM_GLTF = np.diag([1.0, -1.0, -1.0, 1.0])
_NEAR_M = 0.01


def read_results(store: Store, connection: Connection, run_id: int) -> dict[str, pa.Table]:
    """The tables of an inspection's results, by name: those of `queries/result`, `inspection` first; every row says of
    which store and run.

    Raises UsageError where the run is not an inspection that ended.
    """
    names = sorted(sql.query_names("result"), key=lambda name: (name != "result/inspection", name))
    tables = {name.partition("/")[2]: store.arrow(connection, name, run_id=run_id) for name in names}
    if not tables["inspection"].num_rows:
        raise UsageError(
            f"the run {run_id} is not an inspection with an answer: relmodel runs --kind inspect lists them"
        )
    return of_store(store, connection, tables, run=run_id)


def results_json(tables: dict[str, pa.Table]) -> dict[str, Any]:
    """The tables as plain numbers, texts and lists.

    The answer, its store and its time stand on top (such a file serves as a prior), the other tables under their names:
    lists of rows, or one object for a single row.  Transforms are 4x4, covariances 6x6.
    """
    rows = {name: [_plain_row(name, row) for row in table.to_pylist()] for name, table in tables.items()}
    single = {name: next(iter(rows[name]), None) for name in _SINGLE}
    answer: dict[str, Any] = single["inspection"] or {}
    others = {name: single[name] if name in _SINGLE else rows[name] for name in rows if name != "inspection"}
    plain: dict[str, Any] = finite({**answer, **others})
    return plain


def write_json(tables: dict[str, pa.Table], path: Path) -> None:
    """Write `results_json` to a file."""
    check_writable(path, "file")
    path.write_text(json.dumps(results_json(tables), indent=1) + "\n", encoding="utf-8")


def write_scene(
    store: Store, connection: Connection, tables: dict[str, pa.Table], path: Path, progress: Progress = silent
) -> None:
    """Write a GLB of the world of an inspection, m: a node a placed part, a node `rig` at the pose found and `prior` at
    the prior, where there is one, each with the cameras below it as glTF's own, which have neither distortion nor
    principal point; `extras` have these and the verdict."""
    import trimesh

    check_writable(path, "file")
    answer = results_json(tables)
    parts = store.arrow(connection, "scene/inspected", run_id=answer["run"]).to_pylist()
    painted: list[Painted] = [(int(part["shape_id"]), part["colour"]) for part in parts]
    names = {key: f"{key[0]} {key[1] or ''}".rstrip() for key in painted}
    scene = trimesh.Scene(base_frame="world")
    for key, mesh in painted_meshes(store, connection, names, path.name, progress).items():
        scene.geometry[names[key]] = mesh
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
            scene.graph.update(node, name, matrix=rig_from_camera, metadata=_calibration(camera))
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


def _calibration(camera: dict[str, Any]) -> dict[str, Any]:
    """What a camera of glTF has no field for."""
    keys = ("width", "height", "fx", "fy", "cx", "cy", "skew", "distortion", "file_name")
    return {key: camera[key] for key in keys}


def _plain_row(table: str, row: dict[str, Any]) -> dict[str, Any]:
    """A row with its transform as 4x4 and covariance as 6x6, and times as text, without what the top says already."""
    above = () if table == "inspection" else _CARRIED
    out = {name: _plain(value) for name, value in row.items() if name not in (*MATRIX_COLUMNS, *above)}
    if table in _TRANSFORMS:
        stated = {name: np.array([row[name]]) for name in MATRIX_COLUMNS if row[name] is not None}
        out[_TRANSFORMS[table]] = matrices(stated)[0].tolist() if stated else None
    if row.get("covariance") is not None:
        out["covariance"] = np.reshape(row["covariance"], (6, 6)).tolist()
    return out


def _plain(value: Any) -> Any:
    return value.isoformat() if isinstance(value, datetime) else value
