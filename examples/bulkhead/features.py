"""What a variant is made of, feature by feature: the solid is built from this list, the golden table holds it."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import shapely

from examples.bulkhead.design import (
    BOLT_HOLE_DEPTH,
    BOLT_HOLE_RADIUS,
    BUSHING_RADIUS,
    CLIP_BOLTS,
    DEPTH,
    Design,
    Duct,
    Point,
    duct_bolts,
)
from examples.bulkhead.plan import Profile, Vector, cell_profile, circle_in, sample, split_cell

CLIP_THICKNESS = 4.0


@dataclass
class Feature:
    """One feature: `data` goes to the golden table, `profile` (a prism between z[0] and z[1]) to the kernel."""

    name: str
    kind: str
    z: tuple[float, float]
    data: dict[str, Any]
    box: tuple[float, float, float, float] = (0, 0, 0, 0)  # x0, y0, x1, y1
    profile: Profile = field(default_factory=list)

    def row(self) -> dict[str, Any]:
        """The golden table's row; `box` is [x0, y0, z0, x1, y1, z1] in the part's frame."""
        x0, y0, x1, y1 = self.box
        box = [round(float(v), 4) for v in (x0, y0, self.z[0], x1, y1, self.z[1])]
        return {"name": self.name, "kind": self.kind, **self.data, "box": box}


def _bounds(points: Vector) -> tuple[float, float, float, float]:
    (x0, y0), (x1, y1) = points.min(0), points.max(0)
    return float(x0), float(y0), float(x1), float(y1)


def pockets(design: Design) -> list[Feature]:
    """The pockets of both sides; a split cell gives two on the back, `NAME.back_1` and `NAME.back_2`."""
    out = []
    for name, pocket in design.pockets.items():
        low, high = pocket.web
        grow = dict(pocket.grow)
        sides = []
        if high < DEPTH:
            sides.append((f"{name}.front", pocket.walls, pocket.radius, 0.0, (high, DEPTH), pocket.floor_radius))
        if low > 0:
            cells = split_cell(design, pocket.walls, pocket.back_split) if pocket.back_split else (pocket.walls,)
            for k, cell in enumerate(cells):
                suffix = f"back_{k + 1}" if pocket.back_split else "back"
                radius = pocket.back_radius or pocket.radius
                sides.append((f"{name}.{suffix}", cell, radius, pocket.back_inset, (0.0, low), 0.0))
        for label, walls, radius, inset, z, floor_radius in sides:
            profile = cell_profile(design, walls, radius, inset, grow)
            points = sample(profile)
            data = {
                "side": label.split(".")[1][:5].rstrip("_"),
                "walls": list(walls),
                "corner_radius": radius,
                "floor_z": z[0] if label.endswith("front") else z[1],
                "floor_radius": floor_radius,
                "depth": z[1] - z[0],
                "web_thickness": high - low,
                "area": round(float(shapely.Polygon(points).area), 1),
            }
            out.append(Feature(label, "pocket", z, data, _bounds(points), profile))
    return out


def _round(name: str, kind: str, centre: Point, radius: float, z: tuple[float, float], **more: Any) -> Feature:
    box = (centre[0] - radius, centre[1] - radius, centre[0] + radius, centre[1] + radius)
    return Feature(name, kind, z, {"centre": [round(float(v), 6) for v in centre], "radius": radius, **more}, box)


def holes(design: Design, cells: list[Feature]) -> list[Feature]:
    """Lightening and tooling holes with the web that each goes through; refuses one that is not within one pocket."""
    out = []
    areas = [(cell.name.split(".")[0], shapely.Polygon(sample(cell.profile))) for cell in cells]
    for name, hole in design.holes.items():
        rim = circle_in(hole.centre, hole.radius + 3)
        hosts = {cell for cell, area in areas if shapely.contains_xy(area, rim[:, 0], rim[:, 1]).all()}
        if len(hosts) != 1:
            raise ValueError(f"hole {name} must lie in one pocket with 3 mm to spare, lies in {sorted(hosts)}")
        (host,) = hosts
        kind = "lightening_hole" if name.startswith("LH") else "tooling_hole"
        out.append(_round(name, kind, hole.centre, hole.radius, design.pockets[host].web, through=True, pocket=host))
    return out


def lug_centre(design: Design, name: str) -> Point:
    """Centre of a lug's bore."""
    lug = design.lugs[name]
    t = math.radians(lug.angle_deg)
    return lug.root[0] + lug.reach * math.cos(t), lug.root[1] + lug.reach * math.sin(t)


