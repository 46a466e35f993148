"""Objects: loaded, shown, given attributes, compared and written for other programs."""

from __future__ import annotations

import argparse
import math
from collections import Counter
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from relmodel.app.cli.options import ALL, FORMAT, VARIANT, open_store, option, verb
from relmodel.app.cli.output import complain, print_folded, say
from relmodel.errors import UsageError
from relmodel.printing import print_rows, rounded

if TYPE_CHECKING:
    from relmodel.loading.write import LoadReport


@verb(
    """relmodel load bulkhead.step --object bulkhead --variant A --store cell.duckdb
  relmodel load table.stl --unit mm --store cell.duckdb
  relmodel load A.step B.step C.step --object bulkhead --store cell.duckdb""",
    option("files", nargs="+", type=Path, metavar="FILE", help="STEP (.gz too), OBJ, STL, PLY, GLB, 3MF, URDF"),
    option("--object", metavar="NAME", help="name of the object (default: that of the file)"),
    option("--variant", help="name of the variant, of a single file"),
    option("--unit", help="length unit of files that do not say it: mm, cm, m, inch, ..."),
    option("--allow-partial", action="store_true", help="load the rest of a file of which faces are lost"),
    option("--strict", action="store_true", help="refuse a file with findings, such as edges off faces"),
    option("--occluder", action="store_true", help="keep a mesh as triangles: it is not inspected"),
    option("--time-limit", type=float, default=300.0, metavar="SECONDS", help="for reading a file (default: 300)"),
)
def load(args: argparse.Namespace) -> int:
    """Load CAD files, meshes or robots (URDF) as objects.

    A second load of the same content adds nothing; another variant adds only what differs.  Of several files each
    becomes an object by the name of its file, or with --object a variant of that object by the name of its file.  They
    are read side by side; one that is refused leaves the others loaded, and the exit status is then that of the refusal
    (3).

    An irregularity in a file that loads, such as an edge off its face by more than its tolerance, is a finding: a row
    of load_finding, and a line on stderr.  A file is refused if it cannot be read, has numbers that are not finite,
    exceeds a limit, or lost faces (--allow-partial loads the rest); with --strict also if it has findings."""
    from relmodel.app.cli.progress import shown
    from relmodel.app.session import compile_behind
    from relmodel.errors import InputError
    from relmodel.loading.load import LoadRequest, load_all
    from relmodel.readers.formats import stem_of

    if not args.time_limit > 0:
        raise UsageError(f"--time-limit is {args.time_limit:g}: give seconds, above 0")
    several = len(args.files) > 1
    if several and args.variant is not None:
        raise UsageError("--variant names one file: leave it out, and each file is a variant by its own name")
    requests = []
    for file in args.files:
        stem = stem_of(file)
        variant = args.variant or (stem if several and args.object else "")
        how = (args.unit, args.allow_partial, args.strict, args.time_limit, args.occluder)
        requests.append(LoadRequest(file, args.object or stem, variant, *how))
    twice = {
        (r.name, r.variant) for r in requests if sum((o.name, o.variant) == (r.name, r.variant) for o in requests) > 1
    }
    if twice:
        raise UsageError(
            f"two files would be {' '.join(min(twice)).strip()}: load them one by one, with names of their own"
        )
    refused = None
    with open_store(args) as store, shown(store) as progress:
        compile_behind(say)
        for request, outcome in load_all(store, requests, progress):
            if isinstance(outcome, InputError):
                if not several:
                    raise outcome
                complain(f"relmodel load: {outcome}")
                refused = outcome
                continue
            name = f"{outcome.name} variant {outcome.variant}" if outcome.variant else outcome.name
            say(
                f"{name}, revision {outcome.revision}: {outcome.status} (run {outcome.run}); {outcome.parts} parts "
                f"placed {outcome.occurrences} times, {outcome.faces_loaded} faces; "
                f"new: {outcome.shapes_added} shapes, "
                f"{outcome.surfaces_added} surfaces, {outcome.arcs_added} arcs"
            )
            if outcome.message:
                say(f"{request.path.name}: {outcome.message}")
            if outcome.findings:
                say(_findings(request.path, outcome))
    return refused.exit_status if refused else 0


