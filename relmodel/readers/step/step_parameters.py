"""The parameters of reading STEP files, and the finding that an item becomes which cannot be read."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TypeVar

from relmodel.model.model import Finding


@dataclass(frozen=True)
class StepParameters:
    """Triangles, recognition, measures and loops of what the CAD kernel reads."""

    chord_mm: float = 0.05  # mm between triangles and surface
    chord_rad: float = 0.15  # rad between neighbouring chords of a curve
    chord_share: float = 1e-5  # of a part's size: beyond 5 m the chord grows with it, so that its mesh stays bounded
    most_chords: float = 2.0  # deviation of a mesh in chords before it is a finding
    recognition_mm: float = 1e-3  # mm within which a spline lies of the analytic form that it is called by
    torus_side: int = 7  # points each way of the domain that a torus is laid through
    torus_close_side: int = 25  # and that it is checked against
    torus_share: float = 1e-3
    """of the depth of a face within which it is a torus: a shallow face lies near to many surfaces"""
    around: float = 0.25  # of the extent of a domain: a loop whose ends are further apart goes around the surface
    no_turn: float = 1e-6  # rad of a degenerate edge: kernels put such where round-off leaves a gap between two edges
    analytic_error: float = 1e-5  # relative error asked of the kernel's integrals over analytic faces
    spline_error: float = 1e-9  # the same over b-splines, where the kernel reaches some 1e-5 at worst
    once_error: float = 1e-3
    """with which the kernel integrates once between knots; for less it halves, and takes long there"""
    many_knots: int = 16  # knots one way from which that does
    tight_mm: float = 1e-6  # mm by which the kernel's box of a face may fall short of its triangles


DEFAULTS = StepParameters()

# An item of a file that cannot be read becomes a finding, and the rest is read.

Item = TypeVar("Item")
Made = TypeVar("Made")


class Findings(list[Finding]):
    """Findings made on reading."""

    @contextmanager
    def contained(self, what: str, kind: str = "unread_text", surface_no: int | None = None) -> Iterator[None]:
        """Note what fails within as a finding: `what` could not be read."""
        try:
            yield
        except MemoryError:  # a limit, not the item
            raise
        except Exception as error:  # the kernel's exceptions share no base class
            said = f"{what} could not be read ({type(error).__name__}: {error})"
            self.append(Finding(kind, said, surface_no=surface_no))

    def each(self, what: str, items: Iterable[Item], read: Callable[[Item], Made]) -> list[Made]:
        """What `read` returns for each item, but for those that cannot be read."""
        out = []
        for item in items:
            with self.contained(what):
                out.append(read(item))
        return out
