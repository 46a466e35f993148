"""Find the parts, features, surfaces or arcs that lie in a box or in a camera's view.

Without --level: parts and their features.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from relmodel.cli.options import add_format, store_target
from relmodel.cli.output import print_rows
from relmodel.errors import UsageError

if TYPE_CHECKING:
    from relmodel.index.volumes import Volume

EXAMPLE = "relmodel find --box 0 0 0 100 50 20 --level feature --store cell.duckdb"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    volume = parser.add_mutually_exclusive_group(required=True)
    bounds = ("x0", "y0", "z0", "x1", "y1", "z1")
    volume.add_argument("--box", nargs=6, type=float, metavar=bounds, help="a box in the world, mm")
    volume.add_argument("--camera", type=Path, metavar="RIG.yaml", help="what the cameras of a rig see (needs --at)")
    parser.add_argument(
        "--at", type=Path, metavar="POSE.yaml", help="where the rig is: a file that says world_from_rig"
    )
    parser.add_argument("--near", type=float, default=10.0, help="least depth of the view, mm (default: 10)")
    parser.add_argument("--far", type=float, default=10_000.0, help="greatest depth of the view, mm (default: 10000)")
    parser.add_argument("--level", choices=("part", "feature", "surface", "arc"), help="what is looked for")
    parser.add_argument("--world", metavar="NAME", help="the world, where the store has several")
    add_format(parser)


def run(args: argparse.Namespace) -> int:
    from relmodel.index.find import find_rows
    from relmodel.store import Store

    volumes = _volumes(args)
    with Store.open(store_target(args), read_only=True) as store:
        found = {row for volume in volumes for row in find_rows(store, volume, level=args.level, world=args.world)}
    rows = sorted((row.path, row.level, row.name, *row.box) for row in found)
    print_rows(("path", "level", "name", "x0", "y0", "z0", "x1", "y1", "z1"), rows, args.format)
    return 0


def _volumes(args: argparse.Namespace) -> list[Volume]:
    """The box, or the view of each camera of the rig."""
    from relmodel.index.volumes import Box, Frustum

    if args.box:
        if args.at:
            raise UsageError("--at says where a camera is: give it with --camera, not with --box")
        return [Box(*args.box)]
    if not args.at:
        raise UsageError("--camera needs --at POSE.yaml, which says where the rig is")
    from vision.cameras import read_pose, read_rig

    rig, world_from_rig = read_rig(args.camera), read_pose(args.at)
    volumes: list[Volume] = []
    for name, camera in rig.cameras.items():
        width, height, matrix = camera.undistorted_view()
        pose = world_from_rig @ rig.rig_from_camera[name]
        volumes.append(Frustum(width, height, matrix, pose, args.near, args.far))
    return volumes
