"""An extraction as rows of schema/070 and schema/080, in the digits that the store keeps.

Later stages read these rows (`primitives`), never the extraction itself: a fresh extraction and a stored one give them
the same.
"""

import numpy as np

from relmodel.arrays import Ints32
from relmodel.columns import Columns, ColumnValues
from relmodel.store.rounding import round_columns, stored_fields
from vision.extraction import arcs as arc_columns
from vision.extraction import junctions as junction_columns
from vision.extraction.arcs import Arcs, concatenate
from vision.extraction.end_points import snap_polylines
from vision.extraction.extract import Extraction
from vision.extraction.meetings import AT
from vision.extraction.primitives import Primitives
from vision.relations.relations import KINDS as RELATIONS

Tables = dict[str, dict[str, ColumnValues]]

_LEAST_SIGMA = 0.001  # px: the last digit of the store, so that none becomes 0
_SIDES = np.array(["left", "right"], dtype=object)


def make_rows(extraction: Extraction) -> Tables:
    """Columns of the tables of an extraction, parents before children, the identities of the extraction and of its set
    of units left out; numbers are those that the store gives back."""
    tables = {**_primitives(extraction), **_units(extraction)}
    return {table: round_columns(table, columns) for table, columns in tables.items()}


def make_primitives(extraction: Extraction) -> Primitives:
    """What later stages take of an extraction that no store holds."""
    return Primitives.of(extraction.shape, make_rows(extraction))


def _primitives(extraction: Extraction) -> dict[str, Columns]:
    """Columns of the tables of schema/070."""
    edges, arcs, regions = extraction.edges, extraction.arcs, extraction.regions
    # Arc by arc, then those linked but of no arc, then loose ones that are strong enough to be evidence.
    grey_range = extraction.grey_bright - extraction.grey_dark
    of_no_arc = np.abs(edges.contrast) >= extraction.parameters.edges.kept_share * grey_range
    of_no_arc[extraction.chains.elements] = True
    of_no_arc[arcs.elements] = False
    kept = np.concatenate([arcs.elements, np.flatnonzero(of_no_arc)])
    loose = np.arange(len(kept)) >= len(arcs.elements)
    arc_no = np.ma.masked_array(np.zeros(len(kept), np.int32), loose)
    arc_no[: len(arcs.elements)] = arcs.chains.chain_of_member
    region_no = np.arange(len(regions), dtype=np.int32)
    ring_no = np.arange(len(regions.ring_region)) - np.searchsorted(regions.ring_region, regions.ring_region)
    ring, point_no = _members(regions.ring_offsets)
    borders, junctions = extraction.region_arcs, extraction.junctions
    with_ridges = concatenate([arcs, extraction.ridge_arcs])
    return {
        "extraction": {
            "grey_dark": np.array([extraction.grey_dark]),
            "grey_bright": np.array([extraction.grey_bright]),
        },
        "edge_element": {
            "edge_element_no": np.arange(len(kept), dtype=np.int32),
            "x": edges.x[kept],
            "y": edges.y[kept],
            "normal_x": edges.nx[kept],
            "normal_y": edges.ny[kept],
            "contrast": edges.contrast[kept],
            "width": edges.width[kept],
            "sigma": np.maximum(edges.sigma[kept], _LEAST_SIGMA),
            "image_arc_no": arc_no,
        },
        "image_arc": _arcs(extraction, with_ridges),
        "image_arc_point": _points(extraction, with_ridges),
        "image_junction": {
            "junction_no": np.arange(len(junctions), dtype=np.int32),
            "kind": np.array(junction_columns.KINDS, dtype=object)[junctions.kind],
            "x": junctions.x,
            "y": junctions.y,
            "xx": junctions.covariance[:, 0, 0],
            "xy": junctions.covariance[:, 0, 1],
            "yy": junctions.covariance[:, 1, 1],
        },
        "image_junction_arc": {
            "junction_no": junctions.junction,
            "image_arc_no": junctions.arc,
            "meets_with": np.array(AT, dtype=object)[junctions.at],
        },
        "image_region": {
            "region_no": region_no,
            **stored_fields("image_region", regions),
        },
        "region_outline": {
            "region_no": regions.ring_region[ring],
            "ring_no": ring_no[ring].astype(np.int32),
            "point_no": point_no,
            "x": regions.outline_x.astype(np.int32),
            "y": regions.outline_y.astype(np.int32),
        },
        "region_arc": {
            "region_no": borders.region,
            "image_arc_no": borders.arc,
            "side": _SIDES[borders.side],
            "length": borders.length,
        },
    }


def _arcs(extraction: Extraction, arcs: Arcs) -> Columns:
    """Edge arcs first, numbered as in the extraction; then ridges and ravines, which are no units of matching."""
    ridges = extraction.ridge_arcs
    hollow = extraction.ridges.ravine[ridges.elements[ridges.offsets[:-1]]]
    kinds = np.concatenate([np.zeros(len(extraction.arcs), np.intp), np.where(hollow, 2, 1)])
    return {
        "image_arc_no": np.arange(len(arcs), dtype=np.int32),
        **stored_fields("image_arc", arcs),
        "kind": np.array(arc_columns.KINDS, dtype=object)[arcs.kind],
        "topography": np.array(["edge", "ridge", "ravine"], dtype=object)[kinds],
        "sigma": np.maximum(arcs.sigma, _LEAST_SIGMA),
        **_quality(extraction),
        "element_count": arcs.chains.counts,
    }


def _points(extraction: Extraction, arcs: Arcs) -> Columns:
    """Courses of the free arcs; those of other kinds have a formula."""
    polyline, offsets = snap_polylines(arcs, extraction.junctions, extraction.parameters.junctions)
    arc_no, point_no = _members(offsets)
    free = arcs.kind[arc_no] == arc_columns.FREE
    return {
        "image_arc_no": arc_no[free],
        "point_no": point_no[free],
        "x": polyline.x[free],
        "y": polyline.y[free],
        "sigma": np.maximum(polyline.sigma[free], _LEAST_SIGMA),
    }


def _quality(extraction: Extraction) -> Columns:
    both = extraction.quality, extraction.ridge_quality
    quality = {name: np.concatenate([getattr(part, name) for part in both]) for name in ("texture", "highlight")}
    least = extraction.parameters.quality.min_recorded
    return {name: np.where(value >= least, value, 0.0) for name, value in quality.items()}


def _units(extraction: Extraction) -> dict[str, Columns]:
    """Columns of unit and unit_relation, `unit_set_id` left out."""
    arcs, regions, found = len(extraction.arcs), len(extraction.regions), extraction.relations
    return {
        "unit": {
            "unit_no": np.arange(arcs + regions, dtype=np.int32),
            "kind": np.repeat(np.array(["arc", "region"], dtype=object), [arcs, regions]),
            "ref_no": np.concatenate([np.arange(arcs), np.arange(regions)]).astype(np.int32),
        },
        "unit_relation": {
            "kind": np.array(RELATIONS, dtype=object)[found.kind],
            "unit_a": found.a,
            "unit_b": found.b,
            "distance": found.distance,
            "distance_sigma": found.distance_sigma,
            "angle": found.angle,
            "angle_sigma": found.angle_sigma,
        },
    }


def _members(offsets: Ints32) -> tuple[Ints32, Ints32]:
    """Of the members of packed groups: which group each is of, and its ordinal there."""
    group = np.repeat(np.arange(len(offsets) - 1, dtype=np.int32), np.diff(offsets))
    return group, (np.arange(len(group)) - offsets[group]).astype(np.int32)
