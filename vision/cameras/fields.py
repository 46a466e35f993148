"""Fields of the YAML and JSON files that people write: read by name, and refused in a sentence where they are wrong."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from relmodel.arrays import Floats
from relmodel.errors import InputError
from relmodel.paths import read_text

# A rotation typed or rounded to six digits is off by some 1e-6; anything worse is a mistake, not round-off.
ROTATION_TOLERANCE = 1e-4


def parse_yaml(text: str, path: Path, what: str, loader: Any = None, *, first: bool = False) -> dict[str, Any]:
    """The mapping that a YAML text holds, read by PyYAML's safe loader or one made from it; `first`: of several
    documents the first that is not empty."""
    import yaml

    try:
        documents = yaml.load_all(text, Loader=loader or yaml.SafeLoader)
        data = next((it for it in documents if it is not None), None)
        if not first and next((it for it in documents if it is not None), None) is not None:
            raise InputError(f"the {what} file {path} holds several documents, each after a line ---: keep one")
    except (yaml.YAMLError, ValueError, RecursionError) as e:
        mark = getattr(e, "problem_mark", None)
        at = f" at line {mark.line + 1}" if mark else ""
        raise InputError(f"the {what} file {path} is not valid YAML{at}: correct it there") from e
    if not isinstance(data, dict):
        raise InputError(f"the {what} file {path} holds no mapping: see the documentation for its form")
    return data


def read_yaml(path: Path, what: str) -> dict[str, Any]:
    """The mapping in a YAML or JSON file."""
    return parse_yaml(read_text(path, f"{what} file"), path, what)


def member(data: dict[str, Any], key: str, path: Path, where: str) -> Any:
    """What stands under a key; `where` is the way to `data`, as `cameras.NAME.`."""
    if data.get(key) is None:
        raise InputError(f"{path}: '{where}{key}' is missing: add it")
    return data[key]


def numbers(data: dict[str, Any], key: str, path: Path, where: str, shape: tuple[int, ...]) -> Floats:
    """Finite numbers of a shape under a key."""
    value = member(data, key, path, where)
    wanted = "x".join(map(str, shape)) + " numbers" if shape else "one number"
    try:
        array = np.array(value, dtype=float)
    except (TypeError, ValueError, OverflowError) as e:
        raise InputError(f"{path}: {where}{key} is not made of numbers: give {wanted}") from e
    if array.shape != shape:
        raise InputError(f"{path}: {where}{key} has the size {'x'.join(map(str, array.shape))}: give {wanted}")
    if not np.isfinite(array).all():
        raise InputError(f"{path}: {where}{key} holds a number that is not finite: give {wanted}")
    return array


def pixel_count(data: dict[str, Any], key: str, path: Path, where: str) -> int:
    """A picture's width or height under a key."""
    value = member(data, key, path, where)
    if isinstance(value, bool) or not isinstance(value, int) or value < 1:
        raise InputError(f"{path}: {where}{key} is {value!r}: give the picture's size in whole pixels")
    return value


def rigid(matrix: Floats, path: Path, name: str) -> Floats:
    """The transform with its rotation made exactly orthonormal; refused when it was not one but for round-off."""
    r = matrix[:3, :3]
    off = max(float(np.abs(r.T @ r - np.eye(3)).max()), float(np.abs(matrix[3] - [0, 0, 0, 1]).max()))
    if off <= ROTATION_TOLERANCE and np.linalg.det(r) < 0:
        raise InputError(f"{path}: {name} mirrors, so it is not a rigid transform: give a rotation, mm, and 0 0 0 1")
    if off > ROTATION_TOLERANCE:
        raise InputError(
            f"{path}: {name} is not a rigid transform (off by {off:.2g}): give a rotation, mm, and 0 0 0 1"
        )
    u, _, vt = np.linalg.svd(r)
    out = np.eye(4)
    out[:3, :3] = u @ vt
    out[:3, 3] = matrix[:3, 3]
    return out
