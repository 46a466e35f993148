"""Inspections of pictures."""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from relmodel.app.cli.options import (
    CARRIER,
    FILES,
    FORMAT,
    JOINTS,
    NO_KEEP_IMAGES,
    SEARCH,
    WORLD,
    ListLine,
    assigned,
    base_covariance,
    joint_sigmas,
    open_store,
    option,
    pictures,
    pictures_by_camera,
    read_pairs,
    verb,
    worst,
)
from relmodel.app.cli.output import clear_line, say
from relmodel.errors import UsageError
from relmodel.names import visible
from relmodel.printing import WIDTH, json_text, print_rows
from relmodel.progress import Progress

if TYPE_CHECKING:
    from vision.inspection import Inspection

DIFFERS = 5
LIST_COLUMNS = ("pair", "name", "verdict", "run", "outcome", "reason", "exit_status")


@verb(
    "relmodel inspect --rig rig.yaml left=L.png right=R.png --prior prior.yaml --store cell.duckdb",
    option("--rig", type=Path, metavar="RIG", help="cameras and where the rig has them (formats: see relmodel rig)"),
    pictures("the pictures, each with the name of its camera, which may be left out where the rig has one"),
    option("--list", type=Path, metavar="LIST.csv", help="inspect the pictures of each line, one after the other"),
    option("--standpoints", type=Path, metavar="SCAN.csv", help="inspect all pictures of these places together"),
    option("--ignore-standpoint", action="append", default=[], metavar="NAME", help="leave this standpoint out"),
    option(
        "--prior",
        type=Path,
        metavar="PRIOR.yaml",
        help="where the rig is thought to be, and how surely (default: where the joints put a rig that the world "
        "mounts; else nothing is assumed)",
    ),
    option("--believe-pictures", action="store_true", help="accept a sure pose that contradicts the prior"),
    option("--ignore-blind-camera", action="store_true", help="answer by the others where one sees nothing"),
    option(
        "--needs",
        metavar="MM,DEG",
        help="how exactly the pose is needed, two standard deviations, as in 5mm,2deg (default: what the prior file "
        "says, else 3mm,0.5deg)",
    ),
    WORLD,
    option(
        "--serial",
        metavar="SN",
        help="serial number of the part, by which its inspections add up (relmodel report); pictures of it that only "
        "the rig moved between are better together: --standpoints",
    ),
    option("--operator", metavar="NAME", help="who inspects (default: the user of this machine)"),
    option(
        "--against",
        nargs="?",
        const="",
        metavar="OBJECTS",
        help="say which of these loaded objects the pictures show, and where: names separated by commas (without any: "
        "all); no world is needed",
    ),
    CARRIER,
    JOINTS,
    joint_sigmas("correct this joint too; --base-sigma-mm and --base-sigma-deg then say how well the base is known"),
    option(
        "--base-sigma-mm",
        type=float,
        default=5.0,
        metavar="MM",
        help="how well the place of the base of the rig's arm is known, one sigma an axis: used without --prior and "
        "with --joint-sigma (default: 5)",
    ),
    option("--base-sigma-deg", type=float, default=0.5, metavar="DEG", help="the same for its rotation (default: 0.5)"),
    option("--stereo-method", default="pong", metavar="METHOD", help="pong or relational (default: pong)"),
    SEARCH,
    option(
        "--variants",
        action=argparse.BooleanOptionalAction,
        help="weigh every loaded variant of the inspected objects at the pose found, or none (default: where something "
        "is not as the model says, and they are few)",
    ),
    option(
        "--fail-on",
        metavar="WORDS",
        help="end an accepted pose with exit status 5 where parts or features are changed, contradicted or unchecked "
        "(not confirmed or undecidable), or the pictures show another variant: a list such as changed,contradicted,"
        "variant,unchecked",
    ),
    option("--overlay", type=Path, metavar="PICTURE", help="write the images with the model drawn over them"),
    option("--crops", type=Path, metavar="FOLDER", help="write pictures of the findings here, the worst first"),
    NO_KEEP_IMAGES,
    option(
        "--match",
        action="store_true",
        help="also match arcs and regions of the pictures to the model's by their relations: this tells which is which "
        "(relmodel why --arc), and decides nothing",
    ),
    option(
        "--audit",
        choices=("full", "minimal"),
        default="full",
        help="what is recorded: all that explains the decisions, or for sequences only the decisions (default: full)",
    ),
    FORMAT,
)
def inspect(args: argparse.Namespace) -> int:
    """Inspect pictures of the cameras of a rig: say which parts are in view and where the cameras are.

    One to sixteen pictures that were taken together, each with the name of its camera in the rig.  Without --prior a
    rig that no arm carries is located by the circles that its pictures show, wherever they were taken.  With --against
    no world is needed: the pictures are compared with each of the loaded objects that it names.

    With --standpoints the pictures that the rig took of one unmoving object from several places are one inspection:
    each place is correct within the sigma that the file states, and --prior is of the first of them.

    With --list the sets of pictures that a CSV file names, a line each, are inspected one after the other, which saves
    starting anew for each.  The first line names the columns: prior, rig, overlay, crops and serial, where needed, and
    the cameras of which there are pictures; paths are relative to the file.  Each line gives one of the answer, and one
    that fails does not stop the others.

    Where the world mounts the rig on an arm, an accepted pose also says how far the arm's base stands from where the
    world has it.  The joints are taken as they are said to stand, unless --joint-sigma lets them be corrected.

    The exit status is 0 where the pose is accepted, 5 where it is accepted and something is there that --fail-on names,
    and 1 where it is ambiguous or refused.  For a list it is the worst of its lines: first 4 (an internal error), then
    2 (wrong use), 3 (bad input), 1 and 5."""
    from dataclasses import replace

    from relmodel.app.cli.progress import shown
    from relmodel.compiled import compile_ahead
    from relmodel.world.kinematics import Carrier
    from vision.cameras.files import parse_needs
    from vision.inspection import KERNELS, Task, inspect
    from vision.inspection.inspection import parse_not_as_modelled
    from vision.inspection.inspection_parameters import DEFAULTS, choose_methods
    from vision.scene import Scenes

    listed = _listed(args)
    fail_on = [] if args.fail_on is None else parse_not_as_modelled(args.fail_on, "--fail-on")
    needs = None if args.needs is None else parse_needs(args.needs, "--needs")
    if not (args.base_sigma_mm > 0 and args.base_sigma_deg > 0):
        raise UsageError("--base-sigma-mm and --base-sigma-deg must be above zero: a base is never certain")
    sigmas = assigned(args.joint_sigma, "--joint-sigma")
    base = base_covariance(args.base_sigma_mm, args.base_sigma_deg) if sigmas else None
    stands = (args.base_sigma_mm, math.radians(args.base_sigma_deg))
    carrier = Carrier(args.on, assigned(args.set, "--set"), sigmas, base, stands)
    objects = [name.strip() for name in (args.against or "").split(",") if name.strip()]
    parameters = replace(
        choose_methods(DEFAULTS, stereo=args.stereo_method, search=args.search),
        believe_pictures=args.believe_pictures,
        ignore_blind_camera=args.ignore_blind_camera,
    )
    compile_ahead(KERNELS, say)
    with open_store(args) as store, shown(store) as progress:
        scenes = Scenes(store)

        def inspect_one(one: ListLine) -> Inspection:
            task = Task(
                pictures=None if args.standpoints else one.pictures,
                standpoints=args.standpoints,
                ignored=args.ignore_standpoint,
                **one.paths,
                needs=needs,
                serial=one.serial,
                operator=args.operator,
                world=args.world,
                against=None if args.against is None else objects,
                carrier=carrier,
                keep_images=not args.no_keep_images,
                full_audit=args.audit == "full",
                match=args.match,
                variants=args.variants,
            )
            return inspect(store, task, parameters, scenes)

        if args.list is not None:
            return _run_list(args, listed, inspect_one, fail_on, progress)
        progress(f"{listed[0].name}: inspecting", 0, 1)
        answer = inspect_one(listed[0])
    if store.access.passed is not None:
        say(f"{store.access.passed} had the store open meanwhile: it sees run {answer.run} when it opens it again")
    print_answer(answer, args.format)
    return _status(answer, fail_on)


