"""Runs: listed, explained, made again, compared and pruned, and their findings decided."""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from itertools import groupby
from typing import TYPE_CHECKING, Any

from relmodel.app.cli.options import ALL, FORMAT, RUN, one_of, open_store, option, verb
from relmodel.app.cli.output import print_folded, say
from relmodel.names import visible
from relmodel.printing import WIDTH, print_rows

if TYPE_CHECKING:
    from relmodel.app.audit import Difference

STATES = ("running", "finished", "failed", "killed")
VERDICTS = ("accepted", "ambiguous", "refused")
PARTS = ("as modelled", "deviates", "another variant", "not enough seen")
ANY_RUN = 2**62  # above any run's number


@verb(
    "relmodel runs --store cell.duckdb --kind inspect",
    option("--kind", help="only runs of this kind: inspect, load, ..."),
    option("--state", choices=STATES, help="only runs in this state"),
    option("--verdict", choices=VERDICTS, help="only inspections of this verdict"),
    option("--part", choices=PARTS, help="only inspections with this verdict of the part"),
    option("--text", help="only runs with this in serial number, outcome or message"),
    ALL,
    FORMAT,
)
def runs(args: argparse.Namespace) -> int:
    """List the runs of the store: what was run, how it ended, how long it took."""
    from relmodel.app.audit import RUN_IN_SHORT, run_in_short
    from relmodel.store import sql

    with open_store(args, read_only=True) as store, store.read() as connection:
        asked = {name: getattr(args, name) for name in ("kind", "state", "verdict", "part", "text")}
        asked |= {"low": 0, "high": ANY_RUN}
        found = connection.execute(sql.query("run/runs"), asked)
        rows = found.all()
    if args.format == "table" and not args.all:
        print_folded(RUN_IN_SHORT, [run_in_short(r) for r in rows])
    else:
        print_rows(list(found.keys()), rows, args.format)
    return 0


@verb(
    """relmodel why 7 --verdict --store cell.duckdb
  relmodel why 7 --arc left:17 --store cell.duckdb
  relmodel why 7 --feature bulkhead/BODY --store cell.duckdb""",
    RUN,
    one_of(
        option("--verdict", action="store_true", help="why the pose is accepted, ambiguous or refused"),
        option("--pose", action="store_true", help="what the pose rests on"),
        option("--arc", metavar="CAMERA:NUMBER", help="what became of an image arc"),
        option("--feature", metavar="PATH", help="what is said of a part or feature"),
    ),
    FORMAT,
)
def why(args: argparse.Namespace) -> int:
    """Say why an inspection decided as it did, in sentences that follow from its rows.

    Of its verdict (default), its pose, an image arc (CAMERA:NUMBER), or a part or feature (its path, as parts in view
    are listed).  The views why_arc, why_verdict, why_hypothesis and why_part have the same for SQL."""
    from relmodel.app.audit import Sentence, explain

    with open_store(args, read_only=True) as store:
        said = explain(store, args.number, pose=args.pose, arc=args.arc, feature=args.feature)
    if args.format == "table":
        for one in said:
            print(visible(one.sentence))
    else:
        print_rows(Sentence._fields, said, args.format)
    return 0


@verb("relmodel replay 7 --store cell.duckdb", RUN, FORMAT)
def replay(args: argparse.Namespace) -> int:
    """Make an inspection again from its pictures, rig and prior as the store has them, and compare all its rows.

    They agree to 1e-9 with the code, packages and machine that made the run, else to 1e-6; other versions are named.
    Exit status 1 where something differs.  Nothing is written.  Pictures that were not kept or were pruned cannot be
    inspected again: what is left to do is `relmodel check`."""
    from relmodel.app.audit import inspection_named
    from relmodel.app.cli.progress import shown
    from relmodel.compiled import compile_ahead
    from vision.inspection import KERNELS
    from vision.inspection.replay import RelationComparison, replay

    compile_ahead(KERNELS, say)
    with open_store(args, read_only=True) as store, shown(store):
        with store.read() as connection:
            number = inspection_named(store, connection, args.number)
        found = replay(store, number)
    for words in found.others:
        say(words)
    print_rows(RelationComparison._fields, found.outcomes, args.format)
    return 0 if found.agrees else 1


_SECTION_ROWS = 6  # of a section


