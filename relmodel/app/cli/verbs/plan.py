"""Propose the next views of a part: those that would check most of what is left of it.

Poses on a grid about the part are tried: what of the model would be visible from each?  Where the world mounts the rig
on an arm, only poses that the arm reaches count; obstacles in its way are not considered.  Each next view is the one
that checks most of what no view before it checks, until 95 % of what any pose could check is checked.  --out writes
each view as a prior for `relmodel inspect`, and pairs.csv for its --list, which says how to name the pictures.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from relmodel.app.cli.options import add_format, store_target
from relmodel.app.cli.output import say
from relmodel.printing import WIDTH, json_text, print_rows

if TYPE_CHECKING:
    from vision.planning import Plan

EXAMPLE = "relmodel plan --serial SN-0042 --rig rig.yaml --out next --store cell.duckdb"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    what = parser.add_mutually_exclusive_group(required=True)
    what.add_argument("--serial", metavar="SN", help="plan what the inspections of this physical part have not decided")
    what.add_argument("--object", metavar="NAME", help="plan all of this inspected object of the world")
    parser.add_argument("--rig", type=Path, required=True, metavar="RIG", help="the cameras, as for relmodel inspect")
    parser.add_argument("--world", metavar="NAME", help="the world of --object, where the store has several")
    parser.add_argument("--on", metavar="OBJECT", help="the object that carries the rig, where several do")
    parser.add_argument(
        "--distance",
        type=float,
        metavar="MM",
        help="from the cameras to the part's surface (default: where the axes of toed-in cameras meet; else where the "
        "part fills the picture, or nearer, where a pixel shows .6 mm)",
    )
    parser.add_argument(
        "--above",
        metavar="PLANE",
        help="keep the cameras above a plane of the world, as z=0 or none (default: z=0, or where the lowest part of "
        "the world stands if that is lower)",
    )
    parser.add_argument(
        "--views", type=int, metavar="N", help="at most so many (default: as many as check 95 %% of what any could)"
    )
    parser.add_argument("--out", type=Path, metavar="FOLDER", help="write the views as files of priors, and pairs.csv")
    add_format(parser)


def run(args: argparse.Namespace) -> int:
    from relmodel.app.cli.progress import shown
    from relmodel.app.propose import propose_views
    from relmodel.store import Store
    from vision.planning import Wanted

    with Store.open(store_target(args), read_only=True) as store, shown(store) as progress:
        wanted = Wanted(
            serial=args.serial,
            object=args.object,
            world=args.world,
            on=args.on,
            distance=args.distance,
            above=args.above,
            views=args.views,
        )
        plan = propose_views(store, args.rig, wanted, args.out, progress)
    if args.format == "json":
        print(json_text(plan.to_json()))
    else:
        _print(plan, args.format)
    say(_summary(plan))
    return 0


def _print(plan: Plan, form: str) -> None:
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
