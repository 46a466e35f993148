"""What stands where: worlds, rigs, views of rigs, and volumes that are searched."""

from __future__ import annotations

import argparse
import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from relmodel.app.cli.options import (
    ALL,
    CARRIER,
    FORMAT,
    JOINTS,
    WORLD,
    assigned,
    base_covariance,
    joint_sigmas,
    one_of,
    open_store,
    option,
    pictures_by_camera,
    verb,
)
from relmodel.app.cli.output import print_folded, say
from relmodel.errors import InputError, UsageError
from relmodel.names import read_text
from relmodel.printing import WIDTH, json_text, print_rows, rounded

if TYPE_CHECKING:
    from relmodel.arrays import Floats
    from relmodel.find.volumes import Volume
    from relmodel.store import Store
    from relmodel.world.kinematics import MountedRig
    from vision.cameras.cameras import Prior, Rig, SelectionParameters
    from vision.planning import Plan, PlanOptions


@verb("relmodel world cell.yaml --store cell.duckdb", option("file", type=Path, metavar="FILE", help="world (YAML)"))
def world(args: argparse.Namespace) -> int:
    """Place objects in a world, as a world file says."""
    from relmodel.app.cli.progress import shown
    from vision.cameras.record import place_world_with_rigs

    with open_store(args) as store, shown(store) as progress:
        report = place_world_with_rigs(store, args.file, progress)
    say(
        f"{report.world}, revision {report.revision}: {report.status} (run {report.run_id}); "
        f"{report.objects} objects and {report.parts} parts placed"
    )
    return 0


# Millimetres of the units that --unit names.
_UNITS = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "inch": 25.4}


@verb(
    """relmodel rig convert camchain.yaml rig.yaml
  relmodel rig convert stereo.yml rig.yaml --unit m
  relmodel rig show camchain.yaml
  relmodel rig check rig.yaml left=left.png right=right.png --distance 900""",
    option(
        "action", choices=("convert", "show", "check"), help="convert IN to OUT, show what IN holds, or what it can do"
    ),
    option("source", type=Path, metavar="IN", help="a rig in any of the formats"),
    option("pictures", nargs="*", metavar="OUT", help="the rig file to write; with check two pictures, NAME=PICTURE"),
    option("--distance", type=float, metavar="MM", help="with check: to the object (default: where axes meet)"),
    option("--prior", type=Path, metavar="PRIOR", help="with check: what is looked at is what it shows of the world"),
    option("--object", metavar="NAME", help="with check: it is the broad side of an object of the world"),
    WORLD,
    option(
        "--unit",
        choices=tuple(_UNITS),
        help="unit of length of IN where its format says none, as opencv and colmap (default: mm)",
    ),
    option("--size", metavar="WxH", help="size of the pictures where IN does not say it, as 1280x960"),
    FORMAT,
)
def rig(args: argparse.Namespace) -> int:
    """Convert a calibration file to a rig file of relmodel, say what it holds, or what it can do.

    Calibrations: of relmodel, OpenCV, ROS (CameraInfo), Kalibr (camchain) or COLMAP (a folder).  A file is known by
    what it says, not by its name.  What a rig cannot hold is refused by name.  check says how much of their pictures
    two cameras share, how exactly a pose and a diameter will be told, what errors of the file would do, and how well
    two pictures agree with it; it fails where they do not."""
    from vision.cameras.files import read_rig, write_rig

    if args.action == "check":
        return _check_rig(args)
    if len(args.pictures) != (args.action == "convert"):
        raise UsageError("give convert IN OUT, show IN, or check IN [NAME=PICTURE NAME=PICTURE]")
    size = re.fullmatch(r"([1-9]\d{0,5})x([1-9]\d{0,5})", args.size or "")
    if args.size is not None and size is None:
        raise UsageError(f"--size {args.size} is no size: give width and height in px, as 1280x960")
    rig = read_rig(
        args.source,
        unit_mm=None if args.unit is None else _UNITS[args.unit],
        size=None if size is None else (int(size[1]), int(size[2])),
    )
    if args.action == "convert":
        write_rig(rig, Path(args.pictures[0]))
        say(f"{args.pictures[0]} is written")
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


