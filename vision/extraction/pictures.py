"""Pictures of an extraction, one a stage, for people to look at."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from relmodel.arrays import Bytes, Floats
from relmodel.drawing.colours import Rgb
from relmodel.drawing.strokes import Stroke, draw, in_colour, with_key
from vision.extraction.arcs import KINDS as _KINDS
from vision.extraction.edges import EdgeElements
from vision.extraction.end_points import snap_polylines
from vision.extraction.extract import Extraction
from vision.extraction.junctions import KINDS as _JUNCTIONS
from vision.extraction.linking import Chains, link
from vision.extraction.topography import LABELS
from vision.relations.relations import KINDS as _RELATIONS

# RGB, of the kinds of arcs in their order, of the topographic labels, of relations and kinds of junctions.
_KIND_COLOURS = ((235, 60, 40), (40, 120, 255), (240, 190, 30), (30, 190, 90))
_TEXTURE_COLOUR = (150, 150, 150)
_RIDGE_COLOUR = (255, 120, 0)
_LABEL_COLOURS = {
    "peak": (255, 255, 255),
    "pit": (0, 0, 0),
    "saddle": (200, 0, 200),
    "ridge": (255, 220, 60),
    "ravine": (40, 60, 200),
    "inflection": (230, 40, 40),
    "flat": (120, 120, 120),
    "slope": (160, 170, 160),
    "convex": (90, 150, 200),
    "concave": (210, 160, 110),
    "saddle_hill": (180, 120, 180),
}
_RELATION_COLOURS = {
    "parallel": (40, 120, 255),
    "junction": (235, 60, 40),
    "concentric": (170, 40, 200),
    "equal_radius": (240, 150, 30),
}
_JUNCTION_COLOURS = ((30, 160, 80), (0, 190, 200), (40, 120, 255), (170, 40, 200), (240, 150, 30))


def draw_stage(grey: Floats, extraction: Extraction, stage: str) -> Bytes:
    """What `stage`, one of `STAGES`, found in `grey` (rows, columns; 0..255): (rows, columns, 3), RGB."""
    return STAGES[stage][0](grey, extraction)


def count_of_stage(extraction: Extraction, stage: str) -> int:
    """How many elements, chains, arcs, junctions, regions, labelled pixels or relations the stage gave."""
    return STAGES[stage][1](extraction)


def _edges(grey: Floats, found: Extraction) -> Bytes:
    """Edge elements, the brighter the higher the step."""
    canvas = np.zeros(found.shape, np.uint8)
    canvas.reshape(-1)[found.edges.pixel] = np.clip(60 + 2.5 * found.edges.contrast, 0, 255).astype(np.uint8)
    return np.repeat(canvas[..., None], 3, axis=2)


def _linked(found: Extraction) -> Chains:
    p = found.parameters.linking
    return link(found.edges, found.shape, p, min_contrast=p.min_contrast)


def _draw_chains(grey: Floats, found: Extraction, chains: Chains) -> Bytes:
    """Chains, each in a colour of its own, over the faded picture."""
    return _strokes(_faded(grey), found.edges, chains, [(r, g, b) for r, g, b in _palette(len(chains)).tolist()])


def _arcs(grey: Floats, found: Extraction) -> Bytes:
    """Arcs by kind; grey those that are more likely texture than edges."""
    surely_edge = found.quality.texture <= 0.5
    kinds = found.arcs.kind.tolist()
    colours = [_KIND_COLOURS[k] if edge else _TEXTURE_COLOUR for k, edge in zip(kinds, surely_edge, strict=True)]
    canvas = _strokes(np.full((*found.shape, 3), 255, np.uint8), found.edges, found.arcs.chains, colours)
    return with_key(canvas, {**dict(zip(_KINDS, _KIND_COLOURS, strict=True)), "likely texture": _TEXTURE_COLOUR})


def _regions(grey: Floats, found: Extraction) -> Bytes:
    """Regions, each in a colour of its own, separated by white lines; black where there is none."""
    labels = found.regions.labels
    canvas = np.concatenate([_palette(len(found.regions)), np.zeros((1, 3), np.uint8)])[labels]
    canvas[:-1][labels[:-1] != labels[1:]] = 255
    canvas[:, :-1][labels[:, :-1] != labels[:, 1:]] = 255
    return np.asarray(canvas)


def _topography(grey: Floats, found: Extraction) -> Bytes:
    """The label of every pixel, and the arcs along ridges and ravines; grey those that are more likely texture."""
    canvas = np.array([_LABEL_COLOURS[name] for name in LABELS], dtype=np.uint8)[found.labels]
    colours = [_TEXTURE_COLOUR if texture else _RIDGE_COLOUR for texture in found.ridge_quality.texture > 0.5]
    canvas = _strokes(canvas, found.ridges.elements, found.ridge_arcs.chains, colours)
    return with_key(canvas, {**_LABEL_COLOURS, "ridge lines": _RIDGE_COLOUR, "likely texture": _TEXTURE_COLOUR})


def _junctions(grey: Floats, found: Extraction) -> Bytes:
    """Arcs, their ends closed, and dots where they meet."""
    import cv2

    polyline, offsets = snap_polylines(found.arcs, found.junctions, found.parameters.junctions)
    points = np.column_stack([polyline.x, polyline.y])
    canvas = draw(_faded(grey), [Stroke(np.split(points, offsets[1:-1]), _TEXTURE_COLOUR, 2)])
    places = np.rint(np.column_stack([found.junctions.x, found.junctions.y]) * 16).astype(np.int32)
    for place, kind in zip(places.tolist(), found.junctions.kind.tolist(), strict=True):
        cv2.circle(canvas, place, 3 * 16, _JUNCTION_COLOURS[kind], -1, cv2.LINE_AA, 4)  # in sixteenths of a pixel
    return with_key(canvas, dict(zip(_JUNCTIONS, _JUNCTION_COLOURS, strict=True)))


def _relations(grey: Floats, found: Extraction) -> Bytes:
    """Arcs; lines between the middles of those that are parallel or meet, and between the centres of those that are
    concentric or of equal radius."""
    canvas = _strokes(_faded(grey), found.edges, found.arcs.chains, [_TEXTURE_COLOUR] * len(found.arcs))
    arcs, related = found.arcs, found.relations
    middle = np.column_stack([arcs.start_x + arcs.end_x, arcs.start_y + arcs.end_y]) / 2
    centre = np.column_stack([arcs.centre_x, arcs.centre_y])
    lines = []
    for name, colour in _RELATION_COLOURS.items():
        pairs = np.flatnonzero((related.kind == _RELATIONS.index(name)) & (related.a < related.b))
        place = middle if name in ("parallel", "junction") else centre
        lines.append(Stroke(list(np.stack([place[related.a[pairs]], place[related.b[pairs]]], axis=1)), colour))
    return with_key(draw(canvas, lines), _RELATION_COLOURS)


def _faded(grey: Floats) -> Bytes:
    return in_colour(170 + np.clip(grey, 0, 255) / 3)


def _palette(count: int) -> Bytes:
    """(count, 3) colours far apart for neighbours in number: hues by the golden section."""
    hue = np.modf(np.arange(count) * 0.618033988749895)[0][:, None] * 2 * np.pi
    wave = np.cos(hue - np.array([0.0, 2.0, 4.0]) * np.pi / 3)
    light = 150 + 40 * np.cos(np.arange(count) * 2.4)[:, None]
    return np.asarray(np.clip(light + 65 * wave, 0, 255).astype(np.uint8))


def _strokes(canvas: Bytes, elements: EdgeElements, chains: Chains, colours: Sequence[Rgb]) -> Bytes:
    courses = np.split(np.column_stack([elements.x, elements.y])[chains.elements], chains.offsets[1:-1])[: len(colours)]
    each = zip(courses, colours, chains.closed.tolist(), strict=True)
    return draw(canvas, [Stroke([course], colour, 2, closed) for course, colour, closed in each])


STAGES: dict[str, tuple[Callable[[Floats, Extraction], Bytes], Callable[[Extraction], int]]] = {
    "edges": (_edges, lambda found: len(found.edges)),
    "linking": (lambda grey, found: _draw_chains(grey, found, _linked(found)), lambda found: len(_linked(found))),
    "filling": (lambda grey, found: _draw_chains(grey, found, found.chains), lambda found: len(found.chains)),
    "arcs": (_arcs, lambda found: len(found.arcs)),
    "junctions": (_junctions, lambda found: len(found.junctions)),
    "regions": (_regions, lambda found: len(found.regions)),
    "topography": (_topography, lambda found: int((found.regions.labels >= 0).sum())),
    "relations": (_relations, lambda found: len(found.relations)),
}
