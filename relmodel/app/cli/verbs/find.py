"""Find the parts, features, surfaces or arcs that lie in a box, a sphere, a polyhedron or a camera's view.

Without --level: parts and their features.  Where nothing is found the nearest part is named.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from relmodel.app.cli.options import add_all, add_format, store_target
from relmodel.app.cli.output import print_folded, say
from relmodel.errors import InputError, UsageError
from relmodel.names import read_text
from relmodel.printing import print_rows, rounded

if TYPE_CHECKING:
    from relmodel.arrays import Floats
    from relmodel.find.volumes import Volume
    from relmodel.store import Store
    from vision.cameras.cameras import Prior, Rig, SelectionParameters

EXAMPLE = "relmodel find --box 1650 -480 960 1700 -440 990 --level feature --store demo/cell.duckdb"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    volume = parser.add_mutually_exclusive_group(required=True)
    bounds = ("x0", "y0", "z0", "x1", "y1", "z1")
    volume.add_argument("--box", nargs=6, type=float, metavar=bounds, help="a box in the world, mm")
    oriented = ("x", "y", "z", "hx", "hy", "hz", "rx_deg", "ry_deg", "rz_deg")
    words = "a turned box: its centre, half its sizes (mm) and its turn, a rotation vector in degrees"
    volume.add_argument("--obb", nargs=9, type=float, metavar=oriented, help=words)
    volume.add_argument("--sphere", nargs=4, type=float, metavar=("x", "y", "z", "radius"), help="a ball, mm")
    words = "a convex polyhedron: a list half_spaces of [nx, ny, nz, d], inside where n . p <= d"
    volume.add_argument("--polyhedron", type=Path, metavar="FILE.yaml", help=words)
    volume.add_argument(
        "--camera", type=Path, metavar="RIG", help="what the cameras of a rig see (needs --at or --prior)"
    )
    words = "what is nearest to a point, or to a way of straight pieces between points, mm: parts, or what --level says"
    volume.add_argument("--near-to", nargs="+", type=float, metavar="X Y Z", help=words)
    words = "the same to a placed part, of which this is the path in the world"
    volume.add_argument("--near-to-part", metavar="PATH", help=words)
    words = (
        "with --near-to: a tool that goes the way without turning, the convex hull of a list points of [x, y, z], mm"
    )
    parser.add_argument("--tool", type=Path, metavar="FILE.yaml", help=words)
    words = "with --near-to: radius of a ball that stands at the point or goes the way, or all round the tool, mm"
    parser.add_argument("--radius", type=float, default=0.0, help=words)
    parser.add_argument("--count", type=int, help="how many of the nearest (default: 5)")
    parser.add_argument("--wholly", action="store_true", help="only what lies wholly inside the volume")
    parser.add_argument(
        "--at", type=Path, metavar="POSE.yaml", help="where the rig is: a file that says world_from_rig"
    )
    parser.add_argument(
        "--prior", type=Path, metavar="PRIOR.yaml", help="where the rig may be: the view is widened to hold all of it"
    )
    parser.add_argument("--near", type=float, default=10.0, help="least depth of the view, mm (default: 10)")
    parser.add_argument("--far", type=float, default=10_000.0, help="greatest depth of the view, mm (default: 10000)")
    parser.add_argument("--level", choices=("part", "feature", "surface", "arc"), help="what is looked for")
    words = "box: whose box is not wholly outside (default); exact: whose triangles or sampled arcs reach into it"
    parser.add_argument("--precision", choices=("box", "exact"), default="box", help=words)
    parser.add_argument("--world", metavar="NAME", help="the world, where the store has several")
    add_all(parser)
    add_format(parser)


def run(args: argparse.Namespace) -> int:
    from relmodel.find.find import BOX_COLUMNS, find_rows
    from relmodel.store import Store

    _check_options(args)
    if args.near_to or args.near_to_part:
        return _nearest(args)
    rig, prior = _rig_and_prior(args)
    volumes = _views(args, rig, prior) if rig else [_volume(args)]
    asked = {"level": args.level, "world": args.world, "precision": args.precision}
    asked |= {"wholly": args.wholly}
    with Store.open(store_target(args), read_only=True) as store:
        if not (rig and prior):
            found = {row for volume in volumes for row in find_rows(store, volume, **asked)}
        else:
            from vision.cameras.cameras import SelectionParameters, select_in_view

            level = args.level or "part"
            parameters = SelectionParameters(near_mm=args.near, far_mm=args.far)
            selection = select_in_view(store, rig, prior, parameters, level=level, world=args.world)
            say(
                f"the widened view contains {len(selection.shown)} {level}s by their boxes; "
                f"{selection.superfluous} of them are shown by none of {parameters.sampled_poses} sampled poses"
            )
            uncertain = _by_probability(store, args, rig, prior, volumes, parameters)
            _print(("path", "level", "name", "probability"), uncertain, args)
            return 0
        nearest = "" if found else _nothing_there(store, volumes, args)
    names = ("path", "level", "name", *BOX_COLUMNS)
    _print(names, sorted((row.path, row.level, row.name, *row.box) for row in found), args)
    if nearest:
        say(nearest)
    return 0


def _print(names: Sequence[str], rows: Sequence[Sequence[Any]], args: argparse.Namespace) -> None:
    """Rows as they were asked for; in a folded table tenths of mm do, and shares have three decimals."""
    if args.format != "table" or args.all:
        print_rows(names, rows, args.format)
        return
    decimals = [3 if name == "probability" else 1 for name in names]
    print_folded(
        names,
        [[rounded(v, n) if isinstance(v, float) else v for v, n in zip(row, decimals, strict=True)] for row in rows],
    )


def _nothing_there(store: Store, volumes: Sequence[Volume], args: argparse.Namespace) -> str:
    """That nothing was found, and which part is nearest to one of the volumes."""
    import numpy as np

    from relmodel.find.find import nearest_parts

    level = args.level or "part"
    best: tuple[float, str] | None = None
    for volume in volumes:
        radius = 0.0 if volume.ball is None else float(volume.ball[3])
        tool = np.zeros((1, 3)) if volume.ball is not None else _corners(volume) - volume.inner_point
        near = nearest_parts(store, volume.inner_point, radius=radius, tool=tool, world=args.world)
        for away, path in zip(near["distance_mm"].tolist(), near["path"].tolist(), strict=True):
            best = min(best or (away, path), (away, path))
    if best is None:
        return "nothing is there: no world of the store has parts (relmodel world places them)"
    away, path = best
    if away == 0:
        return f"no {level} lies there{' wholly' * args.wholly}, but the part {path} reaches into it"
    return f"nothing is there: the nearest part is {path}, {away:.1f} mm away"


def _corners(volume: Volume) -> Floats:
    """Corners (n, 3) of a volume without curved sides; those of its bounds where it is flat."""
    import numpy as np
    from scipy.spatial import HalfspaceIntersection, QhullError

    planes = volume.half_spaces
    try:
        return HalfspaceIntersection(planes * [1, 1, 1, -1], volume.inner_point).intersections
    except QhullError:
        low, high = volume.bounds[:3], volume.bounds[3:]
        return np.array([np.where(bits, high, low) for bits in np.ndindex(2, 2, 2)])


def _by_probability(
    store: Store,
    args: argparse.Namespace,
    rig: Rig,
    prior: Prior,
    volumes: list[Volume],
    parameters: SelectionParameters,
) -> list[tuple[str, str, str, float]]:
    """What lies in the widened views, the most probable first, with how probable it is that a camera sees it."""
    import numpy as np

    from relmodel.find.find import in_volumes
    from vision.cameras.cameras import probabilities_in_view

    rows: list[tuple[str, str, str, float]] = []
    for level in (args.level,) if args.level else ("part", "feature"):
        asked = {"world": args.world, "precision": args.precision, "wholly": args.wholly}
        found = in_volumes(store, volumes, level=level, **asked)
        key = np.stack([found["occurrence_id"], found["element_no"]]).astype(np.int64)
        once = np.unique(key, axis=1, return_index=True)[1]
        found = {name: values[once] for name, values in found.items()}
        share = probabilities_in_view(rig, prior, found, parameters).tolist()
        names = zip(found["path"].astype(str), found["name"].astype(str), share, strict=True)
        rows += [(path, level, name, probability) for path, name, probability in names]
    return sorted(rows, key=lambda row: (-row[3], *row[:3]))


def _nearest(args: argparse.Namespace) -> int:
    from relmodel.find.find import nearest_parts
    from relmodel.store import Store

    if len(args.near_to or ()) % 3:
        raise UsageError(f"--near-to has {len(args.near_to)} numbers: give x y z of a point, or of each of a way")
    tool = _rows(args.tool, "tool", "points", "x, y, z") if args.tool else [[0.0, 0.0, 0.0]]
    count = 5 if args.count is None else args.count
    given = {"level": args.level or "part", "radius": args.radius, "tool": tool, "world": args.world}
    with Store.open(store_target(args), read_only=True) as store:
        found = nearest_parts(store, args.near_to or args.near_to_part, count, **given)
    rows = [
        (str(path), str(name), float(away))
        for path, name, away in zip(found["path"], found["name"], found["distance_mm"], strict=True)
    ]
    _print(("path", "name", "distance_mm"), rows, args)
    return 0


def _check_options(args: argparse.Namespace) -> None:
    """Raise UsageError for an option that would change nothing beside the others."""
    nearest = bool(args.near_to or args.near_to_part)
    if not args.near_to and (args.tool or args.radius):
        raise UsageError("--tool and --radius go a way: give them with --near-to")
    if not nearest and args.count is not None:
        raise UsageError("--count says how many of the nearest: give it with --near-to or --near-to-part")
    if nearest and args.wholly:
        raise UsageError("--wholly is asked of a volume, and nearest has none: leave it out")


def _rig_and_prior(args: argparse.Namespace) -> tuple[Rig | None, Prior | None]:
    if not args.camera:
        if args.at or args.prior:
            raise UsageError("--at and --prior say where a camera is: give them with --camera only")
        return None, None
    if (args.at is None) == (args.prior is None):
        raise UsageError("--camera needs --at POSE.yaml, which says where the rig is, or --prior PRIOR.yaml")
    from vision.cameras.files import read_prior, read_rig

    return read_rig(args.camera), read_prior(args.prior) if args.prior else None


def _views(args: argparse.Namespace, rig: Rig, prior: Prior | None) -> list[Volume]:
    """The view of each camera of the rig."""
    from vision.cameras.cameras import SelectionParameters, build_view_volume, widen_view_volume
    from vision.cameras.files import read_pose

    p = SelectionParameters(near_mm=args.near, far_mm=args.far)
    cameras = [(camera, rig.rig_from_camera[name]) for name, camera in rig.cameras.items()]
    if prior:
        return [widen_view_volume(camera, pose, prior, p) for camera, pose in cameras]
    world_from_rig = read_pose(args.at)
    return [build_view_volume(camera, world_from_rig @ pose, p) for camera, pose in cameras]


def _volume(args: argparse.Namespace) -> Volume:
    import numpy as np

    from relmodel.find.volumes import Box, OrientedBox, Polyhedron, Sphere
    from relmodel.geometry.transforms import rotation_matrix

    if args.box:
        return Box(*args.box)
    if args.sphere:
        return Sphere(*args.sphere)
    if args.obb:
        if not np.isfinite(args.obb).all():
            raise InputError(f"the box {args.obb} is not finite: give centre, half sizes (mm) and turn (degrees)")
        world_from_box = np.eye(4)
        world_from_box[:3, :3] = rotation_matrix(np.radians(args.obb[6:]))
        world_from_box[:3, 3] = args.obb[:3]
        return OrientedBox(world_from_box, np.array(args.obb[3:6]))
    return Polyhedron(_rows(args.polyhedron, "polyhedron", "half_spaces", "nx, ny, nz, d"))


def _rows(path: Path, what: str, key: str, row: str) -> list[list[float]]:
    """The rows of numbers, all as long as `row` says, that the file of a polyhedron or tool lists under a key."""
    import yaml

    try:
        rows = [[float(number) for number in numbers] for numbers in yaml.safe_load(read_text(path, what))[key]]
        if {len(numbers) for numbers in rows} == {row.count(",") + 1}:
            return rows
    except (yaml.YAMLError, KeyError, TypeError, ValueError) as error:
        raise InputError(f"{path} lists no {key.replace('_', '-')}: give {key}: [[{row}], ...]") from error
    raise InputError(f"{path} lists no {key.replace('_', '-')}, or of another length: give {key}: [[{row}], ...]")