def _findings(path: Path, report: LoadReport) -> str:
    """One line that says how many findings of each kind a load has, and how to ask for them."""
    kinds = ", ".join(f"{kind} {count}" for kind, count in report.findings)
    count = sum(count for _, count in report.findings)
    ask = f"SELECT * FROM load_finding WHERE run_id = {report.run}"  # noqa: S608 - printed, not run
    return f"{path.name}: loaded with {count} finding{'s'[: count > 1]}: {kinds}; ask: {ask}"


_TREE = (
    *("path", "level", "parts", "number", "material", "mass", "size", "surfaces", "features", "attributes"),
    "findings",
)
# Columns of the table that is not --all, and what of a row they show.
_FOLDED = {
    **{name: name for name in ("path", "parts", "number", "material")},
    **{"kg": "mass", "size_mm": "size", "features": "feature_count", "findings": "findings"},
}


@verb(
    "relmodel show bulkhead --variant A --picture bulkhead.png --view front --store cell.duckdb",
    option("object", metavar="OBJECT", help="name of the object"),
    VARIANT,
    option("--picture", type=Path, metavar="FILE.png", help="write a picture with features coloured by kind"),
    option(
        "--view",
        default="iso",
        metavar="NAME|X,Y,Z",
        help="front, back, top, bottom, left, right or iso (default), or a direction in which to look: --view=-1,0,0.5",
    ),
    ALL,
    FORMAT,
)
def show(args: argparse.Namespace) -> int:
    """Show an object: the tree of what stands in it with masses, sizes, features, attributes and findings; or a
    picture.

    Equal siblings stand in one line of the table (BOLT_F01 x 24), which ends after 100 rows and leaves out attributes.
    --all prints all of the table, --format json or csv a row of each part."""
    from relmodel.app.tree import alike, read_tree, tree_rows
    from relmodel.drawing.draw import hexadecimal
    from relmodel.drawing.solid import write_picture

    with open_store(args, read_only=True) as store, store.read() as connection:
        tree = read_tree(store, connection, args.object, args.variant)
        rows = tree_rows(store, connection, tree)
        if args.picture is not None:
            at = tree.shape_id >= 0
            placed = tree.shape_id[at], tree.pose[at]
            view: str | Sequence[float] = args.view
            with suppress(ValueError):  # else it is a name
                view = [float(number) for number in args.view.split(",")]
            colours = write_picture(store, connection, *placed, args.picture, view)
            legend = ", ".join(f"{kind} {hexadecimal(colour)}" for kind, colour in colours.items())
            say(f"{args.picture} is written; features by colour: {legend or 'none'}")
    if args.format == "table":
        of_kind = sum((Counter(row.get("kinds", {})) for row in rows), Counter[str]())
        kept, counts = alike(tree)
        rows = [_tree_line(rows[0], 1, tree.name)] + [
            _tree_line(rows[1 + i], n, "") for i, n in zip(kept.tolist(), counts.tolist(), strict=True)
        ]
        if not args.all:
            names = [name for name in _FOLDED if any(row.get(_FOLDED[name]) for row in rows)]
            print_folded(names, [[row.get(_FOLDED[name]) for name in names] for row in rows])
            words = ", ".join(f"{kind} {count}" for kind, count in of_kind.most_common())
            say(f"features of all parts: {words or 'none'}")
            return 0
    print_rows(_TREE, [[row.get(name) for name in _TREE] for row in rows], args.format)
    return 0


def _tree_line(row: dict[str, Any], count: int, name: str) -> dict[str, Any]:
    """The row with the last name of its path, indented, how many siblings are equal, and how many features it has."""
    last = name or row["path"].rpartition("/")[2]
    path = "  " * row["depth"] + last + (f" x {count}" if count > 1 else "")
    mass = row.get("mass")
    mass = None if mass is None else float(f"{mass:.6g}")
    return {**row, "path": path, "mass": mass, "feature_count": sum(row.get("kinds", {}).values()) or None}


