"""A plan of the next views, and the files by which they are taken and inspected."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

import yaml

from relmodel.errors import InputError, UsageError
from relmodel.progress import Progress, silent
from relmodel.store import Store
from vision.cameras.cameras import Rig
from vision.cameras.files import read_rig
from vision.planning import Plan, PlanOptions, plan_views

_SIGMA = {"translation_mm": 5.0, "rotation_deg": 0.5}  # as for a rig on an arm: relmodel where


def propose_views(
    store: Store, rig_file: Path, wanted: PlanOptions, out: Path | None = None, progress: Progress = silent
) -> Plan:
    """`plan_views` for the rig of a file; out: a folder for a prior of each view and their lists, pairs.csv
    to inspect them one by one and standpoints.csv to inspect them together."""
    serial, distance, most = wanted.get("serial"), wanted.get("distance"), wanted.get("views")
    if (serial is None) == (wanted.get("object") is None):
        raise UsageError("a plan is of a physical part by its serial number, or of an object: name one of them")
    if distance is not None and not distance > 0:
        raise UsageError(f"{distance:g} mm is no distance: give mm above zero")
    if most is not None and most < 1:
        raise UsageError(f"a plan of {most} views proposes nothing: give at least 1")
    rig = read_rig(rig_file)
    plan = plan_views(store, rig, wanted, progress)
    if out is not None:
        _write_files(plan, rig, rig_file, serial, out)
    return plan


def _write_files(plan: Plan, rig: Rig, rig_file: Path, serial: str | None, out: Path) -> None:
    try:
        out.mkdir(parents=True, exist_ok=True)
        lines: list[dict[str, str]] = []
        for number, view in enumerate(plan.views, 1):
            stem = f"view_{number:02}"
            prior = {"world_from_rig": view.world_from_rig.tolist(), "sigma": _SIGMA}
            joints = f"# joints (rad, mm): {json.dumps(view.joints)}\n" if view.joints else ""
            text = yaml.safe_dump(prior, sort_keys=False, default_flow_style=None, width=200)
            (out / f"{stem}.yaml").write_text(f"# It would check: {'; '.join(view.paths)}\n{joints}{text}")
            line: dict[str, Any] = {name: f"{stem}_{name}.png" for name in rig.cameras}
            lines.append(line | {"prior": f"{stem}.yaml", "rig": str(rig_file.resolve()), "serial": serial or ""})
        together: list[dict[str, Any]] = [
            {"name": it["prior"][:-5], "pose": it["prior"]}
            | dict(zip(("sigma_mm", "sigma_deg"), _SIGMA.values(), strict=True))
            | {name: it[name] for name in rig.cameras}
            for it in lines
        ]
        for name, table in {"pairs.csv": lines, "standpoints.csv": together}.items():
            with (out / name).open("w", newline="") as file:
                writer = csv.DictWriter(file, table[0] if table else [*rig.cameras])
                writer.writeheader()
                writer.writerows(table)
    except OSError as error:
        raise InputError(f"{out} cannot be written ({error.strerror}): give another folder") from error
