"""An extraction as rows of the store, and as later stages take it: columns in the digits of the store."""

from __future__ import annotations

import hashlib
import itertools
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import cv2
import numpy as np

from relmodel.arrays import Bools, Columns, ColumnValues, Floats, Ints, Ints32, read_rows, take
from relmodel.store.database import Database, round_columns, stored_fields
from relmodel.store.runs import Run
from vision.extraction import arcs as arc_columns
from vision.extraction import junctions as junction_columns
from vision.extraction.arcs import CIRCULAR, ELLIPTIC, FREE, KINDS, LINE, Arcs, ArcShapes, concatenate
from vision.extraction.edges import ElementShapes
from vision.extraction.extract import VERSION, Extraction
from vision.extraction.extraction_parameters import ExtractionParameters
from vision.extraction.junction_candidates import AT
from vision.extraction.junctions import snap_polylines
from vision.extraction.regions import RegionShapes
from vision.extraction.topography import ArcQuality

if TYPE_CHECKING:
    from sqlalchemy import Connection

    from vision.cameras.images import Picture


def find_regions_at(picture: Primitives, pixel: Floats) -> Ints:
    """The region (n,) at pixels (n, 2), -1 for none: outlines are filled, holes left out, the innermost wins."""
    regions, (rows, columns) = picture.regions, picture.shape
    drawn = np.full((rows, columns), -1, np.int32)
    rings = [regions.outline[a:b].astype(np.int32) for a, b in itertools.pairwise(regions.ring_offsets.tolist())]
    outer = np.flatnonzero(np.diff(regions.ring_region, prepend=-1) != 0)
    # What lies in a hole is a region of its own, smaller than the one around it.
    for ring in outer[np.argsort(-regions.area[regions.ring_region[outer]], kind="stable")].tolist():
        cv2.fillPoly(drawn, [rings[ring]], int(regions.ring_region[ring]))
    x, y = np.rint(pixel).astype(np.int64).T
    inside = (x >= 0) & (x < columns) & (y >= 0) & (y < rows)
    return np.where(inside, drawn[np.where(inside, y, 0), np.where(inside, x, 0)], -1)


# What later stages take of an extraction: columns in the digits of the store, whether just made or read again.


@dataclass(frozen=True)
class ElementColumns(ElementShapes):
    """Edge elements (n,): place and unit normal toward the bright side, px; contrast, grey; width and sigma, px; arc,
    -1 for none.  Those of an arc follow each other along it, arc by arc, before all others."""

    arc: Ints


@dataclass(frozen=True)
class ArcColumns(ArcShapes):
    """Arcs (n,) as image_arc has them; kind indexes `arcs.KINDS`; texture, highlight: what speaks against them, 0..1.
    The elements of arc i are offsets[i] to offsets[i + 1] of the elements."""

    texture: Floats
    highlight: Floats
    offsets: Ints


@dataclass(frozen=True)
class Courses:
    """The courses of all arcs, packed: arc i runs through offsets[i] to offsets[i + 1] of points (m, 2), px;
    bright_left (m,): whether the bright side lies left of the walk there."""

    offsets: Ints
    points: Floats
    bright_left: Bools


@dataclass(frozen=True)
class RegionColumns(RegionShapes):
    """Regions (n,) as image_region has them, their rings, and the arcs that border them.

    Points of ring r are ring_offsets[r] to ring_offsets[r + 1] of `outline` (m, 2), px; ring_region (rings,): whose;
    the first ring of a region is the outer one.  border_region, border_arc, border_length (b,): length px."""

    outline: Ints
    border_region: Ints
    border_arc: Ints
    border_length: Floats


