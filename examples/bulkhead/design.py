"""The demonstration bulkhead as numbers: every dimension of its variants, and nothing that needs a CAD kernel.

Part frame, mm: x along the 120 in span (-1524 .. 1524), y up (0 .. 1016 at the top of the crown), z through the
plate (0 back face, `DEPTH` front face).  The plan is a set of named walls (ribs and outline); a pocket is the cell
between the walls that it names, counter-clockwise, so a rib that grows narrows its neighbours by itself."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

DEPTH = 60.0
DENSITY = 2.81e-6  # kg/mm3, aluminium 7075
Point = tuple[float, float]

# The crown is a B-spline interpolated through these points.
CROWN: tuple[Point, ...] = (
    (-1524.0, 600.0),
    (-1180.0, 690.0),
    (-800.0, 878.0),
    (-400.0, 994.0),
    (0.0, 1010.0),
    (420.0, 935.0),
    (840.0, 806.0),
    (1200.0, 726.0),
    (1524.0, 660.0),
)


@dataclass(frozen=True)
class Wall:
    """A straight rib about its centre line, or (edge) a flange whose thickness lies inside the outline."""

    start: Point
    end: Point
    thickness: float
    edge: bool = False


@dataclass(frozen=True)
class Pocket:
    """The void before (front) and behind (back) the web that spans z `web[0]` .. `web[1]` in one cell.

    A web from 0 has no back pocket, one up to DEPTH no front pocket.  `grow` moves single walls outwards, on both
    sides.  `back_split` parts the back pocket by a stiffener along that wall, `floor_radius` rounds the front floor."""

    walls: tuple[str, ...]
    web: tuple[float, float]
    radius: float
    back_radius: float = 0.0  # 0: as in front
    back_split: str = ""
    back_inset: float = 0.0
    grow: tuple[tuple[str, float], ...] = ()
    floor_radius: float = 0.0


@dataclass(frozen=True)
class Duct:
    """An opening through the plate in a ring of full depth that stands in a pocket; `bolts` on the ring's front."""

    pocket: str
    centre: Point
    semi_axes: Point
    angle_deg: float
    ring: float
    bolts: int


@dataclass(frozen=True)
class Boss:
    """A round post on the web of a pocket, as high as `top`, with a bore and a counterbore."""

    pocket: str
    centre: Point
    radius: float
    top: float
    bore: float
    counterbore: tuple[float, float]  # radius, depth


@dataclass(frozen=True)
class Hole:
    """A round hole along z; `depth` 0 goes through, else it is blind from the front face."""

    centre: Point
    radius: float
    depth: float = 0.0


@dataclass(frozen=True)
class Lowered:
    """A rib cut down over part of its length (`span`, mm from the wall's start) to `z`, from the front or the back."""

    wall: str
    span: tuple[float, float]
    z: float
    front: bool = True


@dataclass(frozen=True)
class Lug:
    """A rounded ear that leaves the outline at `root` towards `angle_deg`, bored for a bushing at `reach`."""

    root: Point
    angle_deg: float
    reach: float
    width: float
    z: tuple[float, float]


@dataclass(frozen=True)
class Clip:
    """A bent clip with two bolts (an assembly of its own) on the web in a pocket, turned by `angle_deg` about z."""

    pocket: str
    centre: Point
    angle_deg: float


@dataclass(frozen=True)
class Design:
    """One variant, whole."""

    name: str
    crown_flange: float
    walls: dict[str, Wall]
    pockets: dict[str, Pocket]
    ducts: dict[str, Duct]
    bosses: dict[str, Boss]
    holes: dict[str, Hole]
    lowered: dict[str, Lowered]
    lugs: dict[str, Lug]
    clips: dict[str, Clip]
    flange_bolts: dict[str, Point]


BUSHING_RADIUS = 21.0  # the bore in a lug, the outside of a bushing
BOLT_HOLE_RADIUS = 4.2
BOLT_HOLE_DEPTH = 28.0
CLIP_BOLTS: tuple[Point, ...] = ((-19.0, -4.0), (19.0, -4.0))  # in the clip's frame


