"""What differs between two runs: what they were given, with which code, the step at which they part, and what came out.

Each query of `queries/audit/compare` gives names and values of a run; those that differ are reported, in the order of
the files' names.  From `STEPS` on these are what the run did, step by step, and the first difference is where the two
runs part.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from relmodel.app.audit.newest import find_run
from relmodel.arrays import Floats
from relmodel.geometry.transforms import MATRIX_COLUMNS, matrices, rotation_vector
from relmodel.store import Store, sql

_FOLDER = "audit/compare"
STEPS = "50"  # files with this number and above are steps of a run
_LONGEST = 40  # characters of a value that is shown in short
_DIGEST = re.compile(r"\b([0-9a-f]{8})[0-9a-f]{24,}\b")
_NUMBER = re.compile(r"-?\d+(\.\d*)?([eE][-+]?\d+)?")
_AXES = ("x", "y", "z")
_UNITS = ("mm", "mm", "mm", "rad", "rad", "rad")


class Difference(NamedTuple):
    """One thing that differs: of the first run and of the second; of numbers how far, and one standard deviation."""

    section: str
    name: str
    first: str | float | None
    second: str | float | None
    difference: float | None = None
    sigma: float | None = None


def compare_runs(store: Store, first: int, second: int) -> list[Difference]:
    """What differs between two runs; empty where nothing does.  Raises UsageError where there is no such run."""
    with store.read() as connection:
        recorded = [find_run(store, connection, run) for run in (first, second)]
        given, did = list[Difference](), list[Difference]()
        for name in sql.query_names(_FOLDER):
            number, _, section = name.rpartition("/")[2].partition("_")
            of_both = [
                {str(row.name): _number(row.value) for row in store.rows(connection, name, run=run)}
                for run in (first, second)
            ]
            (did if number >= STEPS else given).extend(_differing(section, *of_both))
        for section in ("parameters", "versions"):
            of_both = [dict(_flat(json.loads(getattr(row, section)))) for row in recorded]
            given += _differing(section, *of_both)
        poses = [store.rows(connection, "audit/pose", run=run) for run in (first, second)]
    part = [Difference("first step that differs", did[0].section, None, None)] if did else []
    return [*given, *part, *did, *(_poses(poses[0][0], poses[1][0]) if all(poses) else ())]


def beginnings(first: str | float | None, second: str | float | None) -> tuple[str | float | None, str | float | None]:
    """Two values in short: digests by their first digits, long texts from near where they differ."""
    a, b = (_DIGEST.sub(r"\1...", v) if isinstance(v, str) else v for v in (first, second))
    same = next((i for i, (x, y) in enumerate(zip(str(a), str(b), strict=False)) if x != y), 0)
    start = same - _LONGEST // 2 if same > _LONGEST * 3 // 4 else 0
    return _part(a, start), _part(b, start)


def _part(value: str | float | None, start: int) -> str | float | None:
    if not isinstance(value, str) or len(value) <= _LONGEST:
        return value
    end = start + _LONGEST
    return f"{'...' if start else ''}{value[start:end].strip()}{'...' if end < len(value) else ''}"


def _number(text: str | None) -> str | float | None:
    """A number where a text is one, so that tables round it."""
    return float(text) if text is not None and _NUMBER.fullmatch(text) else text


def _differing(section: str, first: dict[str, Any], second: dict[str, Any]) -> list[Difference]:
    names = sorted(first.keys() | second.keys())
    return [Difference(section, n, first.get(n), second.get(n)) for n in names if first.get(n) != second.get(n)]


def _flat(value: Any, name: str = "") -> Iterator[tuple[str, str]]:
    """The leaves of a JSON value, named by the way to them: `localisation.verdict.weights[0]`."""
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from _flat(inner, f"{name}.{key}" if name else key)
    elif isinstance(value, list):
        for i, inner in enumerate(value):
            yield from _flat(inner, f"{name}[{i}]")
    else:
        yield name, json.dumps(value)


def _poses(first: Any, second: Any) -> list[Difference]:
    """How two poses differ: along and about the world's axes, then along and about those of the first rig."""
    a, b = (matrices({c: np.array([getattr(row, c)]) for c in MATRIX_COLUMNS})[0] for row in (first, second))
    if np.array_equal(a, b) and list(first.covariance) == list(second.covariance):
        return []
    turn = rotation_vector(b[:3, :3] @ a[:3, :3].T)
    world = _sigmas(first.world_covariance) ** 2 + _sigmas(second.world_covariance) ** 2
    rig = _sigmas(first.covariance) ** 2 + _sigmas(second.covariance) ** 2
    out = [
        Difference("pose in the world", f"{axis}, mm", float(a[i, 3]), float(b[i, 3]), float(b[i, 3] - a[i, 3]), sigma)
        for i, (axis, sigma) in enumerate(zip(_AXES, np.sqrt(world[:3]).tolist(), strict=True))
    ]
    out += _moved("pose in the world", "turn about", turn, np.sqrt(world[3:]), "rad")
    shift = a[:3, :3].T @ (b[:3, 3] - a[:3, 3])
    out += _moved("pose in the rig", "shift along", shift, np.sqrt(rig[:3]), "mm")
    out += _moved("pose in the rig", "turn about", a[:3, :3].T @ turn, np.sqrt(rig[3:]), "rad")
    for section, name in (("sigma in the world", "world_covariance"), ("sigma in the rig", "covariance")):
        before, after = (_sigmas(getattr(row, name)).tolist() for row in (first, second))
        labels = [f"{'about ' if i > 2 else ''}{_AXES[i % 3]}, {unit}" for i, unit in enumerate(_UNITS)]
        out += [
            Difference(section, label, x, y, y - x) for label, x, y in zip(labels, before, after, strict=True) if x != y
        ]
    return out


def _moved(section: str, how: str, by: Floats, sigma: Floats, unit: str) -> list[Difference]:
    rows = zip(_AXES, by.tolist(), sigma.tolist(), strict=True)
    return [Difference(section, f"{how} {axis}, {unit}", None, None, value, s) for axis, value, s in rows]


def _sigmas(covariance: Any) -> Floats:
    """Standard deviations (6,) of a covariance, 6x6 row-major."""
    variance = np.diag(np.reshape(np.asarray(covariance, float), (6, 6)))
    return np.asarray(np.sqrt(np.maximum(variance, 0.0)))
