"""Scripts by which a shell completes verbs, options and their choices; made from the parser, so that they are never
out of date with it."""

from __future__ import annotations

import argparse
import shlex

SHELLS = ("bash", "zsh", "fish")


def completion_script(parser: argparse.ArgumentParser, shell: str) -> str:
    """The script for a shell of `SHELLS`; files are completed where nothing else fits."""
    verbs = _verbs(parser)
    if shell == "fish":
        return _fish(verbs)
    script = _bash(verbs)
    return f"autoload -U +X bashcompinit && bashcompinit\n{script}" if shell == "zsh" else script


def _verbs(parser: argparse.ArgumentParser) -> dict[str, tuple[str, argparse.ArgumentParser]]:
    """Help and parser of each verb."""
    (subparsers,) = (a for a in parser._actions if isinstance(a, argparse._SubParsersAction))
    said = {action.dest: action.help or "" for action in subparsers._choices_actions}
    return {name: (said[name], verb) for name, verb in subparsers.choices.items()}


def _bash(verbs: dict[str, tuple[str, argparse.ArgumentParser]]) -> str:
    lines = ["_relmodel() {", "  local word=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD-1]} words="]
    lines += ["  if [ $COMP_CWORD -eq 1 ]; then", f"    words={shlex.quote(' '.join(verbs))}", "  else"]
    lines += ['    case "${COMP_WORDS[1]} $before" in']
    for name, (_, verb) in verbs.items():
        for action in verb._actions:
            for option in action.option_strings if action.choices else ():
                lines.append(
                    f"      '{name} {option}') words={shlex.quote(' '.join(map(str, action.choices or ())))};;"
                )
    lines += ["      *) case ${COMP_WORDS[1]} in"]
    for name, (_, verb) in verbs.items():
        words = [option for action in verb._actions for option in action.option_strings if option.startswith("--")]
        words += [str(c) for action in verb._actions if not action.option_strings for c in action.choices or ()]
        lines.append(f"        {name}) words={shlex.quote(' '.join(words))};;")
    lines += ["      esac;;", "    esac", "  fi", '  COMPREPLY=($(compgen -W "$words" -- "$word"))', "}"]
    return "\n".join([*lines, "complete -o default -F _relmodel relmodel", ""])


def _fish(verbs: dict[str, tuple[str, argparse.ArgumentParser]]) -> str:
    lines = []
    for name, (said, verb) in verbs.items():
        lines.append(f"complete -c relmodel -n __fish_use_subcommand -f -a {name} -d {shlex.quote(said)}")
        here = f"complete -c relmodel -n '__fish_seen_subcommand_from {name}'"
        for action in verb._actions:
            words = shlex.quote(" ".join(map(str, action.choices))) if action.choices else ""
            for option in (o for o in action.option_strings if o.startswith("--")):
                takes = "" if action.nargs == 0 else f" -x -a {words}" if words else " -r"
                lines.append(f"{here} -l {option[2:]}{takes} -d {shlex.quote(action.help or '')}")
            if words and not action.option_strings:
                lines.append(f"{here} -f -a {words}")
    return "\n".join([*lines, ""])
