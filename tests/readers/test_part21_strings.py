"""Strings of STEP files against the examples of ISO 10303-21, and in names, numbers, faces and layers of a file."""

from __future__ import annotations

from pathlib import Path

import pytest

from relmodel.readers.step import part21
from relmodel.readers.step.part21_instances import Instances
from relmodel.readers.step.part21_strings import decoded
from tests.parts.step_parts import loaded, write_product


@pytest.mark.parametrize(
    ("written", "meant"),
    [
        (b"CAT", "CAT"),
        (b"Don''t", "Don't"),
        (b"''", "'"),
        (rb"see \X\A7 4.1", "see § 4.1"),
        (rb"drawn by \S\Drgerlich", "drawn by Ärgerlich"),
        (rb"\PE\\S\*\S\U\S\b", "Њет"),  # a page of Cyrillic
        (rb"\X2\03B103B2\X0\-\X2\00E9\X0\'' ", "αβ-é' "),
        (rb"\X2\D83DDE00\X0\\X4\0001F6000000004D\X0\.", "😀😀M."),
        (rb"C:\\parts\\X2\\new", r"C:\parts\X2\new"),
        ("plainly Ø8 µm".encode(), "plainly Ø8 µm"),
        ("plainly Ø8 µm".encode("latin-1"), "plainly Ø8 µm"),
        (rb"\X2\03B\X0\ \X\G1 \X", r"\X2\03B\X0\ \X\G1 \X"),  # broken
        (b"", ""),
    ],
)
def test_directives(written: bytes, meant: str) -> None:
    assert decoded(written) == meant


def test_names_are_decoded_by_the_kernel_and_in_the_text_alike(tmp_path: Path) -> None:
    from tests.parts.solids import box

    pytest.importorskip("OCP")
    called, number = r"St\X\FCtze \X2\03B103B2\X0\ it''s", r"N\X2\2116\X0\7"
    path = write_product(tmp_path / "named.step", box((0, 0, 0), (30, 20, 10)), "PLATE")
    text = path.read_text().replace("PRODUCT('PLATE','PLATE'", f"PRODUCT('{number}','{called}'")
    path.write_text(text.replace("ADVANCED_FACE(''", r"ADVANCED_FACE('\X2\0394\X0\ seat'", 1))
    (part,) = (model := loaded(path)).parts
    assert (part.name, part.number) == ("Stütze αβ it's", "N№7")
    assert part21.product_numbers(Instances(path.read_bytes())) == {"Stütze αβ it's": "N№7"}
    names = [name for name in model.shapes[part.shape].surfaces["name"] if name]
    assert names == ["Δ seat"]


def test_parameters_are_decoded() -> None:
    text = rb"DATA;#1=DATUM('\X2\2205\X0\8 H7','it''s; #2',#2,.F.,'A');#2=PRODUCT('\S\D','','',());ENDSEC;"
    instances = Instances(text)
    assert instances.parameters(1, "DATUM")[:2] == ["∅8 H7", "it's; #2"]
    assert instances.parameters(2, "PRODUCT")[0] == "Ä"