@verb(
    """relmodel set bulkhead/BODY density 2810 --unit kg/m3 --variant A --store cell.duckdb
  relmodel set bulkhead/BODY finish "anodised, 10 um" --surface 12 --variant A --store cell.duckdb""",
    option("path", metavar="PATH", help="OBJECT, or OBJECT/PATH of a part or object in it"),
    option("name", metavar="NAME", help="name of the attribute"),
    option("value", metavar="VALUE", help="number, true, false or text"),
    option("--unit", help="unit of a number: kg/m3, g/cm3, kg, lb, mm, ..."),
    option("--text", action="store_true", help="take VALUE as a text, whatever it looks like"),
    option("--variant", default="", help="variant of the object, where it has several"),
    option("--surface", type=int, metavar="NO", help="set it on this surface of the part (its surface_no)"),
    option("--arc", type=int, metavar="NO", help="set it on this arc of the part (its arc_no)"),
    option("--world", action="store_true", help="PATH is the name of a world"),
)
def set_(args: argparse.Namespace) -> int:
    """Set an attribute of an object, a part, a surface, an arc or a world: density, finish, or any name.

    PATH is the name of an object, or OBJECT/PATH of what stands in it, as relmodel show lists it.  VALUE is a number,
    true, false, or a text.  Nothing is overwritten: each value is kept with who set it and when (the view
    attribute_log), and the newest counts.

    A number has a decimal point: 2,70 is refused unless --text says that it is a text.  So is a density, or a mass for
    the volume of its part, that no material has."""
    from relmodel.app.attributes import AttributeOwner, set_attribute

    value = args.value if args.text else _value(args.value)
    with open_store(args) as store:
        whose = AttributeOwner(variant=args.variant, surface=args.surface, arc=args.arc, world=args.world)
        done = set_attribute(store, args.path, args.name, value, args.unit, whose, text=args.text)
    said = f"{value:.10g}" if isinstance(value, float) else str(value).lower()
    said = value if isinstance(value, str) else said
    say(f"{args.name} of {done.owner.words} is {said}{f' {args.unit}' if args.unit else ''} (run {done.run_id})")
    return 0


@verb(
    "relmodel tolerances tolerances.csv --variant A --store cell.duckdb",
    option("file", type=Path, metavar="FILE.csv", help="columns path, what, nominal, plus and minus, mm"),
    option("--variant", default="", help="variant of the objects that it names, where they have several"),
)
def tolerances(args: argparse.Namespace) -> int:
    """State the tolerances of sizes that inspections measure, where the CAD file does not: all of FILE or nothing."""
    from relmodel.app.characteristics import record_tolerances

    with open_store(args) as store:
        say(record_tolerances(store, args.file, args.variant))
    return 0


def _value(text: str) -> float | str | bool:
    if text in ("true", "false"):
        return text == "true"
    try:
        return float(text)
    except ValueError:
        return text


@verb(
    """relmodel diff A B --object bulkhead --level feature --store cell.duckdb
  relmodel diff bracket:left bracket:right --format csv --store cell.duckdb""",
    option("before", metavar="A", help="the variant before; with --object its name, else OBJECT:VARIANT"),
    option("after", metavar="B", help="the variant after"),
    option("--object", metavar="NAME", help="name of the object, where both are variants of one"),
    option("--level", choices=("part", "feature", "surface"), help="only this level"),
    option("--reach", type=float, default=100.0, help="how far what is the same may move, mm (default: 100)"),
    ALL,
    FORMAT,
)
def diff(args: argparse.Namespace) -> int:
    """Say what differs between two variants of an object: parts, features and surfaces.

    Each is identical, retrimmed (the same unbounded surfaces with another boundary), moved (by how much), changed,
    added or removed; for parts it also says what else differs (path, number, material, ...).  Surfaces are only counted
    without --level or --all.  The rows stay in the store: SELECT * FROM variant_change."""
    from relmodel.app.cli.progress import shown
    from relmodel.app.report.write import variant_named
    from relmodel.store import sql
    from relmodel.variants.compare import compare

    before, after = (variant_named(text, args.object) for text in (args.before, args.after))
    with open_store(args) as store:
        with shown(store) as progress:
            comparison = compare(store, before, after, reach=args.reach, progress=progress)
        with store.read() as connection:
            found = connection.execute(sql.query("compare/changes"), {"comparison_id": comparison.id})
            names, rows = list(found.keys()), found.all()
    rows = [row for row in rows if args.level in (None, row.level)]
    if args.format == "table" and not args.all:
        few = [_change_line(row) for row in rows if args.level or row.level != "surface"]
        print_folded(("level", "status", "what", "before", "moved_mm", "differs"), few)
    else:
        print_rows(names, [tuple(row) for row in rows], args.format)
    for level in ("part", "feature", "surface"):
        counts = [f"{status} {n}" for (of, status), n in sorted(comparison.counts.items()) if of == level]
        say(f"{level}s: {', '.join(counts) or 'none compared: no part that both have differs in its geometry'}")
    return 0


