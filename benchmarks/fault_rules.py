"""Faults that can be planted, by rule: what of a file's text stands otherwise."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np


def label_of(file: str) -> str:
    """The folder of a file, under which its faults are counted."""
    top, *rest = file.split("/")
    return f"{top}/{rest[0]}" if top in ("relmodel", "vision") and not rest[0].endswith(".py") else top


@dataclass(frozen=True)
class Fault:
    """A fault: in which lines of a file, by which rule, and what stands at `start`..`end` of its text instead."""

    file: str
    line: int
    rule: str
    start: int
    end: int
    text: str
    was: str

    @property
    def label(self) -> str:
        return label_of(self.file)

    def __str__(self) -> str:
        return f"{self.file}:{self.line} {self.rule}: {self.was!r} -> {self.text!r}"


_BINARY = {
    ast.Add: ("+", "-"), ast.Sub: ("-", "+"), ast.Mult: ("*", "/"), ast.Div: ("/", "*"), ast.FloorDiv: ("//", "*"),
    ast.Mod: ("%", "//"), ast.Pow: ("**", "*"), ast.BitAnd: ("&", "|"), ast.BitOr: ("|", "&"),
}  # fmt: skip
_COMPARED = {
    ast.Lt: ("<", ">="), ast.LtE: ("<=", ">"), ast.Gt: (">", "<="), ast.GtE: (">=", "<"), ast.Eq: ("==", "!="),
    ast.NotEq: ("!=", "=="), ast.Is: ("is", "is not"), ast.IsNot: ("is not", "is"), ast.In: ("in", "not in"),
    ast.NotIn: ("not in", "in"),
}  # fmt: skip
_OTHERS = [
    ("min", "max"), ("minimum", "maximum"), ("argmin", "argmax"), ("any", "all"), ("floor", "ceil"), ("sin", "cos"),
    ("sum", "max"), ("mean", "max"), ("zeros", "ones"), ("left", "right"), ("flatnonzero", "argsort"),
]  # fmt: skip
_OTHER_NAME = {**dict(_OTHERS), **{b: a for a, b in reversed(_OTHERS)}}


def python_faults(file: str, text: str) -> Iterator[Fault]:
    """All faults of a Python file but in what is only said or only typed."""
    starts = np.cumsum([0] + [len(line.encode()) for line in text.splitlines(keepends=True)])
    raw = text.encode()

    def at(line: int, column: int) -> int:
        return int(starts[line - 1]) + column

    def span(node: ast.AST) -> tuple[int, int]:
        n: Any = node
        return at(n.lineno, n.col_offset), at(n.end_lineno, n.end_col_offset)

    def fault(node: ast.AST, rule: str, start: int, end: int, new: str) -> Fault:
        return Fault(file, node.lineno, rule, start, end, new, raw[start:end].decode())  # type: ignore[attr-defined]

    def between(node: ast.AST, one: ast.AST, other: ast.AST, rule: str, old: str, new: str) -> Iterator[Fault]:
        begin, end = span(one)[1], span(other)[0]
        if (found := raw[begin:end].find(old.encode())) >= 0:
            yield fault(node, rule, begin + found, begin + found + len(old), new)

    def of(node: ast.AST) -> Iterator[Fault]:
        match node:
            case ast.BinOp(left=left, op=op, right=right) if type(op) in _BINARY and not isinstance(
                left, ast.Constant | ast.JoinedStr
            ):
                yield from between(node, left, right, "operator", *_BINARY[type(op)])
                if isinstance(op, ast.Add | ast.Sub | ast.Mult):
                    yield fault(node, "term", *span(node), raw[slice(*span(left))].decode())
            case ast.Compare(left=left, ops=[op], comparators=[right]) if type(op) in _COMPARED:
                yield from between(node, left, right, "comparison", *_COMPARED[type(op)])
            case ast.BoolOp(op=op, values=[one, other, *_]):
                words = ("and", "or") if isinstance(op, ast.And) else ("or", "and")
                yield from between(node, one, other, "condition", *words)
            case ast.UnaryOp(op=ast.USub() | ast.Not() | ast.Invert(), operand=operand):
                yield fault(node, "sign", *span(node), raw[slice(*span(operand))].decode())
            case ast.Constant(value=bool(value)):
                yield fault(node, "flag", *span(node), str(not value))
            case ast.Constant(value=int(value)):
                yield fault(node, "number", *span(node), str(value + 1))
            case ast.Constant(value=float(value)) if np.isfinite(value):
                yield fault(node, "number", *span(node), repr(2 * value if value else 1.0))
            case ast.Attribute(attr=name) | ast.Name(id=name) if name in _OTHER_NAME and called.get(id(node)):
                end = span(node)[1]
                yield fault(node, "function", end - len(name), end, _OTHER_NAME[name])
            case ast.Call(args=[*_, one, other]) if not isinstance(one, ast.Starred) and not isinstance(
                other, ast.Starred
            ):
                first, second = (raw[slice(*span(n))].decode() for n in (one, other))
                middle = raw[span(one)[1] : span(other)[0]].decode()
                if first != second and not (isinstance(one, ast.Constant) and isinstance(one.value, str)):
                    yield fault(node, "arguments", span(one)[0], span(other)[1], second + middle + first)
            case ast.AugAssign():
                yield fault(node, "statement", *span(node), "pass")

    tree = ast.parse(text)
    called = {id(node.func): True for node in ast.walk(tree) if isinstance(node, ast.Call)}

    def walk(node: ast.AST) -> Iterator[Fault]:
        yield from of(node)
        for name, value in ast.iter_fields(node):
            if name in ("annotation", "returns", "decorator_list", "type_params", "bases") or isinstance(
                node, ast.Raise
            ):
                continue
            for child in value if isinstance(value, list) else [value]:
                if isinstance(child, ast.JoinedStr) or not isinstance(child, ast.AST):
                    continue
                yield from walk(child)

    for statement in tree.body:
        is_typing = isinstance(statement, ast.If) and "TYPE_CHECKING" in ast.unparse(statement.test)
        if not is_typing and not isinstance(statement, ast.Import | ast.ImportFrom):
            yield from walk(statement)


_SQL = [
    ("operator", r"(?<=[\w)]) ([+*-]) (?=[\w(])", {"+": "-", "-": "+", "*": "+"}),
    ("comparison", r" (<=|>=|<>|<|>) ", {"<": ">=", ">": "<=", "<=": ">", ">=": "<", "<>": "="}),
    ("condition", r"\b(AND|OR)\b", {"AND": "OR", "OR": "AND"}),
    ("function", r"\b(least|greatest|min|max|floor|ceil|sum|count|sin|cos|bool_and|bool_or)(?=\()", {
        "least": "greatest", "greatest": "least", "min": "max", "max": "min", "floor": "ceil", "ceil": "floor",
        "sum": "max", "count": "sum", "sin": "cos", "cos": "sin", "bool_and": "bool_or", "bool_or": "bool_and",
    }),
    ("column", r"\b\w*(x|y|z|_a|_b|[xyz][01]|m[012][0123])\b(?! AS)", {
        "x": "y", "y": "z", "z": "x", "_a": "_b", "_b": "_a", "x0": "y0", "y0": "z0", "z0": "x0", "x1": "y1",
        "y1": "z1", "z1": "x1", "m01": "m10", "m10": "m01", "m02": "m20", "m20": "m02", "m12": "m21", "m21": "m12",
        "m03": "m13",
    }),
    ("number", r"(?<![\w.'])(\d+\.?\d*)(?![\w.'])", {}),
    ("join", r"( AND [\w.]+ = [\w.]+)(?=\s)", {}),
    ("order", r"\b(ASC|DESC)\b", {"ASC": "DESC", "DESC": "ASC"}),
]  # fmt: skip


def sql_faults(file: str, text: str) -> Iterator[Fault]:
    """All faults of a file of SQL but in its comments and in the names of what it gives."""
    bare = re.sub(r"--[^\n]*|COMMENT ON [^;]*;|'[^']*'", lambda m: " " * len(m[0]), text)
    for rule, pattern, others in _SQL:
        for found in re.finditer(pattern, bare):
            old = found[1]
            new = others.get(old, "" if rule == "join" else str(float(old) * 2 or 1) if rule == "number" else old)
            if new != old:
                yield Fault(file, text.count("\n", 0, found.start(1)) + 1, rule, *found.span(1), new, old)
