"""An extraction written as rows: edge elements, arcs, regions, topography, and the units and relations that matchers
see."""

import hashlib
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from relmodel.arrays import Ints32
from relmodel.columns import Columns, Ragged
from relmodel.store.runs import Run
from vision.extraction import arcs as arc_columns
from vision.extraction import junctions as junction_columns
from vision.extraction import relations as relation_columns
from vision.extraction.arcs import Arcs, concatenate
from vision.extraction.end_points import snap_polylines
from vision.extraction.extract import VERSION, Extraction
from vision.extraction.meetings import AT
from vision.extraction.parameters import ExtractionParameters
from vision.extraction.topography import LABELS

if TYPE_CHECKING:
    from sqlalchemy import Connection

_SIDES = np.array(["left", "right"], dtype=object)


@dataclass(frozen=True)
class RecordedExtraction:
    """Identities of an extraction and of its set of units (arcs by number first, then regions)."""

    extraction_id: int
    unit_set_id: int


def content_key(image_sha256: str, parameters: ExtractionParameters) -> str:
    """What makes two extractions the same: image, parameters and version."""
    return hashlib.sha256(f"{image_sha256} {parameters.to_json()} {VERSION}".encode()).hexdigest()


def find_extraction(
    run: Run, connection: "Connection", image_sha256: str, parameters: ExtractionParameters
) -> RecordedExtraction | None:
    """The extraction of that image with those parameters, if the store holds it."""
    rows = run.store.rows(connection, "extraction_by_key", content_key=content_key(image_sha256, parameters))
    return RecordedExtraction(int(rows[0].id), int(rows[0].unit_set_id)) if rows else None


def record_extraction(
    run: Run, connection: "Connection", image_id: int, image_sha256: str, extraction: Extraction
) -> RecordedExtraction:
    """Append all rows of an extraction of image `image_id`; where the store holds the same already, its identities."""
    found = find_extraction(run, connection, image_sha256, extraction.parameters)
    if found:
        return found
    extraction_id = int(run.store.new_ids(connection, "extraction", 1)[0])
    unit_set_id = int(run.store.new_ids(connection, "unit_set", 1)[0])
    head: Columns = {
        "id": [extraction_id],
        "image_id": image_id,
        "content_key": content_key(image_sha256, extraction.parameters),
        "parameters": extraction.parameters.to_json(),
        "version": VERSION,
        "noise_sigma": extraction.noise_sigma,
    }
    with run.store.one_thread():
        run.append(connection, "extraction", head)
        for table, columns in _primitives(extraction).items():
            run.append(connection, table, {"extraction_id": extraction_id, **columns})
        run.append(connection, "unit_set", {"id": [unit_set_id], "extraction_id": extraction_id})
        for table, columns in _units(extraction).items():
            run.append(connection, table, {"unit_set_id": unit_set_id, **columns})
    return RecordedExtraction(extraction_id, unit_set_id)


def _primitives(extraction: Extraction) -> dict[str, Columns]:
    """Columns of the tables of schema/070, `extraction_id` left out, parents before children."""
    edges, arcs, regions = extraction.edges, extraction.arcs, extraction.regions
    # Arc by arc, then those linked but of no arc; loose elements are not worth their room.
    of_no_arc = np.zeros(len(edges), bool)
    of_no_arc[extraction.chains.elements] = True
    of_no_arc[arcs.elements] = False
    linked = np.concatenate([arcs.elements, np.flatnonzero(of_no_arc)])
    loose = np.arange(len(linked)) >= len(arcs.elements)
    arc_no = np.ma.masked_array(np.zeros(len(linked), np.int32), loose)
    arc_no[: len(arcs.elements)] = arcs.chains.chain_of_member
    region_no = np.arange(len(regions), dtype=np.int32)
    ring_no = np.arange(len(regions.ring_region)) - np.searchsorted(regions.ring_region, regions.ring_region)
    ring, point_no = _members(regions.ring_offsets)
    labelled, label = np.nonzero(extraction.topography)
    borders, junctions = extraction.region_arcs, extraction.junctions
    with_ridges = concatenate([arcs, extraction.ridge_arcs])
    return {
        "edge_element": {
            "edge_element_no": np.arange(len(linked), dtype=np.int32),
            "x": edges.x[linked],
            "y": edges.y[linked],
            "normal_x": edges.nx[linked],
            "normal_y": edges.ny[linked],
            "contrast": edges.contrast[linked],
            "width": edges.width[linked],
            "sigma": edges.sigma[linked],
            "image_arc_no": arc_no,
        },
        "image_arc": _arcs(extraction, with_ridges),
        "image_arc_quality": _quality(extraction),
        "image_arc_point": _points(extraction, with_ridges),
        "image_arc_covariance": _covariances(with_ridges),
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
            "area": regions.area,
            "centroid_x": regions.centroid_x,
            "centroid_y": regions.centroid_y,
            "x0": regions.x0,
            "y0": regions.y0,
            "x1": regions.x1,
            "y1": regions.y1,
            "mean": regions.mean,
            "variance": regions.variance,
            "slope_x": regions.slope_x,
            "slope_y": regions.slope_y,
            "saturated_share": regions.saturated_share,
            "hole_count": regions.hole_count,
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
        "region_topography": {
            "region_no": labelled.astype(np.int32),
            "label": np.array(LABELS, dtype=object)[label],
            "pixels": extraction.topography[labelled, label],
        },
    }