def _check_rig(args: argparse.Namespace) -> int:
    from dataclasses import asdict

    import numpy as np

    from relmodel.find.find import world_named
    from vision.cameras.files import read_prior, read_rig
    from vision.cameras.images import read_rig_with_pictures
    from vision.planning import usual_distance
    from vision.rig_check import check_rig, find_edges_in_view

    if args.unit or args.size:
        raise UsageError("--unit and --size are of convert and show: convert the file, and check what that writes")
    files = pictures_by_camera(args.pictures)
    rig, pictures = read_rig_with_pictures(args.source, files) if files else (read_rig(args.source), {})
    stated: Sequence[Any] = ()
    distance, edges = args.distance, None
    if args.prior is not None or args.object is not None:
        if args.prior is not None and (args.object or distance):
            raise UsageError("--prior says where the rig is: leave out --object and --distance")
        whence = (args.object, distance) if args.prior is None else read_prior(args.prior)
        with open_store(args, read_only=True) as store:
            edges = find_edges_in_view(store, rig, args.world, whence)
            with store.read() as connection:
                key = {"world": world_named(store, connection, args.world)[1], "object": args.object}
                stated = store.rows(connection, "object/diameters", **key)
        distance = float(np.median(np.linalg.norm(edges, axis=1)))
    elif distance is None:
        distance = usual_distance(rig, np.full(3, np.inf))
    if not 0 < distance < np.inf:
        raise UsageError("the distance is not known: give --distance MM above zero, from the cameras to the object")
    found = check_rig(rig, distance, {name: picture.grey for name, picture in pictures.items()}, edges)
    found = found.weigh_diameters(stated)
    print(json_text(asdict(found)) if args.format == "json" else "\n".join(found.sentences()))
    return int(found.doubt is not None)


@verb(
    "relmodel where head --on left_arm --set travel=450 --store cell.duckdb",
    option("rig", metavar="RIG", help="name of the rig in the world file"),
    WORLD,
    CARRIER,
    JOINTS,
    option("--sigma-mm", type=float, default=5.0, help="how surely the rig is there: one sigma an axis (default: 5)"),
    option("--sigma-deg", type=float, default=0.5, help="the same for its rotation (default: 0.5)"),
    option("--found", type=Path, metavar="POSE", help="the pose found: JSON of inspect, or YAML"),
    joint_sigmas("with --found: correct this joint too; --sigma-mm and --sigma-deg say how well the base is known"),
)
def where(args: argparse.Namespace) -> int:
    """Say where a mounted rig is: from the arm's base, its joints and the mount.

    Prints a prior file for `relmodel inspect --prior`.  With --found, the pose of the rig that an inspection found (its
    answer as JSON, or YAML with world_from_rig and covariance or sigma), prints the correction of the arm's base
    instead, with the joints fixed unless their sigmas are given: shift_mm is along the world's axes, turn_rad and
    covariance (mm, then rad) along the base's."""
    import yaml

    from relmodel.world.kinematics import mounted_rig

    if args.joint_sigma and not args.found:
        raise UsageError("--joint-sigma says how joints are corrected: give it with --found")
    if not (args.sigma_mm > 0 and args.sigma_deg > 0):
        raise UsageError("--sigma-mm and --sigma-deg must be above zero: a pose is never certain")
    with open_store(args, read_only=True) as store:
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
    from vision.cameras.files import read_prior

    sigmas = assigned(args.joint_sigma, "--joint-sigma")
    base = base_covariance(args.sigma_mm, args.sigma_deg) if sigmas else None
    it = read_prior(args.found)
    return correct_base(rig, it.world_from_rig, it.covariance, joint_sigmas=sigmas, base_covariance=base).to_json()


