"""The fused pass: from a picture to edge elements, arcs, regions, topography and relations."""

import hashlib
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from time import perf_counter

import numpy as np
import numpy.typing as npt

from relmodel.arrays import Bools, Bytes, Floats
from relmodel.errors import InputError
from vision.extraction.arc_quality import ArcQuality, assess_arcs, assess_ridge_arcs
from vision.extraction.arcs import Arcs, measure_arcs
from vision.extraction.edge_mask import draw_edge_mask
from vision.extraction.edges import EdgeElements, detect_edges, to_grey
from vision.extraction.end_points import snap_end_points
from vision.extraction.extraction_parameters import ExtractionParameters
from vision.extraction.junctions import Junctions, find_junctions
from vision.extraction.linking import Chains, fill_gaps, link
from vision.extraction.noise import estimate_noise
from vision.extraction.regions import Regions, find_leak_proof_regions, find_plain_regions
from vision.extraction.relations import RegionArcs, find_region_arcs, find_relations
from vision.extraction.segmentation import segment_chains
from vision.extraction.significance import compute_false_alarm_terms, compute_significance, select_significant
from vision.extraction.topography import Ridges, fit_ridge_arcs, label_topography, mark_inflections
from vision.relations.relations import Relations

VERSION = "16"  # raised whenever equal pictures and parameters give other primitives than before

# The kernels of an extraction.
KERNELS = (
    "vision.relations.gap_kernels",
    *(
        f"vision.extraction.{name}_kernels"
        for name in (
            "arc",
            "border",
            "edge",
            "facet",
            "link",
            "polyline",
            "quality",
            "region",
            "significance",
            "topography",
        )
    ),
)


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
    does, and for a mask of another shape or that leaves nothing.
    """
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
    # A second thread does what the path from edges over arcs to regions does not need, or only later.
    with ThreadPoolExecutor(1) as executor:
        # Weak chains are dropped only when the arcs are known: a bridge or a join can make them significant.
        chains = link(edges, shape, p.linking, min_contrast=p.linking.min_contrast)
        chains = chains.take(chains.counts >= p.linking.min_elements)
        scoring = executor.submit(compute_false_alarm_terms, grey, edges, chains.elements, p.significance)
        labelling = executor.submit(_topography, grey, noise, mask, p)
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


def _topography(
    grey: Floats, noise: Floats, mask: Bools | None, p: ExtractionParameters
) -> tuple[Bytes, Ridges, Arcs, ArcQuality]:
    """Labels without inflections, ridges, the arcs along these and their quality."""
    labels, ridges = label_topography(grey, noise, p.topography)
    if mask is not None:
        ridges = ridges.take(mask.reshape(-1)[ridges.elements.pixel])
    ridge_arcs = fit_ridge_arcs(ridges, (grey.shape[0], grey.shape[1]), p)
    return labels, ridges, ridge_arcs, assess_ridge_arcs(grey, ridges.elements, ridge_arcs, p.quality)
