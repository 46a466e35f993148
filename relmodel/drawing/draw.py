"""The model and what was found, drawn: over pictures, side by side, as small SVG plots; what each colour means."""

from __future__ import annotations

import base64
import io
import re
import struct
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt
from markupsafe import Markup
from PIL import Image, ImageDraw, ImageFont
from sqlalchemy import Connection

from relmodel import names
from relmodel.arrays import Bytes, Floats
from relmodel.errors import InputError
from relmodel.names import visible
from relmodel.store import Store

SUFFIXES = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp")
_SHIFT = 4  # cv2 draws at fixed-point places: four bits below the pixel are enough to look sub-pixel
_ENTRY, _LINE = 190, 26  # px: of a key
_LEAST_FOR_KEY = 400  # px: a narrower picture would be mostly key


@dataclass(frozen=True)
class Stroke:
    """Courses of points (n, 2) in pixels (x, y), drawn in one colour."""

    courses: Sequence[Floats]
    colour: Rgb
    width: int = 1
    closed: bool = False


def in_colour(grey: Bytes | Floats) -> Bytes:
    """A picture (rows, columns) of 0..255 as (rows, columns, 3), RGB."""
    return np.repeat(np.clip(grey, 0, 255).astype(np.uint8)[..., None], 3, axis=2)


def draw(canvas: Bytes, strokes: Iterable[Stroke]) -> Bytes:
    """A picture (rows, columns, 3: RGB) with strokes over it, the later above."""
    canvas = np.array(canvas, order="C")
    for stroke in strokes:
        points = [np.rint(np.clip(c, -1e4, 1e5) * 2**_SHIFT).astype(np.int32) for c in stroke.courses]
        cv2.polylines(canvas, points, stroke.closed, stroke.colour, stroke.width, cv2.LINE_AA, _SHIFT)
    return canvas