@dataclass(frozen=True)
class Primitives:
    """The arcs, regions and edge elements of a picture of `shape` (rows, columns); grey_range: between the grey levels
    that 1 % of the picture are below and above, 0..255."""

    shape: tuple[int, int]
    grey_range: float
    elements: ElementColumns
    arcs: ArcColumns
    regions: RegionColumns
    tables: Mapping[str, Mapping[str, Any]]

    @classmethod
    def of(cls, shape: tuple[int, int], tables: Mapping[str, Mapping[str, Any]]) -> Primitives:
        """From the rows of an extraction, in the order of their numbers."""
        head, edge, arc = tables["extraction"], tables["edge_element"], tables["image_arc"]
        owner = np.nan_to_num(np.ma.filled(edge["image_arc_no"], -1), nan=-1).astype(np.int64)
        edges_only = np.flatnonzero(arc["topography"] == "edge")
        return cls(
            shape=shape,
            grey_range=float(head["grey_bright"][0]) - float(head["grey_dark"][0]),
            elements=read_rows(ElementColumns, edge, nx=edge["normal_x"], ny=edge["normal_y"], arc=owner),
            arcs=read_rows(
                ArcColumns,
                take(arc, edges_only),
                kind=np.array([KINDS.index(kind) for kind in arc["kind"][edges_only]], np.int64),
                offsets=np.searchsorted(owner[: int((owner >= 0).sum())], np.arange(len(edges_only) + 1)),
            ),
            regions=_regions(tables),
            tables=tables,
        )

    @property
    def relations(self) -> dict[str, Any]:
        """Columns of unit_relation, the set left out."""
        return dict(self.tables["unit_relation"])

    @property
    def arc_elements(self) -> dict[str, Any]:
        """Columns of edge_element for the elements that are of arcs, the extraction left out."""
        count = int(self.arcs.offsets[-1])
        return {name: values[:count] for name, values in self.tables["edge_element"].items()}

    @cached_property
    def courses(self) -> Courses:
        """Free arcs run as their points say; of the others the elements are moved onto the fitted curve."""
        arcs, e = self.arcs, self.elements
        points = self.tables["image_arc_point"]
        of_point = np.asarray(points["image_arc_no"], np.int64)
        free = arcs.kind == FREE
        of_point_kept = (of_point < len(arcs)) & np.append(free, False)[np.minimum(of_point, len(arcs))]
        of_element = np.arange(arcs.offsets[-1] if len(arcs) else 0)
        owner = e.arc[of_element]
        of_element, owner = of_element[~free[owner]], owner[~free[owner]]
        place = _on_curve(arcs, owner, np.column_stack([e.x, e.y])[of_element])
        left = np.ones(len(of_element), bool)
        line = arcs.kind[owner] == LINE
        walk = np.column_stack([arcs.end_x - arcs.start_x, arcs.end_y - arcs.start_y])[owner]
        left[line] = (e.nx[of_element] * walk[:, 1] - e.ny[of_element] * walk[:, 0])[line] >= 0
        both = np.concatenate([owner, of_point[of_point_kept]])
        order = np.argsort(both, kind="stable")
        course = np.column_stack([points["x"], points["y"]])[of_point_kept]
        return Courses(
            np.searchsorted(both[order], np.arange(len(arcs) + 1)),
            np.concatenate([place, course])[order],
            np.concatenate([left, np.ones(len(course), bool)])[order],
        )


def _on_curve(arcs: ArcColumns, arc: Ints, place: Floats) -> Floats:
    """Places (n, 2) moved to the lines, circles and ellipses that they belong to; along the ray from the centre."""
    out = place.copy()
    start = np.column_stack([arcs.start_x, arcs.start_y])[arc]
    walk = np.column_stack([arcs.end_x, arcs.end_y])[arc] - start
    share = np.sum((place - start) * walk, axis=1) / np.maximum(np.sum(walk**2, axis=1), 1e-12)
    line = arcs.kind[arc] == LINE
    out[line] = (start + share[:, None] * walk)[line]
    centre = np.column_stack([arcs.centre_x, arcs.centre_y])[arc]
    round_ = np.isin(arcs.kind[arc], (CIRCULAR, ELLIPTIC))
    turn = np.nan_to_num(arcs.axis_angle[arc])
    axis = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    away = place - centre
    u = np.sum(away * axis, axis=1) / arcs.radius[arc]
    v = (away[:, 1] * axis[:, 0] - away[:, 0] * axis[:, 1]) / np.where(
        arcs.kind[arc] == ELLIPTIC, arcs.radius2[arc], arcs.radius[arc]
    )
    out[round_] = (centre + away / np.hypot(u, v)[:, None])[round_]
    return out


