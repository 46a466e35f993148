"""Print the script by which a shell completes verbs and options.

For bash put `source <(relmodel completion bash)` into ~/.bashrc, the same with zsh into ~/.zshrc; for fish save it as
~/.config/fish/completions/relmodel.fish.
"""

from __future__ import annotations

import argparse

from relmodel.app.cli.completion import SHELLS, completion_script

EXAMPLE = "relmodel completion bash"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("shell", choices=SHELLS, help="which shell")


def run(args: argparse.Namespace) -> int:
    from relmodel.app.cli.main import parser

    print(completion_script(parser(), args.shell), end="")
    return 0