@verb(
    "relmodel plan --serial SN-0042 --rig rig.yaml --out next --store cell.duckdb",
    one_of(
        option("--serial", metavar="SN", help="plan what the inspections of this physical part have not decided"),
        option("--object", metavar="NAME", help="plan all of this inspected object of the world"),
        required=True,
    ),
    option("--rig", type=Path, required=True, metavar="RIG", help="the cameras, as for relmodel inspect"),
    option("--world", metavar="NAME", help="the world of --object, where the store has several"),
    CARRIER,
    option(
        "--distance",
        type=float,
        metavar="MM",
        help="from the cameras to the part's surface (default: where the axes of toed-in cameras meet; else where the "
        "part fills the picture, or nearer, where a pixel shows .6 mm)",
    ),
    option(
        "--above",
        metavar="PLANE",
        help="keep the cameras above a plane of the world, as z=0 or none (default: z=0, or where the lowest part of "
        "the world stands if that is lower)",
    ),
    option("--views", type=int, metavar="N", help="at most so many (default: enough for 95 %% of what any could)"),
    option("--out", type=Path, metavar="FOLDER", help="write the views as files of priors, with lists of them"),
    FORMAT,
)
def plan(args: argparse.Namespace) -> int:
    """Propose the next views of a part: those that would check most of what is left of it.

    Poses on a grid about the part are tried: what of the model would be visible from each?  Where the world mounts the
    rig on an arm, only poses that the arm reaches count; obstacles in its way are not considered.  Each next view is
    the one that checks most of what no view before it checks, until 95 % of what any pose could check is checked.
    --out writes each view as a prior for `relmodel inspect`, and two lists that say how to name the pictures: pairs.csv
    for its --list, and standpoints.csv for its --standpoints, where nothing is moved but the rig: put the repeatability
    of what carries it into sigma_mm and sigma_deg there."""
    import numpy as np

    from relmodel.app.cli.progress import shown
    from relmodel.app.propose import propose_views
    from relmodel.arrays import fields_of
    from vision.cameras.files import read_rig
    from vision.rig_check import check_rig

    with open_store(args, read_only=True) as store, shown(store) as progress:
        wanted = cast("PlanOptions", fields_of(args, "serial object world on distance above views"))
        plan = propose_views(store, args.rig, wanted, args.out, progress)
    for view in plan.views[:1]:
        distance = float(np.linalg.norm(view.world_from_rig[:3, 3] - view.target))
        say("; ".join(check_rig(read_rig(args.rig), distance, {}).sentences()))
    if args.format == "json":
        print(json_text(plan.to_json()))
    else:
        _print_plan(plan, args.format)
    say(_summary(plan))
    return 0


def _print_plan(plan: Plan, form: str) -> None:
    """A row a view: where the cameras stand, what they look at, what it would check."""
    rows = []
    for number, view in enumerate(plan.views, 1):
        eye = [round(float(x)) for x in view.world_from_rig[:3, 3]]
        names = [path.partition("/")[2] or path for path in view.paths]
        few = ", ".join(names[:3]) + (f" and {len(names) - 3} more" if len(names) > 3 else "")
        checks = few if form == "table" else "; ".join(view.paths)
        rows.append((number, *eye, *(round(float(x)) for x in view.target), len(names), f"{view.share:.0%}", checks))
    print_rows(("view", "x", "y", "z", "at_x", "at_y", "at_z", "checks", "share", "what"), rows, form, width=WIDTH)


def _summary(plan: Plan) -> str:
    if not plan.left:
        return "all is checked: there is nothing to plan"
    sum_of = sum(len(view.paths) for view in plan.views)
    hidden = f"; no pose tried would check {len(plan.hidden)} (--format json names them)" if plan.hidden else ""
    above = f" above {plan.above}" if plan.above else ""
    beyond = f", {plan.out_of_reach} more are out of the arm's reach" if plan.out_of_reach else ""
    return (
        f"{len(plan.views)} views would check {sum_of} of {plan.left} parts and features that are left{hidden}; "
        f"{plan.tried} poses were tried{above}{beyond}"
    )


