"""`relmodel VERB ...`: finds the verb's module, runs it, and turns errors into one sentence and an exit status.

Each verb is a function of a module of `relmodel.app.cli.verbs`, declared by `relmodel.app.cli.options.verb`: its
docstring says what it does, its first sentence in the list of verbs.  Only the module of the verb that is asked is
imported, and these import nothing heavy before the verb runs, so that help answers at once."""

from __future__ import annotations

import argparse
import logging
import os
import signal
import sys
import threading
import traceback
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from importlib import import_module
from types import FrameType

from relmodel import __version__
from relmodel.app.cli import options, output
from relmodel.app.cli.options import EVERY_VERB, Verb
from relmodel.app.cli.output import drop_output
from relmodel.errors import InputError, RelmodelError, UsageError, missing_library
from relmodel.names import visible

# Verbs by what they are for, in the order in which help lists them, each after the module of relmodel.app.cli.verbs
# that declares it; those of no group have help of their own only.
GROUPS = {
    "to begin with": "stores.init demo.demo",
    "what is modelled": "objects.load objects.show objects.set objects.tolerances objects.diff cell.world cell.find",
    "the cameras": "cell.rig cell.where cell.plan pictures.extract pictures.stereo",
    "what is inspected": "inspect.inspect runs.runs runs.accept runs.reject pages.report pages.serve objects.export",
    "why it came out so": "runs.why runs.replay runs.compare",
    "the store": "stores.schema stores.sql stores.check runs.prune",
    "": "stores.migrate",
}
VERBS = {named.partition(".")[2]: named.partition(".")[0] for group in GROUPS.values() for named in group.split()}
# Options that the help of a verb leaves out, but for --help-all.
RARE = {
    "--ignore-standpoint", "--ignore-blind-camera", "--joint-sigma", "--base-sigma-mm", "--base-sigma-deg", "--audit",
    "--stereo-method", "--search", "--no-keep-images", "--method", "--precision", "--reach", "--time-limit",
    "--allow-partial", "--parquet", "--regions", "--obb", "--tool", "--radius", "--near", "--far",
}  # fmt: skip

