"""Options for the joint values of a robot, and how exactly they are known."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from relmodel.errors import UsageError

if TYPE_CHECKING:
    from relmodel.arrays import Floats


def add_joints(parser: argparse.ArgumentParser) -> None:
    """`--on` and `--set`: which object carries the rig, and how its joints stand."""
    parser.add_argument("--on", metavar="OBJECT", help="the object that carries the rig, where several do")
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="JOINT=VALUE",
        help="a joint's value other than the world's: mm, rad, or degrees where the name ends in _deg",
    )


def add_joint_sigmas(parser: argparse.ArgumentParser, text: str) -> None:
    """`--joint-sigma`, with the help `text`."""
    parser.add_argument("--joint-sigma", action="append", default=[], metavar="JOINT=SIGMA", help=text)


def assigned(texts: list[str], option: str) -> dict[str, float]:
    """Numbers by name, of texts NAME=NUMBER.  Raises UsageError that names the option."""
    out = {}
    for text in texts:
        name, _, value = text.rpartition("=")
        try:
            out[name] = float(value)
        except ValueError:
            name = ""
        if not name:
            raise UsageError(f"{option} {text} is not JOINT=VALUE: give a name, an equals sign and a number")
    return out


def base_covariance(sigma_mm: float, sigma_deg: float) -> Floats:
    """Covariance (6, 6) of a base, t mm then r rad, from one standard deviation along and about each axis."""
    import numpy as np

    return np.diag(np.repeat([sigma_mm**2, np.radians(sigma_deg) ** 2], 3))