def with_key(canvas: Bytes, colours: Mapping[str, Rgb]) -> Bytes:
    """A picture with what its colours mean below it, where it is wide enough."""
    height, width = canvas.shape[:2]
    if width < _LEAST_FOR_KEY:
        return canvas
    a_line = width // _ENTRY
    image = Image.new("RGB", (width, height + _LINE * -(-len(colours) // a_line)), "white")
    image.paste(Image.fromarray(canvas))
    drawn, font = ImageDraw.Draw(image), ImageFont.load_default(16)
    for i, (words, colour) in enumerate(colours.items()):
        x, y = 12 + _ENTRY * (i % a_line), height + _LINE * (i // a_line)
        drawn.rectangle((x, y + 3, x + 18, y + 19), fill=colour, outline=INK)
        drawn.text((x + 26, y + 1), words.replace("_", " "), fill=INK, font=font)
    return np.asarray(image)


def check_writable(path: str | Path) -> None:
    """Raise InputError where a picture of this name cannot be written, before it is drawn."""
    path = Path(path)
    if path.suffix.lower() not in SUFFIXES:
        raise InputError(f"the overlay {path} has no picture suffix: end its name with one of {', '.join(SUFFIXES)}")
    names.check_writable(path, "overlay")


def side_by_side(images: Sequence[Bytes]) -> Bytes:
    """Pictures (rows, columns, 3: RGB) as one, a white gap between them."""
    height = max(map(len, images))
    framed = [np.pad(i, ((0, height - len(i)), (0, 8), (0, 0)), constant_values=255) for i in images]
    return np.concatenate(framed, axis=1)[:, :-8]


def save_side_by_side(path: str | Path, images: Sequence[Bytes]) -> None:
    """Write pictures as one; the suffix names the format.  Raises InputError where it cannot be written."""
    try:
        Image.fromarray(side_by_side(images)).save(path)
    except OSError as error:
        raise InputError(f"the overlay {path} cannot be written ({error.strerror}): name another place") from error


# What each colour means, in every picture and page.

Rgb = tuple[int, int, int]
# Of edges of the model over pictures, the worst first: the worse is drawn above.
STATES: dict[str, Rgb] = {
    "contradicted": (255, 59, 48),
    "changed": (255, 159, 10),
    "not_confirmed": (255, 214, 10),
    "undecidable": (154, 167, 176),
    "confirmed": (61, 220, 115),
}
FAILING = tuple(STATES)[:3]
_DRAWN = (*FAILING, "confirmed", "undecidable")  # of several states of an edge the first
BLEND: Rgb = (90, 162, 255)  # edges of fillets, which show as shading and not as edges
UNEXPLAINED: Rgb = (255, 107, 255)  # what the model does not account for
# Of features by kind.
KINDS: dict[str, Rgb] = {
    "body": (214, 206, 190),
    "pocket": (124, 164, 206),
    "through_hole": (230, 85, 60),
    "blind_hole": (240, 150, 60),
    "boss": (60, 150, 110),
    "lug": (150, 105, 190),
    "duct": (200, 60, 130),
    "flange": (222, 190, 80),
    "rib": (130, 190, 120),
    "web": (170, 205, 225),
    "open_slot": (90, 175, 180),
    "slot": (60, 130, 150),
    "step": (165, 140, 100),
    "fillet": (245, 200, 190),
    "chamfer": (190, 120, 90),
}
PLAIN: Rgb = (196, 200, 204)  # what belongs to no feature
INK: Rgb = (40, 40, 40)
_OTHERS: tuple[Rgb, ...] = ((160, 160, 60), (110, 110, 200), (200, 130, 200), (100, 140, 60))


def colours_of(kinds: Sequence[str]) -> list[Rgb]:
    """The colour of each kind of feature; of kinds that have none of their own, in turn."""
    return [KINDS.get(kind, _OTHERS[i % len(_OTHERS)]) for i, kind in enumerate(kinds)]


def hexadecimal(rgb: Sequence[float]) -> str:
    """A colour (0 to 255) as pages spell it."""
    return "#" + "".join(f"{int(c):02x}" for c in rgb)


# Pictures as the store keeps them, made fit for a page.

_LONGEST_PX = 2048  # of a picture in a page; the drawing over it keeps the picture's own pixels
_MOST_PIXELS = 200_000_000  # of a picture that is decoded at all
_QUALITY = 82
_ORIENTATION = 0x0112  # EXIF's tag


def read_orientation(picture: Image.Image) -> int:
    """The EXIF orientation of a picture, 1 to 8: how it is to be turned; 1, as it is, where it says none."""
    try:
        said = picture.getexif().get(_ORIENTATION, 1)
    except (SyntaxError, struct.error, KeyError, TypeError, ValueError):  # a damaged tag; the pixels may be whole
        return 1
    return said if said in range(1, 9) else 1


def turn(pixels: npt.NDArray[np.generic], orientation: int) -> npt.NDArray[np.generic]:
    """Pixels (rows, columns, ...) as stored, turned as an EXIF orientation says."""
    if orientation > 4:
        pixels = pixels.swapaxes(0, 1)
    down, across = (-1 if orientation in turned else 1 for turned in ((3, 4, 7, 8), (2, 3, 6, 7)))
    return pixels[::down, ::across]


def read_image(data: bytes) -> Image.Image | None:
    """A picture in eight bits, turned as it says; None where it cannot be decoded."""
    try:
        with Image.open(io.BytesIO(data)) as opened:
            if opened.width * opened.height > _MOST_PIXELS:
                return None
            orientation = 1 if opened.format == "TIFF" else read_orientation(opened)  # the reader has turned those
            grey = np.asarray(opened) if opened.mode[0] in "IF" else None
            picture = opened.convert("RGB" if opened.mode in ("RGB", "RGBA", "P", "CMYK", "YCbCr") else "L")
    except (OSError, ValueError, Image.DecompressionBombError):
        return None
    if grey is not None:  # sixteen bits
        bright = max(float(np.percentile(grey, 99.9)), 1e-9)
        picture = Image.fromarray(np.clip(grey * (255 / bright), 0, 255).astype(np.uint8))
    return picture if orientation == 1 else Image.fromarray(turn(np.asarray(picture), orientation))


def as_webp(picture: Image.Image, longest_px: int = _LONGEST_PX) -> bytes:
    """A picture as a file of WebP, made smaller where a side is longer."""
    small, out = picture.copy(), io.BytesIO()
    small.thumbnail((longest_px, longest_px))
    small.save(out, "WEBP", quality=_QUALITY)
    return out.getvalue()


def data_uri(picture: Image.Image) -> str:
    """A picture as a data URI, no larger than a page needs."""
    return "data:image/webp;base64," + base64.b64encode(as_webp(picture)).decode()


# Small SVG drawings: courses of arcs, tolerances, balloons, values over time.

_MOST_POINTS = 500
_DATES = 4  # below a plot over time, at most
_DETAIL_PX = 0.4  # how far a drawn course may leave the points that it stands for: less than a line is wide


def course(points: Floats, detail: float = _DETAIL_PX) -> str:
    """SVG path data of points (n, 2), px, without those that a straight piece passes within `detail` (Douglas and
    Peucker 1973, by OpenCV)."""
    return path_data(np.asarray(cv2.approxPolyDP(points.astype(np.float32), detail, False)[:, 0], float))


def path_data(points: Floats, closed: bool = False) -> str:
    """SVG path data of a polyline (n, 2), px, to a tenth."""
    return "M" + "L".join(f"{u:.1f} {v:.1f}" for u, v in points.tolist()) + ("Z" if closed else "")


def tolerance_bar(limits: Sequence[float | None], off: float | None, spread: float, reach: float) -> Markup:
    """The band of a tolerance, open where it has no limit, with a value and how far it may be off: all less the
    nominal, drawn from -reach to reach."""
    at = [-2 * reach if limits[0] is None else limits[0], 2 * reach if limits[1] is None else limits[1]]
    at += [] if off is None else [off - spread, off + spread, off]
    low, high, *value = np.clip(57 / reach * np.array(at), -60, 60).round(1).tolist()
    band = '<rect class="band" x="{}" y="1" width="{}" height="12"/>' if list(limits) != [None, None] else ""
    point = '<path class="spread" d="M{} 7H{}"/><circle cx="{}" cy="7" r="2.6"/>' if value else ""
    return Markup(
        '<svg class="band-of" viewBox="-60 0 120 14" aria-hidden="true">{}<path class="axis" d="M0 0V14"/>{}</svg>'
    ).format(Markup(band).format(low, max(high - low, 1)), Markup(point).format(*value))


@dataclass(frozen=True)
class Balloon:
    """A number beside a picture's place `at` (2,) px, where a click leads, and a state of STATES that colours it."""

    label: str
    link: str
    at: Floats
    state: str


def draw_balloons(balloons: Sequence[Balloon], size: tuple[int, int]) -> Markup:
    """Balloons with leaders on a picture (width, height): each as near to its place as it lies on no other, on no
    place, and within the picture."""
    radius = max(size) / 55
    angle, away = np.meshgrid(np.arange(24) * np.pi / 12, radius * np.arange(2.5, 60, 0.5))
    around = np.column_stack([(away * np.cos(angle)).ravel(), (away * np.sin(angle)).ravel()])
    taken = [(b.at, 1.4 * radius) for b in balloons]
    out = []
    for b in balloons:
        tried = b.at + around
        free = np.all((tried > 1.2 * radius) & (tried < np.array(size) - 1.2 * radius), axis=1)
        for other, apart in taken:
            free &= np.linalg.norm(tried - other, axis=1) > apart
        if not free.any():
            continue  # no room is left
        put = tried[np.argmax(free)]
        taken.append((put, 2.3 * radius))
        rim = put + radius * (b.at - put) / np.linalg.norm(b.at - put)
        out.append(
            _BALLOON.format(
                b=b, at=b.at.round(), put=put.round(), rim=rim.round(), r=round(radius), f=round(0.85 * radius)
            )
        )
    return Markup("").join(out)


_BALLOON = Markup(
    '<a href="#{b.link}" class="balloon state-{b.state}"><path d="M{at[0]} {at[1]}L{rim[0]} {rim[1]}"/>'
    '<circle class="place" cx="{at[0]}" cy="{at[1]}" r="4"/><circle cx="{put[0]}" cy="{put[1]}" r="{r}"/>'
    '<text x="{put[0]}" y="{put[1]}" dy=".36em" font-size="{f}">{b.label}</text></a>'
)


@dataclass(frozen=True)
class Point:
    """A value of a plot over time: where a click leads, its label and date, how far to either side it is uncertain, the
    nominal and the limits where there are such, and whether it is as it should be: good, open or bad."""

    link: str
    label: str
    value: float
    date: str = ""
    spread: float | None = None
    nominal: float | None = None
    lower: float | None = None
    upper: float | None = None
    mark: str = "good"


def history(points: Sequence[Point], unit: str) -> Markup:
    """Values one after the other with bars of their uncertainty, the nominal, the limits, and dates where these change;
    each value is a link.  Of many the last 500 are drawn."""
    points = points[-_MOST_POINTS:]
    value, spread, *lines = (
        np.array([np.nan if v is None else v for v in column], float)
        for column in zip(*((p.value, p.spread, p.nominal, p.lower, p.upper) for p in points), strict=True)
    )
    spread = np.nan_to_num(spread)
    shown = np.concatenate([value - spread, value + spread, *lines])
    low, high = float(np.nanmin(shown)), float(np.nanmax(shown))
    if high - low < 1e-9 * abs(high) + 1e-12:  # of one value
        low, high = low - 0.5 * abs(low) - 1e-6, high + 0.5 * abs(high) + 1e-6
    margin = 0.08 * (high - low)
    half = 180 / len(points)  # a line goes as far about a value as to the middle of the next
    x = 52 + half * (2 * np.arange(len(points)) + 1)

    def y(v: Floats) -> Floats:
        return np.asarray(165 - 157 * (v - low + margin) / (high - low + 2 * margin))

    ends = (x[:, None] + [-half, half]).ravel()
    drawn = [
        Markup('<path class="{}" d="{}"/>').format(
            name, path_data(np.column_stack([ends, np.repeat(y(at), 2)])[np.repeat(np.isfinite(at), 2)])
        )
        for name, at in zip(("nominal", "limit", "limit"), lines, strict=True)
        if np.isfinite(at).any()
    ]
    drawn += [
        Markup(
            '<a href="{}"><path class="sigma" d="M{:.1f} {:.1f}V{:.1f}"/>'
            '<circle class="{}" cx="{:.1f}" cy="{:.1f}" r="4">'
            "<title>{}: {:.4g}{} {}</title></circle></a>"
        ).format(
            p.link, u, top, bottom, p.mark, u, v, visible(p.label), p.value,
            "" if p.spread is None else f" \u00b1 {p.spread:.2g}", unit,
        )
        for p, u, v, top, bottom in zip(points, x, y(value), y(value + spread), y(value - spread), strict=True)
    ]  # fmt: skip
    drawn += [
        Markup('<text x="46" y="{:.1f}" text-anchor="end">{:.4g}</text>').format(float(y(np.array(at))) + 4, at)
        for at in np.linspace(low, high, 5)
    ]
    before = ""
    for i in np.unique(np.linspace(0, len(points) - 1, _DATES).astype(int)):
        if points[i].date != before:
            before = points[i].date
            drawn.append(Markup('<text x="{:.1f}" y="182" text-anchor="middle">{}</text>').format(x[i], before))
    return Markup(
        '<svg class="plot history" viewBox="0 0 420 188" role="img" aria-label="values over time, {}">'
        '<path class="axis" d="M52 8V165H412"/>{}</svg>'
    ).format(unit, Markup("").join(drawn))


# The model as the cameras of a run see it, from the run's rows: its edges by state, drawn over the pictures, and pieces
# of them that show what is not as the model says.

_MARGIN_PX, _LEAST_PX = 40, 160  # about what a crop is of, and of its side: what lies around it says where that is
_MOST_CROPS = 50


@dataclass(frozen=True)
class Edge:
    """An edge as a camera should see it: its row, points (n, 2) px along it, and the state it is drawn in, or empty."""

    row: Any
    points: Floats
    state: str

    @property
    def number(self) -> int:
        return int(self.row.view_arc_no)


@dataclass(frozen=True)
class Seen:
    """What a camera saw: the row of its picture, that in eight bits where it was kept, and the model's edges in it."""

    row: Any
    image: Image.Image | None
    edges: list[Edge]


def read_seen(store: Store, connection: Connection, run: int, items: Sequence[Any] | None = None) -> list[Seen]:
    """The pictures of a run with the edges of the model, in the order of the cameras; items: as `read_edges` has it."""
    edges = read_edges(store, connection, run, items)
    return [
        Seen(row, None if row.bytes is None else read_image(row.bytes), edges.get(row.camera, []))
        for row in store.rows(connection, "report/pictures", run_id=run)
    ]


def read_edges(
    store: Store, connection: Connection, run: int, items: Sequence[Any] | None = None
) -> dict[str, list[Edge]]:
    """The edges of the model at the best pose, by camera.  Each is drawn in the worst state of the features that it
    bounds, of those that are decided; without any, in the part's.  items: rows of `report/items`, where known."""
    said = [it for it in (store.rows(connection, "report/items", run_id=run) if items is None else items) if it.drawn]
    states: dict[tuple[str, int], str] = {}
    for item in sorted(said, key=lambda it: (it.level == "part", _DRAWN.index(it.drawn))):
        for edge in edges_of(item):
            states.setdefault(edge, item.drawn)
    out: dict[str, list[Edge]] = defaultdict(list)
    for row in store.rows(connection, "report/model_arcs", run_id=run):
        state = states.get((row.camera, int(row.view_arc_no)), "")
        out[row.camera].append(Edge(row, np.column_stack([row.x, row.y]), state))
    return out


def edges_of(item: Any) -> list[tuple[str, int]]:
    """Cameras and numbers of the edges that show a part or feature, a row of `report/items`."""
    return list(zip(item.cameras or (), item.arc_nos or (), strict=True))


def draw_model(canvas: Bytes, edges: Sequence[Edge], boxes: Sequence[Floats] = ()) -> Bytes:
    """A picture (rows, columns, 3: RGB) with edges in the colours of their states, the worst above, blends in a colour
    of their own; boxes (4, 2) px: about what the model does not account for."""
    blends = [e.points for e in edges if e.row.kind == "smooth"]
    by_state = [
        Stroke([e.points for e in edges if (e.state or "undecidable") == state and e.row.kind != "smooth"], colour)
        for state, colour in reversed(STATES.items())
    ]
    return draw(canvas, [Stroke(blends, BLEND), *by_state, Stroke(boxes, UNEXPLAINED, closed=True)])


def draw_over(
    store: Store, connection: Connection, run: int, greys: Mapping[str, Bytes | Floats], edges: Mapping[str, list[Edge]]
) -> dict[str, Bytes]:
    """The pictures of an inspection, given by camera in 0..255, with the model drawn over them and what it does not
    account for (rows, columns, 3: RGB); arcs beyond the model are left out.  edges: of `read_edges`."""
    boxes: dict[str, list[Floats]] = defaultdict(list)
    for r in store.rows(connection, "result/unexplained", run_id=run):
        if not r.beyond or r.region_no is not None:
            boxes[r.camera].append(np.array([[r.u0, r.v0], [r.u1, r.v0], [r.u1, r.v1], [r.u0, r.v1]], float))
    return {name: draw_model(in_colour(grey), edges.get(name, []), boxes[name]) for name, grey in greys.items()}


def write_overlay(path: str | Path, store: Store, run: int, greys: Mapping[str, Bytes | Floats]) -> None:
    """Write the pictures of an inspection, given by camera, side by side with the model drawn over them.

    Raises InputError where it cannot be written."""
    with store.read() as connection:
        drawn = draw_over(store, connection, run, greys, read_edges(store, connection, run))
    save_side_by_side(path, list(drawn.values()))


def failing(items: Iterable[Any]) -> list[Any]:
    """Rows of `report/items` that are not as modelled or not confirmed, the worst first."""
    found = [item for item in items if item.state in FAILING]
    return sorted(found, key=lambda it: (FAILING.index(it.state), -it.evidence, it.item_no))


def write_crops(folder: str | Path, store: Store, run: int, greys: Mapping[str, Bytes | Floats]) -> None:
    """Write pictures of the failures, the worst first, at most 50: what each camera shows, then with the model."""
    with store.read() as connection:
        items = store.rows(connection, "report/items", run_id=run)
        edges = read_edges(store, connection, run, items)
        drawn = draw_over(store, connection, run, greys, edges)
    failures = [item for item in failing(items) if item.drawn == item.state]  # by more than its features
    for place, row in enumerate(failures[:_MOST_CROPS], 1):
        pieces: list[Bytes] = []
        mine = set(edges_of(row))
        for name, grey in greys.items():
            own = [e for e in edges.get(name, ()) if (name, e.number) in mine]
            if own:
                u0, v0, u1, v1 = box_about([e.points for e in own], (grey.shape[1], grey.shape[0]))
                pieces += [in_colour(grey[v0:v1, u0:u1]), drawn[name][v0:v1, u0:u1]]
        if pieces:
            words = re.sub(r"[^A-Za-z0-9.-]+", "_", row.path)[-200:]  # a name of a file may have 255 bytes
            save_side_by_side(Path(folder) / f"{place:02d}_{row.state}_{words}.png", pieces)


def box_about(courses: Sequence[Floats], size: tuple[int, int]) -> tuple[int, int, int, int]:
    """Bounds u0 v0 u1 v1 (px, half-open) of a piece of a picture (width, height) about points (n, 2), with a margin."""
    points = np.concatenate(courses)
    low, high = points.min(axis=0), points.max(axis=0)
    margin = np.maximum(_MARGIN_PX, (_LEAST_PX - (high - low)) / 2)
    u0, v0 = np.floor(low - margin).clip(0, np.array(size) - 1).astype(int).tolist()
    u1, v1 = np.ceil(high + margin).clip((u0 + 1, v0 + 1), size).astype(int).tolist()
    return u0, v0, u1, v1
