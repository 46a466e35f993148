"""What later stages take of an extraction: columns in the digits of the store, whether just made or read again."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from relmodel.arrays import Bools, Floats, Ints
from vision.extraction.arcs import CIRCULAR, ELLIPTIC, FREE, KINDS, LINE


@dataclass(frozen=True)
class Elements:
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

    TABLES: ClassVar = (
        "extraction", "edge_element", "image_arc", "image_arc_point", "image_region", "region_outline", "region_arc",
        "unit_relation",
    )  # fmt: skip

    @classmethod
    def of(cls, shape: tuple[int, int], tables: Mapping[str, Mapping[str, Any]]) -> Primitives:
        """From the rows of an extraction, in the order of their numbers."""
        head, edge, arc = tables["extraction"], tables["edge_element"], tables["image_arc"]
        owner = np.ma.filled(np.ma.asarray(edge["image_arc_no"]), -1).astype(np.int64)
        edges_only = np.flatnonzero(np.asarray(arc["topography"]) == "edge")
        arc = {name: np.asarray(values)[edges_only] for name, values in arc.items()}
        count = len(edges_only)
        return cls(
            shape=shape,
            grey_range=float(_first(head["grey_bright"])) - float(_first(head["grey_dark"])),
            elements=Elements(
                x=_floats(edge["x"]),
                y=_floats(edge["y"]),
                nx=_floats(edge["normal_x"]),
                ny=_floats(edge["normal_y"]),
                contrast=_floats(edge["contrast"]),
                width=_floats(edge["width"]),
                sigma=_floats(edge["sigma"]),
                arc=owner,
            ),
            arcs=ArcColumns(
                kind=_codes(arc["kind"], KINDS),
                **{name: _floats(arc[name]) for name in (*ARC_FLOATS, "texture", "highlight")},
                closed=np.asarray(arc["closed"], bool),
                offsets=np.searchsorted(owner[: int((owner >= 0).sum())], np.arange(count + 1)),
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
        count, e = int(self.arcs.offsets[-1]), self.elements
        columns = {
            "edge_element_no": np.arange(len(e.x)), "x": e.x, "y": e.y, "normal_x": e.nx, "normal_y": e.ny,
            "contrast": e.contrast, "width": e.width, "sigma": e.sigma, "image_arc_no": e.arc,
        }  # fmt: skip
        return {name: values[:count] for name, values in columns.items()}

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
        course = np.column_stack([_floats(points["x"]), _floats(points["y"])])[of_point_kept]
        return Courses(
            np.searchsorted(both[order], np.arange(len(arcs) + 1)),
            np.concatenate([place, course])[order],
            np.concatenate([left, np.ones(len(course), bool)])[order],
        )


ARC_FLOATS = (
    "start_x", "start_y", "end_x", "end_y", "centre_x", "centre_y", "radius", "radius2", "axis_angle", "length",
    "contrast", "width", "sigma", "residual", "significance",
)  # fmt: skip


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
    return RegionColumns(
        **{name: _floats(region[name]) for name in REGION_FLOATS},
        ring_region=of_point[first, 0],
        ring_offsets=np.append(first, len(of_point)),
        outline=np.column_stack([np.asarray(ring["x"], np.int64), np.asarray(ring["y"], np.int64)]),
        border_region=of,
        border_arc=arc,
        border_length=_floats(border["length"])[order],
    )


REGION_FLOATS = (
    "area", "centroid_x", "centroid_y", "x0", "y0", "x1", "y1", "mean", "variance", "saturated_share",
)  # fmt: skip


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


def _floats(values: Any) -> Floats:
    return np.asarray(values, np.float64)


def _first(values: Any) -> Any:
    return values[0] if np.ndim(values) else values
