"""Write the demonstration bulkhead: STEP files (gzipped) and golden tables.

    python -m examples.bulkhead.build [--out FOLDER] [--tables examples/bulkhead/golden] [VARIANT ...]

A and B, which the demonstration needs, go to `examples/demo`, the others to `examples/bulkhead/variants`.
Two builds with the same kernel give the same bytes.  Run from the root of the checkout; needs the extra `step`."""

from __future__ import annotations

import argparse
import gzip
import json
import math
import re
import tempfile
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from OCP.APIHeaderSection import APIHeaderSection_MakeHeader
from OCP.BRep import BRep_Tool
from OCP.BRepAdaptor import BRepAdaptor_Surface
from OCP.BRepGProp import BRepGProp
from OCP.gp import gp_Ax3, gp_Dir, gp_Pnt, gp_Trsf
from OCP.GProp import GProp_GProps
from OCP.IFSelect import IFSelect_RetDone
from OCP.Interface import Interface_Static
from OCP.Message import Message
from OCP.Quantity import Quantity_Color, Quantity_TOC_sRGB
from OCP.STEPCAFControl import STEPCAFControl_Writer
from OCP.TCollection import TCollection_ExtendedString, TCollection_HAsciiString
from OCP.TDataStd import TDataStd_Name
from OCP.TopAbs import TopAbs_EDGE, TopAbs_FACE
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS
from OCP.XCAFDoc import XCAFDoc_ColorSurf, XCAFDoc_DocumentTool

from examples.bulkhead import solids
from examples.bulkhead.design import BASES, CLIP_BOLTS, DENSITY, VARIANTS, Design
from examples.bulkhead.features import CLIP_THICKNESS, all_features, bolts, changes, lug_centre

Shape = Any

ROOT = "BULKHEAD_ASSEMBLY"
COLOURS = {
    "BULKHEAD_BODY": (0.78, 0.80, 0.82),
    "BUSHING_25": (0.72, 0.45, 0.20),
    "BOLT_M8": (0.25, 0.26, 0.28),
    "CLIP": (0.35, 0.60, 0.38),
}
MATERIALS = {  # name, and density in g/cm3
    "BULKHEAD_BODY": ("Aluminium 7075-T7351", DENSITY * 1e6),
    "BUSHING_25": ("Aluminium bronze CuAl10Ni5Fe4", 7.58),
    "BOLT_M8": ("Steel 42CrMo4", 7.85),
    "CLIP": ("Aluminium 2024-T3", 2.78),
}


def placements(design: Design) -> list[tuple[str, str, tuple[float, float, float], float]]:
    """Components of the root: name, product, place of its origin, turn about z in degrees."""
    out = [("BODY", "BULKHEAD_BODY", (0.0, 0.0, 0.0), 0.0)]
    out += [(f"BUSHING_{n}", "BUSHING_25", (*lug_centre(design, n), lug.z[1]), 0.0) for n, lug in design.lugs.items()]
    out += [(n, "BOLT_M8", (*c, z), 0.0) for n, (c, z, _) in bolts(design).items() if n.startswith("BOLT_")]
    for name, clip in design.clips.items():
        out.append((name, "CLIP_ASSEMBLY", (*clip.centre, design.pockets[clip.pocket].web[1]), clip.angle_deg))
    return out


def _location(origin: tuple[float, float, float], turn_deg: float) -> Shape:
    t = math.radians(turn_deg)
    x = gp_Dir(math.cos(t), math.sin(t), 0) if turn_deg else gp_Dir(1, 0, 0)
    move = gp_Trsf()
    move.SetTransformation(gp_Ax3(gp_Pnt(*origin), gp_Dir(0, 0, 1), x), gp_Ax3())
    return TopLoc_Location(move)


def _text(text: str) -> Shape:
    return TCollection_HAsciiString(text)