def variant_a() -> Design:
    """The first variant: about 165 lb, pockets of unlike and of repeated shape on both sides."""
    walls = {
        "BOTTOM": Wall((-1410, 0), (1524, 0), 26, edge=True),
        "TOE": Wall((-1524, 150), (-1410, 0), 12, edge=True),
        "LEFT": Wall((-1524, 600), (-1524, 150), 14, edge=True),
        "RIGHT": Wall((1524, 0), (1524, 660), 14, edge=True),
        # the two long ribs
        "H1": Wall((-1524, 262), (1524, 262), 8),
        "H2L": Wall((-1524, 425), (-330, 605), 8),
        "H2C": Wall((-330, 630), (330, 630), 9),
        "H2R": Wall((330, 615), (1524, 470), 8),
        # uprights below H1: six equal cells between N0 and N6
        "L1": Wall((-1270, 0), (-1215, 262), 6.5),
        "L2": Wall((-985, 0), (-985, 262), 6.5),
        **{f"N{i}": Wall((-720 + 240 * i, 0), (-720 + 240 * i, 262), 8) for i in range(7)},
        "L3": Wall((985, 0), (1015, 262), 6.5),
        "L4": Wall((1275, 0), (1240, 262), 6.5),
        # uprights between H1 and H2
        "M1": Wall((-1235, 262), (-1275, 480), 6.5),
        "M2": Wall((-930, 262), (-930, 540), 8),
        "VC1": Wall((-330, 262), (-330, 1000), 10),
        "M3": Wall((0, 262), (0, 630), 6.5),
        "VC2": Wall((330, 262), (330, 960), 10),
        "M4": Wall((905, 262), (930, 560), 8),
        "M5": Wall((1210, 262), (1235, 520), 6.5),
        # uprights and diagonals below the crown
        "U1": Wall((-1170, 470), (-1130, 720), 6.5),
        "U2": Wall((-760, 530), (-720, 900), 8),
        "D1": Wall((-322, 640), (-20, 1000), 8),
        "U0": Wall((0, 630), (0, 1010), 8),
        "H3": Wall((0, 806), (330, 790), 6.5),
        "U3": Wall((690, 560), (655, 870), 8),
        "U4": Wall((1100, 510), (1090, 760), 6.5),
        # back stiffeners only
        "S1": Wall((-1100, 262), (-1060, 520), 6),
        "S2": Wall((330, 743), (690, 631), 6),
        "S3": Wall((-560, 580), (-520, 980), 6),
    }
    pockets = {
        "P01": Pocket(("BOTTOM", "L1", "H1", "LEFT", "TOE"), (28, 31.5), 18),
        "P02": Pocket(("BOTTOM", "L2", "H1", "L1"), (24, 27), 14, 20),
        "P03": Pocket(("BOTTOM", "N0", "H1", "L2"), (0, 3.8), 22),
        **{f"P{4 + i:02d}": Pocket(("BOTTOM", f"N{i + 1}", "H1", f"N{i}"), (26, 29.5), 16) for i in range(6)},
        "P10": Pocket(("BOTTOM", "L3", "H1", "N6"), (20, 23), 12, floor_radius=5),
        "P11": Pocket(("BOTTOM", "L4", "H1", "L3"), (34, 37.5), 20, 12),
        "P12": Pocket(("BOTTOM", "RIGHT", "H1", "L4"), (56.2, DEPTH), 24),
        "P13": Pocket(("H1", "M1", "H2L", "LEFT"), (22, 25), 12),
        "P14": Pocket(("H1", "M2", "H2L", "M1"), (30, 33.5), 18, back_split="S1"),
        "P15": Pocket(("H1", "VC1", "H2L", "M2"), (29, 32.8), 25),
        "P16": Pocket(("H1", "M3", "H2C", "VC1"), (16, 19), 15, floor_radius=6),
        "P17": Pocket(("H1", "VC2", "H2C", "M3"), (36, 39.5), 20, back_inset=9),
        "P18": Pocket(("H1", "M4", "H2R", "VC2"), (27, 30.8), 22),
        "P19": Pocket(("H1", "M5", "H2R", "M4"), (18, 21.5), 12, 18),
        "P20": Pocket(("H1", "RIGHT", "H2R", "M5"), (0, 4.5), 16),
        "P21": Pocket(("H2L", "U1", "CROWN", "LEFT"), (20, 23), 10),
        "P22": Pocket(("H2L", "U2", "CROWN", "U1"), (32, 35.5), 18),
        "P23": Pocket(("H2L", "VC1", "CROWN", "U2"), (25, 28), 24, back_split="S3"),
        "P24": Pocket(("D1", "CROWN", "VC1"), (0, 3.8), 14),
        "P25": Pocket(("H2C", "U0", "D1"), (30, 33), 12, 18),
        "P26": Pocket(("H2C", "VC2", "H3", "U0"), (22, 25.5), 18),
        "P27": Pocket(("H3", "VC2", "CROWN", "U0"), (38, 41), 14),
        "P28": Pocket(("H2R", "U3", "CROWN", "VC2"), (28, 31.5), 20, back_split="S2"),
        "P29": Pocket(("H2R", "U4", "CROWN", "U3"), (20, 23), 16, back_inset=6),
        "P30": Pocket(("H2R", "RIGHT", "CROWN", "U4"), (33, 36.5), 12),
    }
    ducts = {
        "DUCT_A": Duct("P15", (-632, 408), (165, 78), 6, 22, 12),
        "DUCT_B": Duct("P18", (618, 428), (92, 92), 0, 22, 8),
    }
    bosses = {
        "BOSS_1": Boss("P14", (-1170, 330), 26, 52, 9, (15, 6)),
        "BOSS_2": Boss("P28", (410, 690), 30, 46, 10, (17, 8)),
        "BOSS_3": Boss("P22", (-1045, 600), 24, 55, 8, (13, 5)),
    }
    holes = {
        # lightening holes through webs
        "LH01": Hole((-1385, 150), 40),
        "LH02": Hole((-1120, 132), 46),
        "LH03": Hole((-905, 140), 24),
        "LH04": Hole((-800, 140), 24),
        **{f"LH{5 + i:02d}": Hole((-600 + 240 * i, 142), 48) for i in (0, 1, 3, 4)},
        "LH10": Hole((800, 140), 30),
        "LH11": Hole((910, 140), 30),
        "LH12": Hole((1130, 138), 52),
        "LH13": Hole((1395, 120), 34),
        "LH14": Hole((-1405, 350), 36),
        "LH15": Hole((-1020, 400), 30),
        "LH16": Hole((-165, 380), 38),
        "LH17": Hole((-165, 510), 38),
        "LH18": Hole((100, 340), 26),
        "LH19": Hole((230, 450), 44),
        "LH20": Hole((100, 560), 26),
        "LH21": Hole((1070, 390), 58),
        "LH22": Hole((1330, 330), 22),
        "LH23": Hole((1420, 400), 22),
        "LH24": Hole((-1390, 520), 34),
        "LH25": Hole((-900, 690), 50),
        "LH26": Hole((-620, 720), 32),
        "LH27": Hole((-430, 840), 46),
        "LH28": Hole((-235, 905), 24),
        "LH29": Hole((-95, 735), 34),
        "LH30": Hole((165, 715), 40),
        "LH31": Hole((120, 890), 28),
        "LH32": Hole((245, 880), 22),
        "LH33": Hole((560, 740), 56),
        "LH34": Hole((860, 640), 42),
        "LH35": Hole((1310, 590), 40),
        # tooling and drain holes
        "TH01": Hole((-1330, 60), 6),
        "TH02": Hole((60, 75), 6),
        "TH03": Hole((1470, 215), 6),
        "TH04": Hole((1470, 520), 8),
        "TH05": Hole((-560, 870), 5),
        "TH06": Hole((1000, 560), 5),
    }
    lowered = {
        "LOW_L2": Lowered("L2", (80, 200), 46),
        "LOW_N2": Lowered("N2", (75, 215), 44),
        "LOW_N4": Lowered("N4", (75, 215), 14, front=False),
        "LOW_M1": Lowered("M1", (50, 130), 48),
        "LOW_M3": Lowered("M3", (90, 280), 50),
        "LOW_M5": Lowered("M5", (55, 150), 44),
        "LOW_U2": Lowered("U2", (85, 250), 45),
        "LOW_D1": Lowered("D1", (150, 290), 48),
        "LOW_U4": Lowered("U4", (50, 150), 47),
    }
    lugs = {
        "LUG_1": Lug((-1524, 250), 180, 62, 96, (10, 53.5)),
        "LUG_2": Lug((-1524, 500), 172, 70, 110, (6, 46)),
        "LUG_3": Lug((1524, 180), 0, 66, 104, (12, 52)),
        "LUG_4": Lug((1524, 560), 8, 58, 92, (8, 55.5)),
        "LUG_5": Lug((-860, 0), 270, 60, 120, (14, 50)),
        "LUG_6": Lug((1100, 0), 270, 66, 108, (10, 48)),
    }
    clips = {
        "CLIP_1": Clip("P06", (-120, 150), 0),
        "CLIP_2": Clip("P09", (600, 205), 180),
        "CLIP_3": Clip("P30", (1180, 590), 90),
        "CLIP_4": Clip("P23", (-640, 840), 25),
    }
    spacing = [-1290.0 + 160.0 * i for i in range(17)]
    bolts = {f"F{i + 1:02d}": (x, 12.0) for i, x in enumerate(spacing) if abs(x + 860) > 75 and abs(x - 1100) > 70}
    return Design("A", 11.0, walls, pockets, ducts, bosses, holes, lowered, lugs, clips, bolts)


