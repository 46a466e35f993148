"""Convert a calibration file to a rig file of relmodel, or say what it holds.

Calibrations: of relmodel, OpenCV, ROS (CameraInfo), Kalibr (camchain) or COLMAP (a folder).  A file is known by what it
says, not by its name.  What a rig cannot hold is refused by name.
"""

from __future__ import annotations

import argparse
import re
from pathlib import Path

from relmodel.app.cli.options import add_format
from relmodel.app.cli.output import say
from relmodel.errors import UsageError
from relmodel.printing import print_rows

EXAMPLE = """relmodel rig convert camchain.yaml rig.yaml
  relmodel rig convert stereo.yml rig.yaml --unit m
  relmodel rig show camchain.yaml"""

# Millimetres of the units that --unit names.
_UNITS = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "inch": 25.4}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("action", choices=("convert", "show"), help="convert IN to OUT, or show what IN holds")
    parser.add_argument("source", type=Path, metavar="IN", help="a rig in any of the formats")
    parser.add_argument("out", type=Path, nargs="?", metavar="OUT", help="the rig file to write")
    words = "unit of length of IN where its format says none, as opencv and colmap (default: mm)"
    parser.add_argument("--unit", choices=tuple(_UNITS), help=words)
    parser.add_argument("--size", metavar="WxH", help="size of the pictures where IN does not say it, as 1280x960")
    add_format(parser)


def run(args: argparse.Namespace) -> int:
    from vision.cameras.files import read_rig, write_rig

    if (args.action == "convert") != (args.out is not None):
        raise UsageError("give convert IN OUT, or show IN")
    size = re.fullmatch(r"([1-9]\d{0,5})x([1-9]\d{0,5})", args.size or "")
    if args.size is not None and size is None:
        raise UsageError(f"--size {args.size} is no size: give width and height in px, as 1280x960")
    rig = read_rig(
        args.source,
        unit_mm=None if args.unit is None else _UNITS[args.unit],
        size=None if size is None else (int(size[1]), int(size[2])),
    )
    if args.action == "convert":
        write_rig(rig, args.out)
        say(f"{args.out} is written")
        return 0
    names = ("camera", "width", "height", "fx", "fy", "cx", "cy", "skew", "distortion", "x_mm", "y_mm", "z_mm")
    rows = []
    for name, camera in rig.cameras.items():
        m, coefficients = camera.matrix, " ".join(f"{c:.6g}" for c in camera.distortion)
        intrinsics = [float(m[at]) for at in ((0, 0), (1, 1), (0, 2), (1, 2), (0, 1))]
        place = rig.rig_from_camera[name][:3, 3].tolist()
        rows.append((name, camera.width, camera.height, *intrinsics, coefficients, *place))
    print_rows(names, rows, args.format)
    return 0