def write_step(design: Design, shapes: dict[str, Shape], path: Path, missing: frozenset[str] = frozenset()) -> None:
    """Write the assembly, but `missing` parts, as AP242 without pcurves, with names, colours, materials, a header."""
    document = solids.new_document()
    tool = XCAFDoc_DocumentTool.ShapeTool_s(document.Main())
    colours = XCAFDoc_DocumentTool.ColorTool_s(document.Main())
    materials = XCAFDoc_DocumentTool.MaterialTool_s(document.Main())
    tool.SetAutoNaming_s(False)

    def name(label: Shape, text: str) -> None:
        TDataStd_Name.Set_s(label, TCollection_ExtendedString(text))

    labels = {}
    for product, shape in shapes.items():
        labels[product] = tool.AddShape(shape, False)
        name(labels[product], product)
        colours.SetColor(labels[product], Quantity_Color(*COLOURS[product], Quantity_TOC_sRGB), XCAFDoc_ColorSurf)
        material, density = MATERIALS[product]
        words = (material, "", "density measure", "POSITIVE_RATIO_MEASURE")
        texts = [_text(word) for word in words]
        materials.SetMaterial(labels[product], texts[0], texts[1], density, texts[2], texts[3])
    if design.clips:  # what nothing uses would stand beside the root
        labels["CLIP_ASSEMBLY"] = tool.NewShape()
        name(labels["CLIP_ASSEMBLY"], "CLIP_ASSEMBLY")
        name(tool.AddComponent(labels["CLIP_ASSEMBLY"], labels["CLIP"], TopLoc_Location()), "CLIP")
        for i, (u, v) in enumerate(CLIP_BOLTS):
            place = _location((u, v, CLIP_THICKNESS), 0)
            component = tool.AddComponent(labels["CLIP_ASSEMBLY"], labels["BOLT_M8"], place)
            name(component, f"BOLT_{i + 1}")
    root = tool.NewShape()
    name(root, ROOT)
    for component_name, product, origin, turn in placements(design):
        if component_name in missing:
            continue
        name(tool.AddComponent(root, labels[product], _location(origin, turn)), component_name)
    tool.UpdateAssemblies()

    writer = STEPCAFControl_Writer()  # the settings below exist only once a writer does
    for key, value in (("write.step.schema", 5), ("write.surfacecurve.mode", 0)):
        if not Interface_Static.SetIVal_s(key, value):
            raise RuntimeError(f"the kernel refuses the setting {key}")
    if not writer.Transfer(document):
        raise RuntimeError("the kernel could not transfer the assembly")
    header = APIHeaderSection_MakeHeader(writer.ChangeWriter().Model())
    header.SetName(_text(f"bulkhead_{design.name}.step"))
    header.SetTimeStamp(_text("2026-01-01T00:00:00"))
    header.SetAuthorValue(1, _text("relmodel"))
    header.SetOrganizationValue(1, _text("relmodel"))
    header.SetDescriptionValue(1, _text(f"Demonstration bulkhead, variant {design.name}"))
    header.SetOriginatingSystem(_text("relmodel examples"))
    header.SetAuthorisation(_text(""))
    with tempfile.TemporaryDirectory() as folder:
        plain = Path(folder) / "part.step"
        if writer.Write(str(plain)) != IFSelect_RetDone:
            raise RuntimeError(f"the kernel could not write {path}")
        text = plain.read_text()
    if "AP242" not in text[:4000]:
        raise RuntimeError("the file is not AP242")
    path.write_bytes(gzip.compress(_sort_styles(_right_densities(text)).encode(), 9, mtime=0))


def _right_densities(text: str) -> str:
    """State densities in g/cm3: the kernel (8.0) writes g to the power of 3 times cm to the power of 2."""
    for unit, written, meant in (("MASS", "3.", "1."), ("LENGTH", "2.", "-3.")):
        power = rf"(DERIVED_UNIT_ELEMENT\(#\d+,){re.escape(written)}(?=\);\s#\d+ = \( {unit}_UNIT)"
        text = re.sub(power, rf"\g<1>{meant}", text)
    return text


def _sort_styles(text: str) -> str:
    """Put the colours at the file's end into the order of what they colour: the kernel's order hangs on addresses."""
    blocks = re.split(r"(?m)(?=^#\d+ = MECHANICAL_DESIGN_GEOMETRIC_PRESENTATION_REPRESENTATION)", text)
    head, styles = blocks[0], blocks[1:]
    styles[-1], end, tail = styles[-1].partition("ENDSEC;")
    first = int(styles[0][1 : styles[0].index(" ")])
    out = []
    for block in sorted(styles, key=lambda b: [int(n) for n in re.findall(r"STYLED_ITEM\('color',\(#\d+\),#(\d+)", b)]):
        base, size = int(block[1 : block.index(" ")]), len(re.findall(r"(?m)^#", block))
        own = {f"#{base + i}": f"#{first + i}" for i in range(size)}
        out.append(re.sub(r"#\d+", lambda m, own=own: own.get(m.group(), m.group()), block))
        first += size
    return head + "".join(out) + end + tail