def variant_b() -> Design:
    """A after an engineering change: nine alterations, most of them about the round duct."""
    a = variant_a()
    grown = replace(a.pockets["P19"], grow=(("M5", 2.0), ("H1", 2.5)))
    thinner = replace(a.pockets["P17"], web=(36, 38.5))
    wider = replace(a.pockets["P06"], grow=(("H1", 3.0),))
    return replace(
        a,
        name="B",
        walls={**a.walls, "M4": replace(a.walls["M4"], thickness=14.0)},
        pockets={**a.pockets, "P19": grown, "P17": thinner, "P06": wider},
        holes={
            **{k: h for k, h in a.holes.items() if k not in ("LH11", "LH20")},
            "LH12": replace(a.holes["LH12"], radius=44.0),
        },
        lugs={**a.lugs, "LUG_7": Lug((600, 0), 270, 58, 100, (12, 50))},
        clips={**a.clips, "CLIP_2": replace(a.clips["CLIP_2"], angle_deg=90.0)},
        flange_bolts={k: p for k, p in a.flange_bolts.items() if abs(p[0] - 600) > 65},
    )


def variant_c() -> Design:
    """A as a plain casting: pockets in the front only, ten cells left solid, no lightening holes and no clips."""
    a = variant_a()
    solid = {"P01", "P03", "P05", "P07", "P10", "P13", "P16", "P20", "P25", "P29"}
    pockets = {
        k: replace(p, web=(0, round(p.web[1] - p.web[0], 3)), back_split="", back_inset=0.0, floor_radius=0.0)
        for k, p in a.pockets.items()
        if k not in solid and k != "P12"
    }
    return replace(a, name="C", pockets=pockets, holes={}, clips={}, lowered={})


