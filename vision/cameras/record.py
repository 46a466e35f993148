"""Rows of what an inspection is given: pictures, calibrated rigs, and worlds that mount them."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping
from dataclasses import astuple
from pathlib import Path
from typing import Any

import numpy as np
from sqlalchemy import Connection

from relmodel.arrays import Columns, Ragged
from relmodel.errors import InputError
from relmodel.geometry.transforms import matrices, matrix_columns
from relmodel.progress import Progress, silent
from relmodel.store import Run, Store
from relmodel.store.database import Database
from relmodel.world.placement import WorldReport, place_world
from vision.cameras.cameras import CalibrationSigma, Camera, Rig
from vision.cameras.files import read_rig, rig_inputs
from vision.cameras.images import Picture

# The columns of `CalibrationSigma`, in its order.
_SIGMA = ("sigma_focal", "sigma_centre_px", "sigma_translation_mm", "sigma_rotation", "sigma_radial")


def record_picture(run: Run, connection: Connection, picture: Picture, *, keep_bytes: bool) -> int:
    """Identity of the picture's row, appended where it is new; its bytes too where they are to be kept."""
    found = run.store.select(connection, "image", "id", sha256=picture.sha256)["id"]
    if len(found):
        return int(found[0])
    image_id = int(run.new_ids(connection, "image", 1)[0])
    columns: Columns = {
        "id": [image_id],
        "sha256": picture.sha256,
        "file_name": picture.file_name,
        "orientation": [picture.orientation if picture.orientation > 1 else None],
        "width": picture.width,
        "height": picture.height,
        "depth": picture.depth,
    }
    run.append(connection, "image", columns)
    if keep_bytes:
        run.append(connection, "image_blob", {"image_id": [image_id], "bytes": [picture.data]})
    return image_id


def find_rig(store: Database, connection: Connection, rig: Rig) -> int | None:
    """Identity of the row of a rig of this content; None where there is none."""
    camera_ids = {}
    for name, camera in rig.cameras.items():
        found = _found(store, connection, "camera", _camera_content(camera))
        if found is None:
            return None
        camera_ids[name] = found
    return _found(store, connection, "rig", _rig_content(rig, camera_ids))


def record_rig(run: Run, connection: Connection, rig: Rig) -> int:
    """Identity of the rig's row, appended with its cameras where they are new."""
    camera_ids = {name: _record_camera(run, connection, camera) for name, camera in rig.cameras.items()}

    def append(rig_id: int, key: str) -> None:
        run.append(connection, "rig", {"id": [rig_id], "content_key": key})
        for name, camera_id in camera_ids.items():
            sigma = astuple(rig.sigma[name]) if name in rig.sigma else [None] * len(_SIGMA)
            columns: Columns = {
                "rig_id": [rig_id],
                "name": name,
                "camera_id": camera_id,
                **matrix_columns(rig.rig_from_camera[name]),
                **dict(zip(_SIGMA, sigma, strict=True)),
            }
            run.append(connection, "rig_camera", columns)

    return _once(run, connection, "rig", _rig_content(rig, camera_ids), append)


def read_recorded_rig(columns: Mapping[str, Any]) -> Rig:
    """The rig of rows of its cameras, in order: those of `rig_camera` with `camera` for the name, and of these."""
    names = list(columns["camera"])
    matrix = np.tile(np.eye(3), (len(names), 1, 1))
    for name, (i, j) in {"fx": (0, 0), "skew": (0, 1), "cx": (0, 2), "fy": (1, 1), "cy": (1, 2)}.items():
        matrix[:, i, j] = columns[name]
    size = zip(columns["width"].tolist(), columns["height"].tolist(), matrix, columns["distortion"], strict=True)
    sigma = np.stack([columns[name] for name in _SIGMA], axis=1).astype(float)  # of NULLs alone: no numbers
    return Rig(
        dict(zip(names, (Camera(*of) for of in size), strict=True)),
        dict(zip(names, matrices(columns), strict=True)),
        {name: CalibrationSigma(*of) for name, of in zip(names, sigma.tolist(), strict=True) if not np.isnan(of).any()},
    )


def _record_camera(run: Run, connection: Connection, camera: Camera) -> int:
    def append(camera_id: int, key: str) -> None:
        columns: Columns = {
            "id": [camera_id],
            "content_key": key,
            "width": camera.width,
            "height": camera.height,
            "fx": float(camera.matrix[0, 0]),
            "fy": float(camera.matrix[1, 1]),
            "cx": float(camera.matrix[0, 2]),
            "cy": float(camera.matrix[1, 2]),
            "skew": float(camera.matrix[0, 1]),
            "distortion": Ragged.pack([camera.distortion]),
            **dict(zip(("view_u0", "view_v0", "view_u1", "view_v1"), camera.undistorted_bounds.tolist(), strict=True)),
        }
        run.append(connection, "camera", columns)

    return _once(run, connection, "camera", _camera_content(camera), append)


def _camera_content(camera: Camera) -> object:
    return [camera.width, camera.height, camera.matrix.tolist(), camera.distortion.tolist()]


def _rig_content(rig: Rig, camera_ids: dict[str, int]) -> object:
    content = {}
    for name in sorted(rig.cameras):
        sigma = rig.sigma.get(name)
        stated = [] if sigma is None else [list(astuple(sigma))]
        content[name] = [camera_ids[name], rig.rig_from_camera[name].tolist(), *stated]
    return content


def _once(run: Run, connection: Connection, table: str, content: object, append: Callable[[int, str], None]) -> int:
    """Identity of the row with this content, made by `append` where there is none yet."""
    found = _found(run.store, connection, table, content)
    if found is not None:
        return found
    identity = int(run.new_ids(connection, table, 1)[0])
    append(identity, _key(content))
    return identity


def _found(store: Database, connection: Connection, table: str, content: object) -> int | None:
    found = store.select(connection, table, "id", content_key=_key(content))["id"]
    return int(found[0]) if len(found) else None


def _key(content: object) -> str:
    return hashlib.sha256(json.dumps(content).encode()).hexdigest()


# World files that mount rigs: placed with their rigs as rows.


def place_world_with_rigs(store: Store, path: str | Path, progress: Progress = silent) -> WorldReport:
    """`place_world` with the rigs of the file, in any format of `read_rig` that is one file: its digest says whether
    the world changed."""

    def read(path: Path) -> Rig:
        if len(rig_inputs(path)) > 1:
            raise InputError(f"the rig {path} is of several files: make it one with relmodel rig convert, name that")
        return read_rig(path)

    return place_world(
        store,
        path,
        progress=progress,
        write_rig=lambda run, connection, _, file: record_rig(run, connection, read(file)),
    )