def _regions(tables: Mapping[str, Mapping[str, Any]]) -> RegionColumns:
    region, ring, border = tables["image_region"], tables["region_outline"], tables["region_arc"]
    of, arc = (np.asarray(border[name], np.int64) for name in ("region_no", "image_arc_no"))
    order = np.lexsort([np.asarray(border["side"]) == "right", arc, of])
    of_point = np.stack([np.asarray(ring["region_no"], np.int64), np.asarray(ring["ring_no"], np.int64)], axis=1)
    first = np.flatnonzero((np.diff(of_point, axis=0, prepend=-1) != 0).any(axis=1))
    return read_rows(
        RegionColumns,
        region,
        ring_region=of_point[first, 0],
        ring_offsets=np.append(first, len(of_point)),
        outline=np.column_stack([np.asarray(ring["x"], np.int64), np.asarray(ring["y"], np.int64)]),
        border_region=of[order],
        border_arc=arc[order],
        border_length=border["length"][order],
    )


# An extraction as rows of schema/070 and schema/080, in the digits that the store keeps.
#
# Later stages read these rows (`primitives`), never the extraction itself: a fresh extraction and a stored one give
# them the same.

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
    ring_no = np.arange(len(regions.ring_region)) - np.searchsorted(regions.ring_region, regions.ring_region)
    ring, point_no = _members(regions.ring_offsets)
    borders, junctions = extraction.region_arcs, extraction.junctions
    with_ridges = concatenate([arcs, extraction.ridge_arcs])
    # Where arcs that run nearly alike meet is next to unknown along them: rounded, that stays a covariance.
    xx, xy, yy = (junctions.covariance[:, i, j] for i, j in ((0, 0), (0, 1), (1, 1)))
    most = (1 - 1e-6) * np.sqrt(xx * yy)
    return {
        "extraction": {name: np.array([getattr(extraction, name)]) for name in ("grey_dark", "grey_bright")},
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
            "xx": xx,
            "xy": np.clip(xy, -most, most),
            "yy": yy,
        },
        "image_junction_arc": {
            "junction_no": junctions.junction,
            "image_arc_no": junctions.arc,
            "meets_with": np.array(AT, dtype=object)[junctions.at],
        },
        "image_region": {
            "region_no": np.arange(len(regions), dtype=np.int32),
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
    quality = ArcQuality.stack([extraction.quality, extraction.ridge_quality])
    least = extraction.parameters.quality.min_recorded
    return {
        "image_arc_no": np.arange(len(arcs), dtype=np.int32),
        **stored_fields("image_arc", arcs),
        "kind": np.array(arc_columns.KINDS, dtype=object)[arcs.kind],
        "topography": np.array(["edge", "ridge", "ravine"], dtype=object)[kinds],
        "sigma": np.maximum(arcs.sigma, _LEAST_SIGMA),
        **{name: np.where(value >= least, value, 0.0) for name, value in quality.columns().items()},
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


def _units(extraction: Extraction) -> dict[str, Columns]:
    """Columns of unit and unit_relation, `unit_set_id` left out."""
    arcs, regions, found = len(extraction.arcs), len(extraction.regions), extraction.relations
    return {
        "unit": {
            "unit_no": np.arange(arcs + regions, dtype=np.int32),
            "kind": np.repeat(np.array(["arc", "region"], dtype=object), [arcs, regions]),
            "ref_no": np.concatenate([np.arange(arcs), np.arange(regions)]).astype(np.int32),
        },
        "unit_relation": found.rows(),
    }


def _members(offsets: Ints32) -> tuple[Ints32, Ints32]:
    """Of the members of packed groups: which group each is of, and its ordinal there."""
    group = np.repeat(np.arange(len(offsets) - 1, dtype=np.int32), np.diff(offsets))
    return group, (np.arange(len(group)) - offsets[group]).astype(np.int32)


# An extraction in the store: written once, read by its content.

# The tables of its primitives, in the order in which later stages take their rows.
_ORDER = {
    "edge_element": "edge_element_no",
    "image_arc": "image_arc_no",
    "image_arc_point": "image_arc_no point_no",
    "image_region": "region_no",
    "region_outline": "region_no ring_no point_no",
    "region_arc": "region_no image_arc_no side",
}
# The tables that refer to the set of units, not to the extraction.
_OF_UNITS = ("unit", "unit_relation")


@dataclass(frozen=True)
class RecordedExtraction:
    """Identities of an extraction and of its set of units (arcs by number first, then regions)."""

    extraction_id: int
    unit_set_id: int


def content_key(picture: Picture, parameters: ExtractionParameters) -> str:
    """What makes two extractions the same: image, the bits that were taken of it, parameters and version."""
    bits = "" if picture.bits == picture.depth else f" {picture.bits} bits"
    return hashlib.sha256(f"{picture.sha256}{bits} {parameters.to_json()} {VERSION}".encode()).hexdigest()


def find_extraction(
    store: Database, connection: Connection, picture: Picture, parameters: ExtractionParameters
) -> RecordedExtraction | None:
    """The extraction of that picture with those parameters, if the store holds it."""
    key = content_key(picture, parameters)
    for extraction_id in store.select(connection, "extraction", "id", content_key=key)["id"].tolist():
        unit_sets = store.select(connection, "unit_set", "id", extraction_id=extraction_id)["id"]
        return RecordedExtraction(extraction_id, int(unit_sets[0]))
    return None


def read_primitives(store: Database, connection: Connection, extraction_id: int) -> Primitives:
    """What later stages take of an extraction."""
    head = store.select(connection, "extraction", "image_id", "grey_dark", "grey_bright", id=extraction_id)
    image = store.select(connection, "image", "height", "width", id=int(head["image_id"][0]))
    units = store.select(connection, "unit_set", "id", extraction_id=extraction_id)
    tables = {
        table: store.select(connection, table, order=order, extraction_id=extraction_id)
        for table, order in _ORDER.items()
    }
    relations = store.select(connection, "unit_relation", order="kind unit_a unit_b", unit_set_id=int(units["id"][0]))
    shape = int(image["height"][0]), int(image["width"][0])
    return Primitives.of(shape, {**tables, "extraction": head, "unit_relation": relations})


def record_extraction(
    run: Run, connection: Connection, image_id: int, picture: Picture, parameters: ExtractionParameters, tables: Tables
) -> RecordedExtraction:
    """Append all rows of an extraction of image `image_id`; where the store holds the same already, its identities."""
    if not run.is_rehearsal and (found := find_extraction(run.store, connection, picture, parameters)):
        return found
    extraction_id = int(run.new_ids(connection, "extraction", 1)[0])
    unit_set_id = int(run.new_ids(connection, "unit_set", 1)[0])
    head: Columns = {
        "id": [extraction_id],
        "image_id": image_id,
        "content_key": content_key(picture, parameters),
        "bits": picture.bits,
        "bits_from": picture.bits_from,
        "parameters": parameters.to_json(),
        "version": VERSION,
        **tables["extraction"],
    }
    with run.store.one_thread():
        run.append(connection, "extraction", head)
        run.append(connection, "unit_set", {"id": [unit_set_id], "kind": "extraction", "extraction_id": extraction_id})
        for table, columns in tables.items():
            if table in _OF_UNITS:
                run.append(connection, table, {"unit_set_id": unit_set_id, **columns})
            elif table != "extraction":
                run.append(connection, table, {"extraction_id": extraction_id, **columns})
    return RecordedExtraction(extraction_id, unit_set_id)
