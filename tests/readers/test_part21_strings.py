"""Strings of STEP files against the examples of ISO 10303-21, and in names, numbers, faces and layers of a file."""

from __future__ import annotations

import codecs
import re
from pathlib import Path

import pytest

from relmodel.readers.step.part21 import Instances, decoded, in_utf8
from tests.readers.test_step_properties import write_pair
from tests.reading import read_here


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


def test_parameters_are_decoded() -> None:
    text = rb"DATA;#1=DATUM('\X2\2205\X0\8 H7','it''s; #2',#2,.F.,'A');#2=PRODUCT('\S\D','','',());ENDSEC;"
    instances = Instances(text)
    assert instances.parameters(1, "DATUM")[:2] == ["∅8 H7", "it's; #2"]
    assert instances.parameters(2, "PRODUCT")[0] == "Ä"


WESTERN = ["Größe", "GRÖßE", "ÄÖÜß", "Motorträger", "FIXAÇÃO", "pièce «A»", "25 µm ±0.1°", "Øvre", "it's"]
CHINESE = ["支架零件", "装配体", "轴1", "模", "钣金", "箱体", "螺栓 M6×20", "it's"]


@pytest.mark.parametrize(
    ("encoding", "texts"),
    [
        ("utf-8", WESTERN + CHINESE),
        ("latin-1", WESTERN),
        ("cp1252", [*WESTERN, "Halter – links", "5 €"]),
        ("gbk", CHINESE),
        ("gb18030", [*CHINESE, "㐀架"]),
        *[("latin-1", [text]) for text in WESTERN],
        *[("gbk", [text]) for text in CHINESE if text != "模"],  # alone it is UTF-8 as well
    ],
)
def test_the_encoding_of_a_file_is_told_by_its_texts(encoding: str, texts: list[str]) -> None:
    quoted = "\n".join(f"#{i}=PRODUCT('{text.replace(chr(39), 2 * chr(39))}');" for i, text in enumerate(texts))
    content, unread = in_utf8(f"DATA; /* don't */\n{quoted}\nENDSEC;".encode(encoding))
    instances = Instances(content)
    assert [instances.parameters(i, "PRODUCT") for i in range(len(texts))] == [[text] for text in texts]
    assert unread == []


@pytest.mark.parametrize(
    ("written", "text"),
    [
        ("Кронштейн".encode("cp1251"), r"\xca\xf0\xee\xed\xf8\xf2\xe5\xe9\xed"),
        ("取付板".encode("shift-jis"), r"\x8e\xe6\x95t\x94\xc2"),
        ("Träger".encode() + b"\xe4\xbd", r"Träger\xe4\xbd"),  # cut off within a character
        (rb"a\X2\D83D\X0\b", "a\ufffdb"),  # half a character
    ],
)
def test_what_is_in_no_known_encoding_is_told(written: bytes, text: str) -> None:
    content, unread = in_utf8(b"DATA;#1=PRODUCT('plain','" + written + b"');ENDSEC;")
    assert Instances(content).parameters(1, "PRODUCT") == ["plain", text]
    assert unread == [text]


NAMES = {"pair": ("Motorträger", "装配体"), "block": ("Größe-Träger", "支架零件"), "C2": ("früh", "修订")}
NAMES |= {"revision": ("Änderung", "版本"), "LAYER": ("Hülle", "图层")}


@pytest.mark.parametrize(("encoding", "which"), [("latin-1", 0), ("gbk", 1), ("utf-8", 1)])
def test_every_text_of_a_file_is_decoded_alike(encoding: str, which: int, tmp_path: Path) -> None:
    """Names, layers and properties, of which the kernel hands on the first two."""
    path = write_pair(tmp_path / "pair.step")
    text = path.read_text()
    solid = re.search(r"(#\d+) = MANIFOLD_SOLID_BREP", text)
    assert solid is not None
    at = text.rindex("ENDSEC;")
    text = f"{text[:at]}#9990=PRESENTATION_LAYER_ASSIGNMENT('LAYER','',({solid[1]}));\n{text[at:]}"
    text = text.replace("PRODUCT('block'", "PRODUCT('N-7'")
    for plain, meant in NAMES.items():
        text = text.replace(f"'{plain}'", f"'{meant[which]}'")
    path.write_bytes(codecs.BOM_UTF8 * (encoding == "utf-8") + text.encode(encoding))
    model = read_here(path)
    name = {plain: meant[which] for plain, meant in NAMES.items()}
    root = model.assemblies[model.root]
    assert (root.name, {one.name for one in root.instances}) == (name["pair"], {name["block"]})
    assert [(part.name, part.number) for part in model.parts] == [(name["block"], "N-7")]
    assert (name["revision"], name["C2"], None) in root.attributes
    assert set(model.shapes[0].surfaces["layer"]) == {name["LAYER"]}
    assert model.shapes[0].volume == pytest.approx(6)
    assert model.findings == ()


def test_a_text_in_no_known_encoding_is_a_finding(tmp_path: Path) -> None:
    path = write_pair(tmp_path / "pair.step")
    path.write_bytes(path.read_text().replace("'block'", "'Плита верхняя'").encode("cp1251"))
    (finding,) = read_here(path).findings
    assert finding.kind == "unread_text"
    assert (
        finding.message
        == rf"1 text of the file in no known encoding, such as {decoded('Плита верхняя'.encode('cp1251'))}"
    )


@pytest.mark.parametrize(
    ("usage", "name"),
    [
        ("'1','=>[0:1:1:3]'", "block"),
        ("'NAUO7',' '", "block"),
        ("'7',''", "block"),
        ("'7',$", "block"),
        ("'7','10'", "10"),
        ("'LEFT::1',''", "LEFT::1"),
        ("'7','left'", "left"),
    ],
)
def test_a_component_without_a_name_of_its_own_has_that_of_its_product(usage: str, name: str, tmp_path: Path) -> None:
    path = write_pair(tmp_path / "pair.step")
    text, count = re.subn(r"(NEXT_ASSEMBLY_USAGE_OCCURRENCE\()'\d+','[^']*'", rf"\g<1>{usage}", path.read_text())
    path.write_text(text)
    model = read_here(path)
    assert count == 2
    assert [one.name for one in model.assemblies[model.root].instances] == [name, name]