def _listed(args: argparse.Namespace) -> list[ListLine]:
    """What the call names: the lines of the list, or the pictures.  Raises UsageError where it is neither."""
    if args.against is not None and "=" in args.against:  # --against NAME=PATH: a picture, and no object's name
        args.pictures, args.against = [args.against, *args.pictures], ""
    given = {name: getattr(args, name) for name in FILES}
    if args.standpoints is not None:
        if args.list is not None or args.pictures or args.rig is None:
            raise UsageError("--standpoints names all pictures, and needs --rig: leave other pictures and --list out")
        return [ListLine({}, given, args.standpoints.name, args.serial, "")]
    if args.list is not None:
        alone = [f"--{name}" for name in FILES if name not in ("rig", "prior") and given[name] is not None]
        alone += ["pictures"] if args.pictures else []
        if alone:
            raise UsageError(f"{' and '.join(alone)} cannot be combined with --list: name them in columns of the list")
        return read_pairs(args.list, args.serial, rig=args.rig, prior=args.prior)
    missing = [name for name, value in (("--rig", args.rig), ("a picture", args.pictures)) if not value]
    if missing:
        raise UsageError(f"{' and '.join(missing)} must be given, as in left=L.png, or a list of pictures with --list")
    pictures = pictures_by_camera(args.pictures)
    return [ListLine(pictures, given, next(iter(pictures.values())).name, args.serial, "")]


