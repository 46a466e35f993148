"""The SQL files: the only place where the project's SQL is spelled."""

from __future__ import annotations

import re
import tomllib
from functools import cache
from hashlib import sha256
from itertools import cycle, product, takewhile

from sqlalchemy import TextClause, text

from relmodel.errors import UsageError
from relmodel.resources import resource_dir

DIALECTS = ("duckdb", "postgresql")


@cache
def schema_scripts(dialect: str) -> tuple[str, ...]:
    """Texts of the files of `schema/` in their order, without those of other dialects."""
    others = {f".{d}" for d in DIALECTS if d != dialect}
    files = sorted(resource_dir("schema").glob("*.sql"))
    return tuple(_for_each(f.read_text()) for f in files if not others.intersection(f.suffixes))


_EACH = re.compile(r"^-- each of ([\w, ]+); ([\w, ]+):\n((?:.+\n)+)", re.MULTILINE)
_ARGUMENT = re.compile(r"^    \('(\w+)', \d+, '(\w+)', '([A-Z ]+)'", re.MULTILINE)
_NAME = re.compile(r"\{(\w+)\}")


def _for_each(script: str) -> str:
    """A script whose paragraphs that begin with levels and volumes are repeated for each pair of these."""
    if _EACH.search(script) is None:
        return script
    folder = resource_dir("schema")
    fill = tomllib.loads((folder / "106_volume_functions.toml").read_text())
    listed = _ARGUMENT.findall((folder / "107_arguments.sql").read_text())

    def repeat(paragraph: re.Match[str]) -> str:
        said = []
        for level, volume in product(paragraph[1].split(", "), paragraph[2].split(", ")):
            own = [(name, kind) for of, name, kind in listed if of == volume and name != "in_world"]
            words = {"level": level, "volume": volume, **fill["level"][level], **fill["volume"][volume]}
            words["arguments"] = ", ".join(name for name, _ in own)
            words["types"] = ", ".join(map(" ".join, own))
            said.append(_NAME.sub(lambda hit, words=words: words[hit[1]], paragraph[3]))
        return "\n".join(said)

    return _EACH.sub(repeat, script)


@cache
def schema_hash(dialect: str) -> str:
    """SHA-256 (hexadecimal) of the schema of this version for a dialect."""
    return sha256("\0".join(schema_scripts(dialect)).encode()).hexdigest()


@cache
def table_script(table: str) -> str:
    """The statement of `schema/` that makes a table or a view."""
    script = "\n".join(schema_scripts(DIALECTS[0]))
    name = re.escape(table)
    made = re.search(
        rf"^CREATE (TABLE {name} \(.*?^\)|VIEW {name} \(.*?^\) AS$.*?);$", script, re.MULTILINE | re.DOTALL
    )
    if made is None:
        raise ValueError(f"schema/ makes no {table!r}")
    return made[0]


_MADE = re.compile(r"^CREATE (TABLE|VIEW) (\w+) \((.*?)^\)(?:;| AS$)", re.MULTILINE | re.DOTALL)
_COLUMN = re.compile(r"(?:^    |(?<=, ))([a-z]\w*)\b")
_LEVEL = re.compile(r"  -- (\w+)(?:, (redundant))?: ")
_REFERENCE = re.compile(r"REFERENCES (\w+) \((\w+(?:, \w+)*)\): ")


def _lines(body: str) -> list[str]:
    """Lines between the parentheses of a statement, each with all of its comment."""
    return re.sub(r"\n +-- ", " ", body).split("\n")


def catalogue(script: str) -> tuple[list[dict[str, str]], list[dict[str, object]]]:
    """Rows of sds_relation and of sds_reference for what a script makes, from the comments on the lines.

    The comment on a relation begins with its level, as `part: ` or `part, redundant: `.  That on a column that refers
    begins with the key, as `REFERENCES loop (surface_id, loop_no): `; of several columns this one is the last, and the
    others have the names of the key.

    Raises ValueError where a comment says it in another way."""
    relations, references = [], list[dict[str, object]]()
    for kind, relation, body in _MADE.findall(script):
        head, *lines = _lines(body)
        said = _LEVEL.match(head)
        if said is None:
            raise ValueError(f"the comment on {relation} in schema/ does not begin with its level")
        standing = "view" if kind == "VIEW" else said[2] or "primary"
        relations.append({"relation": relation, "level": said[1], "standing": standing})
        referring = [line for line in lines if "REFERENCES" in line]
        for number, line in enumerate(referring):
            code, _, words = line.partition("  -- ")
            names, key = _COLUMN.findall(code), _REFERENCE.match(words)
            if key is None or len(names) != 1:
                raise ValueError(f"schema/ says a reference of {relation} in a way that is not known: {line.strip()}")
            parents = key[2].split(", ")
            own = {"relation": relation, "reference_no": number, "parent": key[1], "parent_columns": parents}
            references.append({**own, "column_names": [*parents[:-1], *names]})
    return relations, references


