"""Set an attribute of an object, a part, a surface, an arc or a world: density, finish, or any name.

PATH is the name of an object, or OBJECT/PATH of what stands in it, as relmodel show lists it.  VALUE is a number, true,
false, or a text.  Nothing is overwritten: each value is kept with who set it and when (the view attribute_log), and the
newest counts.

A number has a decimal point: 2,70 is refused unless --text says that it is a text.  So is a density, or a mass for the
volume of its part, that no material has.
"""

from __future__ import annotations

import argparse

from relmodel.app.cli.options import store_target
from relmodel.app.cli.output import say

EXAMPLE = """relmodel set bulkhead/BODY density 2810 --unit kg/m3 --variant A --store cell.duckdb
  relmodel set bulkhead/BODY finish "anodised, 10 um" --surface 12 --variant A --store cell.duckdb"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("path", metavar="PATH", help="OBJECT, or OBJECT/PATH of a part or object in it")
    parser.add_argument("name", metavar="NAME", help="name of the attribute")
    parser.add_argument("value", metavar="VALUE", help="number, true, false or text")
    parser.add_argument("--unit", help="unit of a number: kg/m3, g/cm3, kg, lb, mm, ...")
    parser.add_argument("--text", action="store_true", help="take VALUE as a text, whatever it looks like")
    parser.add_argument("--variant", default="", help="variant of the object, where it has several")
    parser.add_argument("--surface", type=int, metavar="NO", help="set it on this surface of the part (its surface_no)")
    parser.add_argument("--arc", type=int, metavar="NO", help="set it on this arc of the part (its arc_no)")
    parser.add_argument("--world", action="store_true", help="PATH is the name of a world")


def run(args: argparse.Namespace) -> int:
    from relmodel.app.attributes import Whose, set_attribute
    from relmodel.store import Store

    value = args.value if args.text else _value(args.value)
    with Store.open(store_target(args)) as store:
        whose = Whose(variant=args.variant, surface=args.surface, arc=args.arc, world=args.world)
        done = set_attribute(store, args.path, args.name, value, args.unit, whose, text=args.text)
    said = f"{done.value:.10g}" if isinstance(done.value, float) else str(done.value).lower()
    said = done.value if isinstance(done.value, str) else said
    say(f"{done.name} of {done.owner.words} is {said}{f' {done.unit}' if done.unit else ''} (run {done.run_id})")
    return 0


def _value(text: str) -> float | str | bool:
    if text in ("true", "false"):
        return text == "true"
    try:
        return float(text)
    except ValueError:
        return text