def bolts(design: Design) -> dict[str, tuple[Point, float, tuple[float, float]]]:
    """Name of every bolt hole in the body: its centre, the z under the bolt's head, and the z that the hole spans."""
    blind = (DEPTH - BOLT_HOLE_DEPTH, DEPTH)
    out = {f"BOLT_{k}": (p, DEPTH, blind) for k, p in design.flange_bolts.items()}
    for name, duct in design.ducts.items():
        out |= {f"BOLT_{name}_{i + 1:02d}": (p, DEPTH, blind) for i, p in enumerate(duct_bolts(duct))}
    for name, clip in design.clips.items():
        c, s = math.cos(math.radians(clip.angle_deg)), math.sin(math.radians(clip.angle_deg))
        web = design.pockets[clip.pocket].web
        for i, (u, v) in enumerate(CLIP_BOLTS):
            p = (clip.centre[0] + c * u - s * v, clip.centre[1] + s * u + c * v)
            out[f"{name}_{i + 1}"] = (p, web[1] + CLIP_THICKNESS, web)
    return out


def ellipse_box(duct: Duct, grow: float = 0.0) -> tuple[float, float, float, float]:
    """Bounds of a duct's ellipse (its ring's with `grow`)."""
    (a, b), t = (np.array(duct.semi_axes) + grow), math.radians(duct.angle_deg)
    dx, dy = math.hypot(a * math.cos(t), b * math.sin(t)), math.hypot(a * math.sin(t), b * math.cos(t))
    x, y = duct.centre
    return x - dx, y - dy, x + dx, y + dy


def rib_box(design: Design, name: str, span: tuple[float, float] | None = None) -> tuple[float, float, float, float]:
    """Bounds of a rib's centre line, widened by half its thickness."""
    wall = design.walls[name]
    p, q = np.array(wall.start, float), np.array(wall.end, float)
    if span is not None:
        along = (q - p) / np.linalg.norm(q - p)
        p, q = p + span[0] * along, p + span[1] * along
    return _bounds(
        np.array([p - wall.thickness / 2, p + wall.thickness / 2, q - wall.thickness / 2, q + wall.thickness / 2])
    )


def all_features(design: Design) -> list[Feature]:
    """Every feature of the body, in a fixed order."""
    cells = pockets(design)
    out = list(cells)
    out += holes(design, cells)
    for name, duct in design.ducts.items():
        data = {
            "centre": list(duct.centre),
            "semi_axes": list(duct.semi_axes),
            "angle_deg": duct.angle_deg,
            "ring": duct.ring,
            "pocket": duct.pocket,
        }
        out.append(Feature(name, "duct", (0.0, DEPTH), data, ellipse_box(duct, duct.ring)))
    for name, boss in design.bosses.items():
        web = design.pockets[boss.pocket].web
        more = {"bore": boss.bore, "counterbore": list(boss.counterbore), "pocket": boss.pocket}
        out.append(_round(name, "boss", boss.centre, boss.radius, (web[1], boss.top), **more))
    for name, lug in design.lugs.items():
        centre = lug_centre(design, name)
        t = math.radians(lug.angle_deg)
        half = np.array([-math.sin(t), math.cos(t)]) * lug.width / 2
        plan = np.concatenate([circle_in(centre, lug.width / 2, 720), [lug.root + half, lug.root - half]])
        data = {
            "root": list(lug.root),
            "angle_deg": lug.angle_deg,
            "width": lug.width,
            "bore_centre": [round(v, 6) for v in centre],
            "bore_radius": BUSHING_RADIUS,
        }
        out.append(Feature(name, "lug", lug.z, data, _bounds(plan)))
    ribs = [n for n, w in design.walls.items() if not w.edge]
    for name in ribs:
        wall = design.walls[name]
        data = {"start": list(wall.start), "end": list(wall.end), "thickness": wall.thickness}
        out.append(Feature(name, "rib", (0.0, DEPTH), data, rib_box(design, name)))
    for name, cut in design.lowered.items():
        data = {"rib": cut.wall, "span": list(cut.span), "side": "front" if cut.front else "back", "level_z": cut.z}
        z = (cut.z, DEPTH) if cut.front else (0.0, cut.z)
        out.append(Feature(name, "lowered_rib", z, data, rib_box(design, cut.wall, cut.span)))
    for name, (centre, _, z) in bolts(design).items():
        out.append(_round(f"HOLE_{name}", "bolt_hole", centre, BOLT_HOLE_RADIUS, z, through=z[1] < DEPTH))
    return out


def changes(before: list[dict[str, Any]], after: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """What differs between two feature tables, by name: added, removed, or changed with the old and new values."""
    old, new = ({row["name"]: row for row in rows} for rows in (before, after))
    out: list[dict[str, Any]] = []
    for name in sorted(old.keys() | new.keys()):
        a, b = old.get(name), new.get(name)
        if a is None or b is None:
            row = a or b
            assert row is not None
            out.append(
                {"name": name, "kind": row["kind"], "change": "removed" if b is None else "added", "box": row["box"]}
            )
        elif a != b:
            keys = [k for k in a if a[k] != b[k]]
            values = {k: {"before": a[k], "after": b[k]} for k in keys}
            out.append({"name": name, "kind": a["kind"], "change": "changed", "values": values, "box": b["box"]})
    return out