@verb(
    "relmodel compare 3 7 --store cell.duckdb",
    option("first", metavar="RUN", help="a run: its number, or last, the newest inspection"),
    option("second", metavar="RUN", help="another"),
    ALL,
    one_of(
        option("--json", dest="format", action="store_const", const="json", default="table", help="print JSON"),
        option("--md", dest="format", action="store_const", const="markdown", help="print a table in Markdown"),
    ),
)
def compare(args: argparse.Namespace) -> int:
    """Say what differs between two runs: inputs, code, parameters, the first step at which they part, verdict, view,
    poses.

    What is the same in both is not printed.  Of poses: how far the second is from the first, in the world's axes and in
    the rig's, with one standard deviation of that; rotations in rad.  The table has the first rows of each section and
    the beginning of long values; --all, --md and --json print everything."""
    from relmodel.app.audit import Difference, compare_runs, run_named

    with open_store(args, read_only=True) as store:
        with store.read() as connection:
            first, second = (run_named(store, connection, name) for name in (args.first, args.second))
        found = compare_runs(store, first, second)
    if found and args.format == "table" and not args.all:
        print_rows(Difference._fields, list(_sections(found)), "table", width=WIDTH)
    elif found or args.format == "json":
        print_rows(Difference._fields, found, args.format)
    say(f"{len(found)} differences between run {first} and run {second}")
    return 0


def _sections(found: Sequence[Difference]) -> Iterator[tuple[Any, ...]]:
    """The first rows of each section, which is named once, and how many more it has."""
    from relmodel.app.audit import beginnings

    for section, group in groupby(found, key=lambda one: one.section):
        rows = list(group)
        for i, row in enumerate(rows[:_SECTION_ROWS]):
            by = _number(row.difference, 4), _number(row.sigma, 2)
            values = [v if isinstance(v, str) else _number(v) for v in beginnings(row.first, row.second)]
            yield None if i else section, row.name, *values, *by
        if len(rows) > _SECTION_ROWS:
            yield None, f"... and {len(rows) - _SECTION_ROWS} more: --all", None, None, None, None


def _number(value: float | None, digits: int = 6) -> str | None:
    return None if value is None else f"{value:.{digits}g}"


@verb(
    """relmodel prune runs --older-than 90 --verdict refused --store cell.duckdb
  relmodel prune pictures --run 7 --yes --store cell.duckdb""",
    option("what", choices=("runs", "pictures"), help="all that inspections found, or pictures only"),
    option("--run", dest="number", metavar="RUN", help="this run: its number, or last, the newest inspection"),
    option("--state", choices=STATES[1:], help="runs in this state"),
    option("--verdict", choices=VERDICTS, help="runs with this verdict"),
    option("--older-than", type=float, metavar="DAYS", help="runs that began longer ago than this"),
    option("--yes", action="store_true", help="remove the rows; without it they are only listed"),
    FORMAT,
)
def prune(args: argparse.Namespace) -> int:
    """Make room: remove what inspections found, or the bytes of their pictures; without --yes only lists what would go.

    Pictures and what was extracted from them go only where no other run has read them.  The runs stay listed, with
    inputs, steps and messages.  A DuckDB file keeps the room for later rows; docs/store.md says how to copy it without.
    """
    from relmodel.app.audit import Pruning, plan_pruning, prune, run_named

    with open_store(args) as store:
        with store.read() as connection:
            one = None if args.number is None else run_named(store, connection, args.number)
        asked = Pruning(args.what, one, args.state, args.verdict, args.older_than)
        if args.yes:
            number, runs, rows = prune(store, asked)
            said = f"{len(runs)} runs were pruned (run {number})"
        else:
            runs, rows = plan_pruning(store, asked)
            said = f"{len(runs)} runs would be pruned: --yes prunes them"
    print_rows(("relation", "rows"), rows.items(), args.format)
    say(f"{said}: {', '.join(map(str, runs))}" if runs else said)
    return 0


_DECISION = (
    option("finding", type=int, metavar="FINDING", help="number of the finding in the run"),
    option("--run", dest="number", metavar="RUN", help="the inspection (default: the newest)"),
    option("--by", required=True, metavar="NAME", help="who decides"),
    option("--note", required=True, metavar="TEXT", help="why"),
)


@verb('relmodel accept 3 --run 12 --by quality --note "within the drawing" --store cell.duckdb', *_DECISION)
def accept(args: argparse.Namespace) -> int:
    """Accept a finding: the part may be used with it.

    FINDING is its number in the report of the run.  Nothing is overwritten: each decision is kept with who decided,
    when and why, and the newest counts (the view finding); the verdict stays as it is."""
    return _decide("accepted", args)


@verb('relmodel reject 3 --run 12 --by quality --note "hole LH12 too small" --store cell.duckdb', *_DECISION)
def reject(args: argparse.Namespace) -> int:
    """Reject a finding: the part must not be used with it.

    It is recorded like relmodel accept, with the opposite decision."""
    return _decide("rejected", args)


def _decide(decision: str, args: argparse.Namespace) -> int:
    from relmodel.app.decide import decide

    with open_store(args) as store:
        say(decide(store, args.number, args.finding, decision, args.by, args.note))
    return 0