UNFORESEEN = 4
INTERRUPTED = 130  # what a shell reports for a process that SIGINT ended
_INTERRUPTED = "interrupted: what was finished before is kept, and the store is otherwise as it was"


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit status: 0 done, 1 refused, ambiguous or failed check, 2 wrong use, 3 bad
    input, 4 an internal error, 5 accepted with something that `inspect --fail-on` names, 130 interrupted."""
    words = list(sys.argv[1:] if arguments is None else arguments)
    if (odd := next((word for word in words if word.encode(errors="ignore").decode() != word), None)) is not None:
        output.complain(f"relmodel {words[0]}: the name {odd} is not in UTF-8, as the store needs it: rename it")
        return UsageError.exit_status
    args = _parse(words)
    # Before a verb imports NumPy: matrices here are small, and each thread of linear algebra takes memory.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    output.quiet = args.quiet
    with _interrupts() as came:
        args.interrupts = came
        try:
            status: int = args.run(args)
            sys.stdout.flush()
            return status
        except (Exception, KeyboardInterrupt) as error:
            if came or isinstance(error, KeyboardInterrupt):
                print(f"relmodel {args.verb}: {_INTERRUPTED}", file=sys.stderr)
                return INTERRUPTED
            return report_error(args, error)


def _parse(words: list[str]) -> argparse.Namespace:
    """The call of these words.  Pictures may stand among the options, of which argparse takes the first only."""
    whole = parser(words[0] if words else "", rare="--help-all" in words)
    args, rest = whole.parse_known_args(words)
    if rest and not (hasattr(args, "pictures") and not any(word.startswith("-") for word in rest)):
        whole.error(f"unrecognized arguments: {' '.join(rest)}")
    if rest:
        args.pictures = [*args.pictures, *rest]
    return args


@contextmanager
def _interrupts() -> Iterator[list[int]]:
    """The interrupts received while the block lasts: interrupted code may raise an error of its own."""
    came: list[int] = []

    def note(number: int, _: FrameType | None) -> None:
        came.append(number)
        logging.disable()  # libraries log what the interrupt broke; a sentence here says it
        raise KeyboardInterrupt

    if threading.current_thread() is not threading.main_thread():  # only the main thread has handlers
        yield came
        return
    before = signal.signal(signal.SIGINT, note)
    try:
        yield came
    finally:
        signal.signal(signal.SIGINT, before)
        logging.disable(logging.NOTSET)


def report_error(args: argparse.Namespace, error: Exception, place: str = "") -> int:
    """Say what went wrong in a sentence, and where; the exit status."""
    if isinstance(error, ImportError | OSError) and (missing := missing_library(error)):
        error = InputError(missing)
    if isinstance(error, RelmodelError):
        output.complain(f"relmodel {args.verb}: {place}{error}")
        return error.exit_status
    if isinstance(error, BrokenPipeError):
        drop_output()  # the reader (head, less) has gone
        return 0
    if args.debug:
        sys.stderr.write(visible("".join(traceback.format_exception(error)), keep="\n"))
    if isinstance(error, OSError) and error.filename is not None:
        output.complain(
            f"relmodel {args.verb}: {place}{error.filename} cannot be read or written ({error.strerror}): name another"
        )
        return InputError.exit_status
    said = visible(": ".join([type(error).__name__, *str(error).strip().splitlines()[:1]]))
    cure = "report it with what is above" if args.debug else "run it again with --debug and report what that prints"
    output.complain(f"relmodel {args.verb}: {place}an internal error ({said}): {cure}")
    return UNFORESEEN


def parser(verb: str = "", rare: bool = False) -> argparse.ArgumentParser:
    """The parser of the whole command line, or of a single verb: building all of them takes longer than most verbs.

    rare: whether help has the options that are rarely needed."""
    top = argparse.ArgumentParser(
        prog="relmodel",
        description="A hierarchical relational model of machined objects, and the pose of cameras from it.",
        epilog="exit status: 0 done, 1 refused, ambiguous or failed check, 2 wrong use, 3 bad input, "
        "4 an internal error (--debug shows where), 5 accepted with something that inspect --fail-on names, "
        "130 interrupted",
    )
    top.add_argument("--version", action="version", version=f"relmodel {__version__}")
    verbs = top.add_subparsers(
        dest="verb", metavar="VERB", required=True, help="one of those below; relmodel VERB --help says more"
    )
    groups = {title: top.add_argument_group(title) for title in filter(None, GROUPS)}
    group_of = {named: groups.get(title) for title, names in GROUPS.items() for named in names.split()}
    for name in [verb] if verb in VERBS else VERBS:
        it = declared(name)
        sentence, *rest = it.words.split("\n\n")
        sentence = sentence.replace("\n", " ")
        one = verbs.add_parser(
            name,
            description="\n\n".join([sentence, *rest]),
            epilog=f"example:\n  {it.example}",
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        for add_to in (*EVERY_VERB, *it.options):
            add_to(one)
        hidden = [] if rare else [action for action in one._actions if not RARE.isdisjoint(action.option_strings)]
        for action in hidden:
            action.help = argparse.SUPPRESS
        one.add_argument("--help-all", action="help", help="the same with all options" if hidden else argparse.SUPPRESS)
        if group := group_of[f"{VERBS[name]}.{name}"]:
            words = sentence[0].lower() + sentence[1:].rstrip(".")
            group._group_actions.append(argparse.Action([], name, metavar=name, help=words))  # listed, and no argument
        one.set_defaults(run=it.run)
    return top


def declared(name: str) -> Verb:
    """The verb of a name."""
    import_module(f"relmodel.app.cli.verbs.{VERBS[name]}")
    return options.VERBS[name]