@verb(
    "relmodel find --box 1650 -480 960 1700 -440 990 --level feature --store demo/cell.duckdb",
    one_of(
        option("--box", nargs=6, type=float, metavar=("x0", "y0", "z0", "x1", "y1", "z1"), help="box in the world, mm"),
        option(
            "--obb",
            nargs=9,
            type=float,
            metavar=("x", "y", "z", "hx", "hy", "hz", "rx_deg", "ry_deg", "rz_deg"),
            help="a turned box: its centre, half its sizes (mm) and its turn, a rotation vector in degrees",
        ),
        option("--sphere", nargs=4, type=float, metavar=("x", "y", "z", "radius"), help="a ball, mm"),
        option(
            "--polyhedron",
            type=Path,
            metavar="FILE.yaml",
            help="a convex polyhedron: a list half_spaces of [nx, ny, nz, d], inside where n . p <= d",
        ),
        option("--camera", type=Path, metavar="RIG", help="what the cameras of a rig see (needs --at or --prior)"),
        option(
            "--near-to",
            nargs="+",
            type=float,
            metavar="X Y Z",
            help="what is nearest to a point, or to a way of straight pieces between points, mm: parts, or what "
            "--level says",
        ),
        option("--near-to-part", metavar="PATH", help="the same to the placed part of this path in the world"),
        required=True,
    ),
    option("--tool", type=Path, metavar="FILE.yaml", help="with --near-to: a tool, the hull of points [x, y, z], mm"),
    option("--radius", type=float, default=0.0, help="with --near-to: mm about the point or the tool (default: 0)"),
    option("--count", type=int, help="how many of the nearest (default: 5)"),
    option("--wholly", action="store_true", help="only what lies wholly inside the volume"),
    option("--at", type=Path, metavar="POSE.yaml", help="where the rig is: a file that says world_from_rig"),
    option("--prior", type=Path, metavar="PRIOR.yaml", help="where the rig may be: the view is widened to hold it all"),
    option("--near", type=float, default=10.0, help="least depth of the view, mm (default: 10)"),
    option("--far", type=float, default=10_000.0, help="greatest depth of the view, mm (default: 10000)"),
    option("--level", choices=("part", "feature", "surface", "arc"), help="what is looked for"),
    option("--precision", choices=("box", "exact"), default="box", help="exact: by triangles and arcs, not boxes"),
    WORLD,
    ALL,
    FORMAT,
)
def find(args: argparse.Namespace) -> int:
    """Find the parts, features, surfaces or arcs that lie in a box, a sphere, a polyhedron or a camera's view.

    Without --level: parts and their features.  Where nothing is found the nearest part is named."""
    from relmodel.find.find import find_rows
    from relmodel.geometry.curves import BOX

    _check_options(args)
    if args.near_to or args.near_to_part:
        return _nearest(args)
    rig, prior = _rig_and_prior(args)
    volumes = _views(args, rig, prior) if rig else [_volume(args)]
    asked = {"level": args.level, "world": args.world, "precision": args.precision}
    asked |= {"wholly": args.wholly}
    with open_store(args, read_only=True) as store:
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
            _print_found(("path", "level", "name", "probability"), uncertain, args)
            return 0
        nearest = "" if found else _nothing_there(store, volumes, args)
    names = ("path", "level", "name", *BOX)
    _print_found(names, sorted(found), args)
    if nearest:
        say(nearest)
    return 0


def _print_found(names: Sequence[str], rows: Sequence[Sequence[Any]], args: argparse.Namespace) -> None:
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

    if len(args.near_to or ()) % 3:
        raise UsageError(f"--near-to has {len(args.near_to)} numbers: give x y z of a point, or of each of a way")
    tool = _rows(args.tool, "tool", "points", "x, y, z") if args.tool else [[0.0, 0.0, 0.0]]
    count = 5 if args.count is None else args.count
    given = {"level": args.level or "part", "radius": args.radius, "tool": tool, "world": args.world}
    with open_store(args, read_only=True) as store:
        found = nearest_parts(store, args.near_to or args.near_to_part, count, **given)
    rows = [
        (str(path), str(name), float(away))
        for path, name, away in zip(found["path"], found["name"], found["distance_mm"], strict=True)
    ]
    _print_found(("path", "name", "distance_mm"), rows, args)
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
    from relmodel.geometry.transforms import rigid, rotation_matrix

    if args.box:
        return Box(*args.box)
    if args.sphere:
        return Sphere(*args.sphere)
    if args.obb:
        if not np.isfinite(args.obb).all():
            raise InputError(f"the box {args.obb} is not finite: give centre, half sizes (mm) and turn (degrees)")
        world_from_box = rigid(rotation_matrix(np.radians(args.obb[6:])), args.obb[:3])
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
