"""Find the parts, features, surfaces or arcs that lie in a box or in a camera's view.

Without --level: parts and their features.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from relmodel.cli.options import add_format, store_target
from relmodel.cli.output import print_rows

EXAMPLE = "relmodel find --box 0 0 0 100 50 20 --level feature --store cell.duckdb"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    volume = parser.add_mutually_exclusive_group(required=True)
    volume.add_argument(
        "--box", nargs=6, type=float, metavar=("x0", "y0", "z0", "x1", "y1", "z1"), help="box in the world, mm"
    )
    volume.add_argument("--camera", type=Path, metavar="RIG.yaml", help="the views of a rig's cameras (needs --at)")
    parser.add_argument("--at", type=Path, metavar="POSE.yaml", help="pose of the rig: a file that says world_from_rig")
    parser.add_argument("--level", choices=("part", "feature", "surface", "arc"), help="what is looked for")
    parser.add_argument("--world", metavar="NAME", help="the world, where the store has several")
    add_format(parser)


def run(args: argparse.Namespace) -> int:
    raise NotImplementedError