def _census(shape: Shape) -> dict[str, Any]:
    faces = solids.explore(shape, TopAbs_FACE)
    kinds = Counter(BRepAdaptor_Surface(TopoDS.Face(f)).GetType().name.removeprefix("GeomAbs_") for f in faces)
    edges = [e for e in solids.explore(shape, TopAbs_EDGE) if not BRep_Tool.Degenerated_s(TopoDS.Edge(e))]
    volume, area = GProp_GProps(), GProp_GProps()
    BRepGProp.VolumeProperties_s(shape, volume)
    BRepGProp.SurfaceProperties_s(shape, area)
    return {
        "faces": len(faces),
        "edges": len(edges),
        "surface_kinds": dict(sorted(kinds.items())),
        "volume_mm3": round(volume.Mass(), 3),
        "area_mm2": round(area.Mass(), 3),
    }


def golden(design: Design, shapes: dict[str, Shape]) -> dict[str, Any]:
    """Counts, masses and features of a variant."""
    parts = {product: _census(shape) for product, shape in shapes.items()}
    components = placements(design)
    uses = Counter(product for _, product, _, _ in components)
    clips = uses.pop("CLIP_ASSEMBLY", 0)
    uses += Counter({"CLIP": clips})
    uses["BOLT_M8"] += clips * len(CLIP_BOLTS)
    mass = parts["BULKHEAD_BODY"]["volume_mm3"] * DENSITY
    return {
        "variant": design.name,
        "root": ROOT,
        "body_mass_kg": round(mass, 3),
        "body_mass_lb": round(mass / 0.45359237, 2),
        "parts": parts,
        "products": sorted([*shapes, *({"CLIP_ASSEMBLY"} if design.clips else ()), ROOT]),
        "solids_of_each_part": dict(sorted(uses.items())),
        "solids": sum(uses.values()),
        "occurrences_below_root": len(components) + clips * (1 + len(CLIP_BOLTS)),
        "components": [
            {"name": n, "product": p, "origin": [round(v, 6) for v in o], "turn_deg": t} for n, p, o, t in components
        ],
        "features": [f.row() for f in all_features(design)],
    }


def build(variant: str, path: Path) -> dict[str, Any]:
    """Write one variant's STEP file and give its golden table."""
    Message.DefaultMessenger_s().ChangePrinters().Clear()
    design = VARIANTS[variant]()
    shapes = {"BULKHEAD_BODY": solids.body(design), "BUSHING_25": solids.bushing(), "BOLT_M8": solids.bolt()}
    if design.clips:
        shapes["CLIP"] = solids.clip()
    write_step(design, shapes, path)
    return golden(design, shapes)


def _dump(data: Any, path: Path) -> None:
    """JSON with one line for each item of the long lists."""
    if isinstance(data, list):
        text = "[\n" + ",\n".join(json.dumps(row) for row in data) + "\n]\n"
    else:
        lines = []
        for key, value in data.items():
            if isinstance(value, list) and value and isinstance(value[0], dict):
                body = "[\n  " + ",\n  ".join(json.dumps(row) for row in value) + "\n ]"
            else:
                body = json.dumps(value)
            lines.append(f" {json.dumps(key)}: {body}")
        text = "{\n" + ",\n".join(lines) + "\n}\n"
    path.write_text(text)


def main() -> None:
    arguments = argparse.ArgumentParser(description="Write the demonstration bulkhead.")
    arguments.add_argument("variants", nargs="*", default=list(VARIANTS))
    arguments.add_argument("--out", type=Path)
    arguments.add_argument("--tables", type=Path, default=Path("examples/bulkhead/golden"))
    options = arguments.parse_args()
    options.tables.mkdir(parents=True, exist_ok=True)
    tables = {}
    for variant in options.variants:
        # A process each: the kernel numbers occurrences by a counter of the process.
        with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
            folder = options.out or Path("examples/demo" if variant in "AB" else "examples/bulkhead/variants")
            folder.mkdir(parents=True, exist_ok=True)
            tables[variant] = pool.submit(build, variant, folder / f"bulkhead_{variant}.step.gz").result()
        _dump(tables[variant], options.tables / f"bulkhead_{variant}.json")
        faces = tables[variant]["parts"]["BULKHEAD_BODY"]["faces"]
        print(f"{variant}: {faces} faces, {tables[variant]['body_mass_lb']} lb, {tables[variant]['solids']} solids")
    for variant, base in BASES.items():
        if {base, variant} <= tables.keys():
            history = changes(tables[base]["features"], tables[variant]["features"])
            _dump(history, options.tables / f"changes_{base}_to_{variant}.json")


if __name__ == "__main__":
    main()
