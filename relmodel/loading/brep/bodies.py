"""Bodies that are worked on together: whose the rows of their common tables are, and the tables of each."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from relmodel.columns import part
from relmodel.geometry.curves import BOX
from relmodel.model.model import Table

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.int64]

# Of tables of a `Shape`: what numbers its rows, the column that holds the number (None: rows are in its order), and
# columns with numbers of others.
_NUMBERS: dict[str, tuple[str, str | None, dict[str, str]]] = {
    "surfaces": ("surface", None, {}),
    "surface_splines": ("surface", "surface_no", {}),
    "surface_swept": ("surface", "surface_no", {"basis_arc": "basis_arc", "basis_surface": "basis_surface"}),
    "arcs": ("arc", None, {"surface_a": "surface", "surface_b": "surface"}),
    "arc_splines": ("arc", "arc_no", {}),
    "arc_offsets": ("arc", "arc_no", {"basis_arc": "basis_arc"}),
    "loops": ("surface", "surface_no", {}),
    "coedges": ("surface", "surface_no", {"arc_no": "arc"}),
    "pcurves": ("surface", "surface_no", {}),
    "samples": ("arc", "arc_no", {}),
    "basis_arcs": ("basis_arc", None, {}),
    "basis_arc_splines": ("basis_arc", "arc_no", {}),
    "basis_arc_offsets": ("basis_arc", "arc_no", {"basis_arc": "basis_arc"}),
    "basis_surfaces": ("basis_surface", None, {}),
    "basis_surface_splines": ("basis_surface", "surface_no", {}),
    "basis_surface_swept": (
        "basis_surface",
        "surface_no",
        {"basis_arc": "basis_arc", "basis_surface": "basis_surface"},
    ),
}


@dataclass(frozen=True)
class Bodies:
    """surface, arc, basis_surface, basis_arc: (k + 1,) first rows of each body in tables of these, and their ends."""

    surface: Index
    arc: Index
    basis_surface: Index
    basis_arc: Index

    def __len__(self) -> int:
        return len(self.surface) - 1

    @cached_property
    def of_surface(self) -> Index:
        """The body of each surface."""
        return np.repeat(np.arange(len(self)), np.diff(self.surface))

    @cached_property
    def of_arc(self) -> Index:
        """The body of each arc."""
        return np.repeat(np.arange(len(self)), np.diff(self.arc))

    def extents(self, of: Index, columns: Table) -> tuple[Array, Array]:
        """Least and greatest coordinates (k, 3) of what is of the bodies `of` (n,), by its columns of boxes."""
        low, high = np.full((3, len(self)), np.inf), np.full((3, len(self)), -np.inf)
        for i in range(3):
            np.minimum.at(low[i], of, columns[BOX[i]])
            np.maximum.at(high[i], of, columns[BOX[i + 3]])
        return low.T, high.T

    def apart(self, tables: dict[str, Table]) -> list[dict[str, Table]]:
        """The tables of each body, with its own numbers; keyed rows are given in order of their keys."""
        out: list[dict[str, Table]] = [{} for _ in range(len(self))]
        for name, table in tables.items():
            number, key, others = _NUMBERS[name]
            first: Index = getattr(self, number)
            ends = first if key is None else np.searchsorted(table[key], first)
            shifts = {column: getattr(self, other) for column, other in others.items()}
            if key is not None:
                shifts[key] = first
            for own, (start, stop), i in zip(out, pairwise(ends.tolist()), range(len(self)), strict=True):
                own[name] = part(table, start, stop)
                for column, begins in shifts.items():
                    if not begins[i]:
                        continue
                    numbers = own[name][column]
                    own[name][column] = np.where(numbers < 0, -1, numbers - begins[i])  # -1 is none
        return out
