"""What later stages take of an extraction: columns in the digits of the store, whether just made or read again."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from relmodel.arrays import Bools, Floats, Ints
from relmodel.columns import Rows, part, read_rows, take
from vision.extraction.arcs import CIRCULAR, ELLIPTIC, FREE, KINDS, LINE


@dataclass(frozen=True)
class Elements(Rows):
    """Edge elements (n,): place and unit normal toward the bright side, px; contrast, grey; width and sigma, px; arc,
    -1 for none.  Those of an arc follow each other along it, arc by arc, before all others."""

    x: Floats
    y: Floats
    nx: Floats
    ny: Floats
    contrast: Floats
    width: Floats
    sigma: Floats
    arc: Ints


@dataclass(frozen=True)
class ArcColumns:
    """Arcs (n,) as image_arc has them; kind indexes `arcs.KINDS`; texture, highlight: what speaks against them, 0..1.
    The elements of arc i are offsets[i] to offsets[i + 1] of the elements."""

    kind: Ints
    start_x: Floats
    start_y: Floats
    end_x: Floats
    end_y: Floats
    centre_x: Floats
    centre_y: Floats
    radius: Floats
    radius2: Floats
    axis_angle: Floats
    length: Floats
    closed: Bools
    contrast: Floats
    width: Floats
    sigma: Floats
    residual: Floats
    significance: Floats
    texture: Floats
    highlight: Floats
    offsets: Ints

    def __len__(self) -> int:
        return len(self.kind)


@dataclass(frozen=True)
class Courses:
    """The courses of all arcs, packed: arc i runs through offsets[i] to offsets[i + 1] of points (m, 2), px;
    bright_left (m,): whether the bright side lies left of the walk there."""

    offsets: Ints
    points: Floats
    bright_left: Bools


@dataclass(frozen=True)
class RegionColumns:
    """Regions (n,) as image_region has them, their rings, and the arcs that border them.

    Points of ring r are ring_offsets[r] to ring_offsets[r + 1] of `outline` (m, 2), px; ring_region (rings,): whose;
    the first ring of a region is the outer one.  border_region, border_arc, border_length (b,): length px.
    """

    area: Floats
    centroid_x: Floats
    centroid_y: Floats
    x0: Floats
    y0: Floats
    x1: Floats
    y1: Floats
    mean: Floats
    variance: Floats
    saturated_share: Floats
    ring_region: Ints
    ring_offsets: Ints
    outline: Ints
    border_region: Ints
    border_arc: Ints
    border_length: Floats

    def __len__(self) -> int:
        return len(self.area)


@dataclass(frozen=True)
class Primitives:
    """The arcs, regions and edge elements of a picture of `shape` (rows, columns); grey_range: between the grey levels
    that 1 % of the picture are below and above, 0..255."""

    shape: tuple[int, int]
    grey_range: float
    elements: Elements
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
            elements=read_rows(Elements, edge, nx=edge["normal_x"], ny=edge["normal_y"], arc=owner),
            arcs=read_rows(
                ArcColumns,
                take(arc, edges_only),
                kind=_codes(arc["kind"][edges_only], KINDS),
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
        return part(self.tables["edge_element"], 0, int(self.arcs.offsets[-1]))

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
    (of, arc, _), order = _in_order(border["region_no"], border["image_arc_no"], np.asarray(border["side"]) == "right")
    of_point = np.stack([np.asarray(ring["region_no"], np.int64), np.asarray(ring["ring_no"], np.int64)], axis=1)
    first = np.flatnonzero((np.diff(of_point, axis=0, prepend=-1) != 0).any(axis=1))
    return read_rows(
        RegionColumns,
        region,
        ring_region=of_point[first, 0],
        ring_offsets=np.append(first, len(of_point)),
        outline=np.column_stack([np.asarray(ring["x"], np.int64), np.asarray(ring["y"], np.int64)]),
        border_region=of,
        border_arc=arc,
        border_length=border["length"][order],
    )


def _codes(words: Any, names: tuple[str, ...]) -> Ints:
    words = np.asarray(words)
    out = np.zeros(len(words), np.int64)
    for code, name in enumerate(names):
        out[words == name] = code
    return out


def _in_order(*columns: Any) -> tuple[list[Ints], Ints]:
    """Columns of integers in the order of their rows, the first column first, and that order."""
    table = [np.asarray(column, np.int64) for column in columns]
    order = np.lexsort(table[::-1])
    return [column[order] for column in table], order
