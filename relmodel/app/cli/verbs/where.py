"""Say where a mounted rig is: from the arm's base, its joints and the mount.

Prints a prior file for `relmodel inspect --prior`.  With --found, the pose of the rig that an inspection found (its
answer as JSON, or YAML with world_from_rig and covariance or sigma), prints the correction of the arm's base instead,
with the joints fixed unless their sigmas are given: shift_mm is along the world's axes, turn_rad and covariance (mm,
then rad) along the base's.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from relmodel.app.cli.options import add_joint_sigmas, add_joints, assigned, base_covariance, store_target
from relmodel.errors import UsageError

if TYPE_CHECKING:
    from relmodel.world.kinematics import MountedRig

EXAMPLE = "relmodel where head --on left_arm --set travel=450 --store cell.duckdb"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("rig", metavar="RIG", help="name of the rig in the world file")
    parser.add_argument("--world", metavar="NAME", help="the world, where the store has several")
    add_joints(parser)
    parser.add_argument(
        "--sigma-mm", type=float, default=5.0, help="how surely the rig is there: one sigma an axis (default: 5)"
    )
    parser.add_argument("--sigma-deg", type=float, default=0.5, help="the same for its rotation (default: 0.5)")
    parser.add_argument("--found", type=Path, metavar="POSE", help="the pose found: JSON of inspect, or YAML")
    add_joint_sigmas(
        parser, "with --found: correct this joint too; --sigma-mm and --sigma-deg then say how well the base is known"
    )


def run(args: argparse.Namespace) -> int:
    import yaml

    from relmodel.store import Store
    from relmodel.world.kinematics import mounted_rig

    if args.joint_sigma and not args.found:
        raise UsageError("--joint-sigma says how joints are corrected: give it with --found")
    if not (args.sigma_mm > 0 and args.sigma_deg > 0):
        raise UsageError("--sigma-mm and --sigma-deg must be above zero: a pose is never certain")
    with Store.open(store_target(args), read_only=True) as store:
        rig = mounted_rig(store, args.rig, world=args.world, on=args.on).moved(assigned(args.set, "--set"))
    if args.found:
        answer = _correction(rig, args)
    else:
        sigma = {"translation_mm": args.sigma_mm, "rotation_deg": args.sigma_deg}
        answer = {"world_from_rig": rig.world_from_rig.tolist(), "sigma": sigma}
    print(yaml.safe_dump(answer, sort_keys=False, default_flow_style=None, width=200), end="")
    return 0


def _correction(rig: MountedRig, args: argparse.Namespace) -> dict[str, Any]:
    from relmodel.world.kinematics import correct_base
    from vision.cameras.files import read_found

    sigmas = assigned(args.joint_sigma, "--joint-sigma")
    base = base_covariance(args.sigma_mm, args.sigma_deg) if sigmas else None
    found, covariance = read_found(args.found)
    return correct_base(rig, found, covariance, joint_sigmas=sigmas, base_covariance=base).to_json()