def _change_line(row: Any) -> tuple[Any, ...]:
    """What a person looks at of a change: the thing, its name before where that is another, and how it differs."""
    what, before = row.after or row.before, row.before
    if row.level != "part":
        what = f"{row.path}/{what}"
    renamed = before if row.after and before != row.after else None
    moved = rounded(row.distance, 3) if row.distance else None
    turned = f"turned by {math.degrees(row.angle):.4g} degrees" if row.angle else None
    return row.level, row.status, what, renamed, moved, ", ".join(filter(None, (row.differs, turned))) or None


@verb(
    """relmodel export bulkhead --variant A -o bulkhead.glb --store cell.duckdb
  relmodel export bulkhead --variant A -o tables --tables csv --store cell.duckdb
  relmodel export --run last -o inspection.json --store cell.duckdb
  relmodel export --parquet parts --store cell.duckdb""",
    option("object", metavar="OBJECT", nargs="?", help="name of the object"),
    VARIANT,
    option("--run", metavar="RUN", dest="number", help="an inspection instead: number of its run, or last"),
    option("-o", "--out", type=Path, metavar="FILE|FOLDER", help="what to write of the object or run"),
    option("--tables", choices=("parquet", "csv"), default="parquet", help="form of the tables in a folder"),
    option("--parquet", type=Path, metavar="FOLDER", help="write worlds and what stands in them into this folder"),
    option("--world", metavar="NAME", help="with --parquet: only this world"),
)
def export(args: argparse.Namespace) -> int:
    """Export an object, the results of an inspection, or the placed parts of the worlds, as files of other programs.

    An object is written as a .glb file in metres, with shared geometry, or else into a folder as the tables
    placed_part, part, feature, surface and arc.  An inspection (--run) is written as .json with all its results, as
    .qif with what was checked and measured (QIF 3, ISO 23952), as .glb with the placed world, rig and cameras, or else
    into a folder of tables.
    --parquet writes the worlds in all revisions, and the contents of each placed object once, for
    queries/parquet/placed_parts.sql and find_in_volumes.sql on DuckDB or Spark.
    Every row has the id of the store and the name of its cell (relmodel init --cell)."""
    from relmodel.app.audit import run_named
    from relmodel.app.cli.progress import shown
    from relmodel.app.export import export_object, export_run, read_results

    given = sum(one is not None for one in (args.object, args.number, args.parquet))
    if given != 1 or (args.parquet is None) != (args.out is not None):
        raise UsageError("give an OBJECT or --run RUN and -o FILE or FOLDER, or --parquet FOLDER for the placed parts")
    if args.world is not None and args.parquet is None:
        raise UsageError("--world says whose placed parts --parquet writes: give it with --parquet only")
    with open_store(args, read_only=True) as store, store.read() as connection, shown() as progress:
        if args.parquet is not None:
            from relmodel.find.parquet import export_parts

            progress(f"{args.parquet}: placed parts", 0, 1)
            parts = export_parts(store, connection, args.parquet, args.world)
            written, what = [args.parquet], f"{parts} placed parts"
        elif args.number is None:
            written = export_object(store, connection, args.object, args.variant, args.out, args.tables, progress)
            what = args.object
        else:
            run_id = run_named(store, connection, args.number)
            results = read_results(store, connection, run_id)
            written = export_run(store, connection, results, args.out, args.tables, progress)
            what = f"run {run_id} of {results['inspection']['began_at'][0].as_py():%Y-%m-%d %H:%M:%S %Z}"
        identity = store.rows(connection, "store/identity")[0]
    for file in written:
        say(f"{file} is written: {what} of the cell {identity.cell} (store {identity.store_id})")
    return 0