def comment_statements(dialect: str) -> str:
    """COMMENT statements for tables, views and columns, made from the comments on their lines in `schema/`.

    A comment goes on in the lines of comment below it; level and reference at its beginning are left out.  The first
    row of a transform says what the twelve columns are; of columns on one line `x, y and z` is the axis of each.  Of a
    view `current_NAME` columns are what they are of the table NAME."""
    statements, known = [], dict[str, str]()
    for kind, relation, body in _MADE.findall("\n".join(schema_scripts(dialect))):
        head, *lines = _lines(body)
        statements.append(_comment(kind, relation, _LEVEL.sub("", head)))
        for code, _, said in (line.partition("  -- ") for line in lines):
            words = _REFERENCE.sub("", said)
            names = _COLUMN.findall(code)
            if not words:
                inherited = ((name, f"{relation.removeprefix('current_')}.{name}") for name in names)
                statements += [_comment("COLUMN", f"{relation}.{n}", known[of]) for n, of in inherited if of in known]
                continue
            known |= {f"{relation}.{name}": words for name in names}
            if names == ["m00", "m01", "m02", "m03"]:
                for row, column in product(range(3), range(4)):
                    of = f", column {column} of the rotation" if column < 3 else " of the translation, mm"
                    statements.append(_comment("COLUMN", f"{relation}.m{row}{column}", f"{words}: row {row}{of}"))
            else:
                axes = re.search(r"\bx(, y)? and [yz]\b", words) if len(names) > 1 else None
                for name, axis in zip(names, cycle("xyz"), strict=False):
                    own = words if axes is None else words[: axes.start()] + axis + words[axes.end() :]
                    statements.append(_comment("COLUMN", f"{relation}.{name}", own))
    return "\n".join(statements)


def _comment(kind: str, name: str, words: str) -> str:
    quoted = words.replace("'", "''")
    return f"COMMENT ON {kind} {name} IS '{quoted}';"


@cache
def column_types(table: str) -> dict[str, str]:
    """Types of the columns of a table as `schema/` spells them, such as `DECIMAL(9, 2)`, without asking a store."""
    column = r"(?:^    |(?<=, ))([a-z]\w*) ((?:DOUBLE PRECISION|[A-Z]+)(?:\([\d, ]+\))?(?:\[\])?)"
    return dict(re.findall(column, table_script(table), re.MULTILINE))


def revisions() -> list[str]:
    """Revisions of the schema, oldest first: a file of `migrations/versions` begins with its revision and `_`."""
    return sorted(f.name.partition("_")[0] for f in (resource_dir("migrations") / "versions").glob("*.py"))


@cache
def query(name: str) -> TextClause:
    """Named query `queries/NAME.sql`; `name` may hold a folder, as in `check/occurrence_boxes`."""
    path = resource_dir("queries") / f"{name}.sql"
    if not path.is_file():
        raise UsageError(f"there is no query {name!r}: queries/ holds no file {name}.sql")
    return text(path.read_text())


def description(name: str) -> str:
    """What a query is for: the first sentence of its header."""
    lines = (resource_dir("queries") / f"{name}.sql").read_text().splitlines()
    header = " ".join(line.removeprefix("--").strip() for line in takewhile(lambda line: line.startswith("--"), lines))
    return header.partition(". ")[0].rstrip(".") + "."


def query_names(folder: str) -> list[str]:
    """Names of the queries of a folder of `queries/`, sorted."""
    return sorted(f"{folder}/{p.stem}" for p in (resource_dir("queries") / folder).glob("*.sql"))