def _run_list(
    args: argparse.Namespace,
    listed: Sequence[ListLine],
    inspect_one: Callable[[ListLine], Inspection],
    fail_on: Sequence[str],
    progress: Progress,
) -> int:
    """Inspect what lines name and print a line of each as soon as it is known; the worst exit status."""
    from relmodel.app.cli.main import report_error

    statuses = []

    def answers() -> Iterator[tuple[int, ListLine, Inspection | None, str]]:
        for number, one in enumerate(listed, 1):
            progress(f"{one.name}: inspecting", number - 1, len(listed))
            answer, error = None, ""
            try:
                answer = inspect_one(one)
                statuses.append(_status(answer, fail_on))
            except Exception as raised:
                if args.interrupts:  # which may raise other errors than its own
                    raise
                statuses.append(report_error(args, raised, f"{one.place}: "))
                error = str(raised)
            clear_line()
            yield number, one, answer, error
            sys.stdout.flush()

    def rows() -> Iterator[tuple[Any, ...]]:
        """Those of LIST_COLUMNS."""
        for number, one, it, error in answers():
            found = (it.verdict, it.run, it.outcome.words, it.reason) if it else ("failed", None, None, error)
            yield number, one.name, *found, statuses[-1]

    if args.format == "csv":
        print_rows(LIST_COLUMNS, rows(), "csv")
    elif args.format == "table":
        for number, name, verdict, run, outcome, reason, _ in rows():
            words = f"run {run}, {outcome}: {reason}" if run else reason
            print(visible(f"{number}/{len(listed)}  {name}  {verdict}  {words}"))
    else:
        for number, one, answer, error in answers():
            pictures = {name: str(path) for name, path in one.pictures.items()}
            line = {"pair": number, "of": len(listed), "serial": one.serial, "pictures": pictures}
            line |= {"exit_status": statuses[-1], "error": error or None}
            print(json_text(line | {"answer": answer and answer.to_json()}))
    return worst(statuses)


def _status(answer: Inspection, fail_on: Sequence[str]) -> int:
    if not answer.outcome.is_usable:
        return 1
    return DIFFERS if any(answer.outcome.has(what) for what in fail_on) else 0


def print_answer(answer: Inspection, form: str) -> None:
    """The whole answer as JSON, or the parts in view as a table or CSV, then pose and verdict in words."""
    from vision.presence.report import summarise

    if form == "json":
        print(json_text(answer.to_json()))
        return
    names = ["path", "level", "visible_share"]
    rows: list[list[Any]] = [[part[name] for name in names] for part in answer.parts_in_view]
    if answer.presence is not None:
        names += ["state", "reason"]
        states = {item["path"]: item for item in answer.presence["items"]}
        said = [states.get(row[0], {}) for row in rows]  # nothing of parts that are no reference
        rows = [[*row, item.get("state"), item.get("reason")] for row, item in zip(rows, said, strict=True)]
    print_rows(names, rows, form, width=WIDTH)
    sys.stdout.flush()  # where both go to one file, what follows stands last
    for words in answer.notes:
        say(words)
    unseen = answer.selection["superfluous"]
    beyond = f"; {unseen} of them are shown by no pose sampled about the prior" if unseen else ""
    say(f"{answer.selection['parts']} parts of the world were looked for{beyond}")
    if answer.world_from_rig is not None:
        if not answer.outcome.is_usable:
            say(f"the best hypothesis, not accepted (probability {answer.posterior:.1%}):")
        for row in answer.world_from_rig[:3]:
            say("  ".join(f"{value:14.6f}" for value in row))
        mm, degrees = (2 * sigma for sigma in answer.sigma.values())
        say(f"known to {mm:.2g} mm and {degrees:.2g} degrees (two sigma); worst: {answer.weakest}")
    for it in answer.base_corrections:
        for words in _correction_words(it):
            say(words)
    for words in () if answer.presence is None else (*summarise(answer.presence), *answer.outcome.variants):
        say(words)
    if answer.outcome.shown is not None:
        say(answer.outcome.shown)
    say(f"the pose is {answer.verdict}: {answer.reason}")
    for words in answer.outcome.refusal:
        say(words)
    say(f"run {answer.run}: {answer.outcome.words}")


def _correction_words(it: dict[str, Any]) -> list[str]:
    """A line of the base and one of each corrected joint: mm, degrees, two sigma along the worst axis."""
    import numpy as np

    x, y, z = it["shift_mm"]
    mm, radians = (
        2 * np.sqrt(np.linalg.eigvalsh(block)[-1]) for block in (it["covariance"][:3, :3], it["covariance"][3:, 3:])
    )
    lines = [
        f"the base of {it['carrier']} stands {math.hypot(x, y, z):.2f} mm ({x:+.2f} {y:+.2f} {z:+.2f} along the "
        f"world's axes) and {math.degrees(math.hypot(*it['turn_rad'])):.3f} degrees from where the world has it: known "
        f"to {mm:.2g} mm and {np.degrees(radians):.2g} degrees (two sigma)"
    ]
    for name, sigma in it["joint_sigmas"].items():
        unit, factor = ("mm", 1.0) if it["joint_units"][name] == "mm" else ("degrees", math.degrees(1))
        found, stated = (factor * it[of][name] for of in ("joints", "stated_joints"))
        words = f"joint {name} at {found:.6g} {unit}, not {stated:.6g}"
        lines.append(f"{words}: known to {2 * factor * sigma:.2g} {unit} (two sigma)")
    return lines
