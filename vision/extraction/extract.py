"""The fused pass from a picture to edge elements, arcs, regions, topography, relations; pictures of its stages."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from time import perf_counter

import numpy as np
import numpy.typing as npt

from relmodel.arrays import Bools, Bytes, Floats
from relmodel.drawing.draw import Rgb, Stroke, draw, in_colour, with_key
from relmodel.errors import InputError
from vision.extraction.arcs import KINDS as _KINDS
from vision.extraction.arcs import Arcs, measure_arcs
from vision.extraction.chains import (
    Chains,
    compute_false_alarm_terms,
    compute_significance,
    fill_gaps,
    link,
    select_significant,
)
from vision.extraction.edges import EdgeElements, detect_edges, estimate_noise, to_grey
from vision.extraction.extraction_parameters import ExtractionParameters
from vision.extraction.junctions import KINDS as _JUNCTIONS
from vision.extraction.junctions import Junctions, find_junctions, snap_end_points, snap_polylines
from vision.extraction.regions import Regions, draw_edge_mask, find_leak_proof_regions, find_plain_regions
from vision.extraction.relations import RegionArcs, find_region_arcs, find_relations
from vision.extraction.segmentation import segment_chains
from vision.extraction.topography import (
    LABELS,
    ArcQuality,
    Ridges,
    assess_arcs,
    assess_ridge_arcs,
    fit_ridge_arcs,
    label_topography,
    mark_inflections,
)
from vision.relations.relations import KINDS as _RELATIONS
from vision.relations.relations import Relations

VERSION = "18"  # raised whenever equal pictures and parameters give other primitives than before
# The kernels of an extraction.
KERNELS = ("vision.relations.gap_kernels", *(f"vision.extraction.{name}_kernels" for name in ("arc", "edge", "region")))


@dataclass(frozen=True)
class Extraction:
    """All that was found in one picture of `shape` (rows, columns).

    `noise` (256,) is the noise over grey; `grey_dark` and `grey_bright` are the levels that 1 % of the picture are
    below and above; `edges` are all elements, `chains` those that were linked and kept; `quality`
    says of each arc what speaks against it; `labels` (rows, columns) index `topography.LABELS`; `ridge_arcs` run along
    ridges and ravines, their elements those of `ridges`, their quality `ridge_quality`; `timings_s` says how
    long each stage delayed the next."""

    shape: tuple[int, int]
    parameters: ExtractionParameters
    noise: Floats
    grey_dark: float
    grey_bright: float
    edges: EdgeElements
    chains: Chains
    arcs: Arcs
    junctions: Junctions
    quality: ArcQuality
    regions: Regions
    region_arcs: RegionArcs
    labels: Bytes
    ridges: Ridges
    ridge_arcs: Arcs
    ridge_quality: ArcQuality
    relations: Relations
    timings_s: dict[str, float] = field(compare=False)


_DEFAULTS = ExtractionParameters()


def extract(
    image: npt.ArrayLike, parameters: ExtractionParameters = _DEFAULTS, *, mask: Bools | None = None
) -> Extraction:
    """Extract from a grey image (rows, columns; 8-bit, 16-bit, or float on 0..255).

    With `mask` (rows, columns), what lies where it is false or zero belongs to nothing: no edge element is kept there
    and no region reaches there.  A picture too small for a facet (11 px) or without contrast gives one region and no
    arc.  Deterministic: equal pictures, masks and parameters give equal columns.  Raises InputError as `to_grey`
    does, and for a mask of another shape or that leaves nothing."""
    p = parameters
    timings: dict[str, float] = {}
    clock = perf_counter()

    def lap(stage: str) -> None:
        nonlocal clock
        now = perf_counter()
        timings[stage] = now - clock
        clock = now

    grey = to_grey(image)
    if mask is not None:
        mask = np.asarray(mask, dtype=np.bool_)
        if mask.shape != grey.shape:
            size, (rows, columns) = "x".join(map(str, mask.shape[::-1])), grey.shape
            raise InputError(f"the mask is {size}, the picture {columns}x{rows}: give a mask of the same size")
        if not mask.any():
            raise InputError("the mask leaves nothing of the picture: paint part of it white")
        p = replace(p, mask=hashlib.sha256(np.packbits(mask).tobytes()).hexdigest())
    noise = estimate_noise(grey, p.noise)
    dark, bright = np.percentile(grey[::4, ::4], [1, 99])
    lap("noise")
    edges = detect_edges(grey, p.edges.scale, p.edges, noise=noise)
    if mask is not None:
        edges = edges.take(mask.reshape(-1)[edges.pixel])
    lap("edges")
    shape, scale = (grey.shape[0], grey.shape[1]), p.edges.scale

    def topography() -> tuple[Bytes, Ridges, Arcs, ArcQuality]:
        """Labels without inflections, ridges, the arcs along these and their quality."""
        labels, ridges = label_topography(grey, noise, p.topography)
        if mask is not None:
            ridges = ridges.take(mask.reshape(-1)[ridges.elements.pixel])
        ridge_arcs = fit_ridge_arcs(ridges, shape, p)
        return labels, ridges, ridge_arcs, assess_ridge_arcs(grey, ridges.elements, ridge_arcs, p.quality)

    # A second thread does what the path from edges over arcs to regions does not need, or only later.
    with ThreadPoolExecutor(1) as executor:
        # Weak chains are dropped only when the arcs are known: a bridge or a join can make them significant.
        chains = link(edges, shape, p.linking, min_contrast=p.linking.min_contrast)
        chains = chains.take(chains.counts >= p.linking.min_elements)
        scoring = executor.submit(compute_false_alarm_terms, grey, edges, chains.elements, p.significance)
        labelling = executor.submit(topography)
        chains = fill_gaps(edges, chains, grey, p.linking)
        lap("linking")
        members, kinds, bright_right = segment_chains(edges, chains, scale=scale, p=p.segmentation, fitting=p.fitting)
        terms = scoring.result()
        kept, keeping = select_significant(terms, members, chains, p.significance)
        members, chains = members.take(kept), chains.take(keeping)
        arcs = measure_arcs(edges, members, kinds[kept], bright_right, scale=scale, p=p.fitting)
        arcs = replace(arcs, significance=compute_significance(terms, arcs.chains, p.significance))
        lap("arcs")
        junctions = find_junctions(grey, arcs, p.junctions)
        arcs = snap_end_points(arcs, junctions)
        assessing = executor.submit(assess_arcs, grey, edges, arcs, p.quality)
        lap("junctions")
        barrier = draw_edge_mask(edges, chains, arcs, junctions, shape, p.regions)
        linked = edges.take(np.unique(chains.elements))
        if p.regions.kind == "leak-proof":
            regions = find_leak_proof_regions(grey, barrier, p.regions, inside=mask, edges=linked)
        else:
            regions = find_plain_regions(grey, barrier, p.regions, inside=mask)
        lap("regions")
        labels, ridges, ridge_arcs, ridge_quality = labelling.result()
        mark_inflections(labels, linked.pixel)
        quality = assessing.result()
        lap("topography and quality")
    borders = find_region_arcs(edges, arcs, regions, p.units)
    found = find_relations(arcs, junctions, quality, regions, borders, p)
    lap("relations")
    return Extraction(
        shape,
        p,
        noise,
        float(dark),
        float(bright),
        edges,
        chains,
        arcs,
        junctions,
        quality,
        regions,
        borders,
        labels,
        ridges,
        ridge_arcs,
        ridge_quality,
        found,
        timings,
    )


# Pictures of an extraction, one a stage, for people to look at.

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


def _draw_topography(grey: Floats, found: Extraction) -> Bytes:
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
    """Arcs; lines between middles of those that are parallel or meet, between centres of concentric or equal ones."""
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
    "topography": (_draw_topography, lambda found: int((found.regions.labels >= 0).sum())),
    "relations": (_relations, lambda found: len(found.relations)),
}
"""by stage what draws what it found in a grey picture, 0..255, as RGB (rows, columns, 3), and what counts it"""