def _arcs(extraction: Extraction, arcs: Arcs) -> Columns:
    """Edge arcs first, numbered as in the extraction; then ridges and ravines, which are no units of matching."""
    ridges = extraction.ridge_arcs
    hollow = extraction.ridges.ravine[ridges.elements[ridges.offsets[:-1]]]
    kinds = np.concatenate([np.zeros(len(extraction.arcs), np.intp), np.where(hollow, 2, 1)])
    return {
        "image_arc_no": np.arange(len(arcs), dtype=np.int32),
        "kind": np.array(arc_columns.KINDS, dtype=object)[arcs.kind],
        "topography": np.array(["edge", "ridge", "ravine"], dtype=object)[kinds],
        "start_x": arcs.start_x,
        "start_y": arcs.start_y,
        "end_x": arcs.end_x,
        "end_y": arcs.end_y,
        "centre_x": arcs.centre_x,
        "centre_y": arcs.centre_y,
        "radius": arcs.radius,
        "radius2": arcs.radius2,
        "axis_angle": arcs.axis_angle,
        "length": arcs.length,
        "closed": arcs.closed,
        "contrast": arcs.contrast,
        "width": arcs.width,
        "sigma": arcs.sigma,
        "residual": arcs.residual,
        "significance": arcs.significance,
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
        "sigma": polyline.sigma[free],
    }


def _covariances(arcs: Arcs) -> Columns:
    """Covariances of the arcs that have one, row by row."""
    known = np.isfinite(arcs.covariance)
    which = np.flatnonzero(known[:, 0, 0])
    offsets = np.concatenate([[0], np.cumsum(known.sum(axis=(1, 2))[which])])
    return {"image_arc_no": which.astype(np.int32), "covariance": Ragged(arcs.covariance[known], offsets)}


def _quality(extraction: Extraction) -> Columns:
    both = extraction.quality, extraction.ridge_quality
    quality = {name: np.concatenate([getattr(part, name) for part in both]) for name in ("texture", "highlight")}
    noted = {
        name: np.flatnonzero(value >= extraction.parameters.quality.min_recorded) for name, value in quality.items()
    }
    return {
        "image_arc_no": np.concatenate(list(noted.values())).astype(np.int32),
        "name": np.repeat(np.array(list(noted), dtype=object), [len(arcs) for arcs in noted.values()]),
        "value": np.concatenate([quality[name][arcs] for name, arcs in noted.items()]),
    }


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
            "kind": np.array(relation_columns.KINDS, dtype=object)[found.kind],
            "unit_a": found.a,
            "unit_b": found.b,
            "value": found.value,
            "sigma": found.sigma,
        },
    }


def _members(offsets: Ints32) -> tuple[Ints32, Ints32]:
    """Of the members of packed groups: which group each is of, and its ordinal there."""
    group = np.repeat(np.arange(len(offsets) - 1, dtype=np.int32), np.diff(offsets))
    return group, (np.arange(len(group)) - offsets[group]).astype(np.int32)