def variant_d() -> Design:
    """A with its lower flange bolted down: a bolt every 22 mm, those of A where they were."""
    a = variant_a()
    places = [-1380.0 + 22.0 * i for i in range(130)]
    clear = [x for x in places if abs(x + 860) > 75 and abs(x - 1100) > 70]
    own = [x for x in clear if all(abs(x - p[0]) > 20 for p in a.flange_bolts.values())]
    added = {f"G{i + 1:03d}": (x, 12.0) for i, x in enumerate(own)}
    return replace(a, name="D", flange_bolts={**a.flange_bolts, **added})


def variant_e() -> Design:
    """B after a second change: holes, a boss and a lug moved, a duct wider, a rib no longer cut down, a clip fewer."""
    b = variant_b()
    moved = {
        "LH21": replace(b.holes["LH21"], centre=(1076.0, 382.0)),
        "LH25": replace(b.holes["LH25"], centre=(-900.0, 702.0)),
        "TH02": replace(b.holes["TH02"], centre=(66.0, 75.0), radius=7.0),
    }
    return replace(
        b,
        name="E",
        holes={**b.holes, **moved},
        bosses={**b.bosses, "BOSS_1": replace(b.bosses["BOSS_1"], centre=(-1158.0, 334.0))},
        ducts={**b.ducts, "DUCT_B": replace(b.ducts["DUCT_B"], semi_axes=(96, 96))},
        lugs={**b.lugs, "LUG_4": replace(b.lugs["LUG_4"], root=(1524, 540))},
        lowered={k: cut for k, cut in b.lowered.items() if k != "LOW_M3"},
        clips={k: clip for k, clip in b.clips.items() if k != "CLIP_4"},
    )


def variant_f() -> Design:
    """A thinned: every web above 3 mm taken down to 2.6 mm from the front, and two ribs to 5 mm."""
    a = variant_a()
    pockets = {
        k: replace(p, web=(p.web[0], round(p.web[0] + 2.6, 3))) if k != "P12" and p.web[1] - p.web[0] > 3 else p
        for k, p in a.pockets.items()
    }
    thin = {k: replace(a.walls[k], thickness=5.0) for k in ("L2", "H3")}
    return replace(a, name="F", walls={**a.walls, **thin}, pockets=pockets)


VARIANTS = {"A": variant_a, "B": variant_b, "C": variant_c, "D": variant_d, "E": variant_e, "F": variant_f}
BASES = {"B": "A", "C": "A", "D": "A", "E": "B", "F": "A"}  # what each variant is a change of


def duct_bolts(duct: Duct) -> list[Point]:
    """Bolt centres on the middle line of a duct's ring, evenly spaced in the ellipse's parameter."""
    a, b = (s + duct.ring / 2 for s in duct.semi_axes)
    c, s = math.cos(math.radians(duct.angle_deg)), math.sin(math.radians(duct.angle_deg))
    out = []
    for k in range(duct.bolts):
        t = 2 * math.pi * (k + 0.5) / duct.bolts
        u, v = a * math.cos(t), b * math.sin(t)
        out.append((duct.centre[0] + c * u - s * v, duct.centre[1] + s * u + c * v))
    return out
