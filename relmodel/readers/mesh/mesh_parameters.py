"""The parameters of reading meshes, a class a stage: every number that decides which surfaces and arcs a mesh gives.

Angles in rad, between facets unless stated otherwise.  Values without a named source were set by judgement,
and hold on tessellations of the STEP files of the tests.
"""

from dataclasses import dataclass, field
from math import radians


@dataclass(frozen=True)
class PatchParameters:
    """Which triangles lie in one plane."""

    flat_rad: float = radians(0.5)  # facets that turn less belong to one plane, if it then is one
    level_rad: float = radians(20)  # facets that turn more do not, however near their corners are


@dataclass(frozen=True)
class FitParameters:
    """How surfaces are fitted to vertices and normals."""

    iterations: int = 10  # steps of a fit; half of them from where another ended
    many_points: int = 150  # points of a group: of more, some are taken
    reaches: tuple[float, float, int] = (0.5, 30, 6)
    """where axes of tori are looked for, in sizes of the group: from, to, and how many"""
    least_radius: float = 0.02  # of a torus, in tubes: else it is a sphere
    most_radius: float = 1e4  # in sizes of the group: beyond, it is flat


@dataclass(frozen=True)
class SegmentParameters:
    """Which patches are of one surface."""

    smooth_rad: float = radians(35)  # facets that turn less may belong to one curved surface
    free_rad: float = radians(20)  # those of a free-form surface turn less
    given_rad: float = 0.05  # how far normals that the source gives may be off
    exact_mm: float = 5e-5
    """mm: as exactly as a surface holds the vertices within it; those on its boundary may be farther off"""
    twist_rad: float = radians(10)  # two single triangles that turn less are a twisted quad, whose diagonal is no edge
    wide: float = 3.0  # how much wider than its smooth neighbours a patch is that is a plane
    long: float = 0.5  # of the longest smooth edge of a patch: across those a curved surface goes on
    spare_points: tuple[int, ...] = (2, 2, 2, 4)
    """points beyond the number of parameters that a cylinder, cone, sphere, torus needs"""
    draws: tuple[int, ...] = (1, 1, 1, 3)  # of seeds, likewise
    bonus: tuple[float, ...] = (1.0, 0.8, 0.6, 0.5)
    """of area, likewise: a simple surface is likelier; rows of a sphere hold little"""
    most_directions: int = 8  # directions that axes are tried along
    rings: tuple[int, ...] = (1, 1, 1, 2, 4, 8, 16, 32, 64, 128)  # of neighbours taken at once
    share_of_sag: float = 0.5  # vertices lie nearer to a surface than this share of the distance of facets' middles
    most_lean_rad: float = 1.2  # between a facet and its surface
    lean: float = 1.5  # and in the greatest angles between its facets
    few: int = 64  # patches: a surface of fewer may be strips of a free-form one
    free_rim: float = 0.3  # share of the rim of such a surface that runs into free-form ones
    few_rim: float = 0.6  # or into those and others of so few patches
    into_free: float = 0.5  # share of the rim of a facet along free-form ones from which it is of them
    least: int = 3  # patches of a curved surface
    alike_rad: float = 2e-3
    """an axis that leans less against one of the part's is that one, where the vertices allow it"""


@dataclass(frozen=True)
class ArcParameters:
    """Where arcs end, what they are, and how they are sampled."""

    corner_rad: float = radians(30)  # a chain that turns more between two edges ends there
    long_run: float = 5.0  # how much longer a line is than the pieces of a curve that it runs into
    circle_points: int = 4  # more than a circle can always be drawn through
    ellipse_points: int = 6  # more than an ellipse can
    share_of_sag: float = 0.1  # points lie nearer to a curve than this share of the distance of chords' middles
    convexity_rad: float = radians(1)  # from which an edge is convex or concave
    sample_mm: float = 1.0  # mm between samples, or a hundredth of a smaller part's diagonal
    most_samples: int = 200_000  # samples of a shape


@dataclass(frozen=True)
class MeshParameters:
    """All of them, a field a stage."""

    patches: PatchParameters = field(default_factory=PatchParameters)
    fit: FitParameters = field(default_factory=FitParameters)
    segments: SegmentParameters = field(default_factory=SegmentParameters)
    arcs: ArcParameters = field(default_factory=ArcParameters)


DEFAULTS = MeshParameters()
