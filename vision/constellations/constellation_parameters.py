"""Parameters of the join of circles in space, by stereo or of the ellipses of one picture, with those of the model, and
of the poses that it gives: mm, rad."""

from dataclasses import dataclass


@dataclass(frozen=True)
class JoinParameters:
    """Which pairs of circles are alike; sizes and distances are those that a load relates."""

    sigmas: float = 3.0  # standard deviations by which relations may differ
    least_radius_mm: float = 0.3  # mm by which radii may differ, at least
    least_mm: float = 0.8  # mm by which distances of centres may differ, at least
    bin_mm: float = 8.0  # mm by which they may, at most
    least_cosine: float = 0.04  # by which cosines of the angles of normals and connecting line may differ, at least
    most_cosine: float = 0.25  # by which they may, at most
    most_sigma_mm: float = 4.0  # mm: standard deviation of a distance beyond which a relation says nothing
    most_sigma_cosine: float = 0.1  # that of the cosine of normals
    along: float = 0.9  # cosine of normal and connecting line beyond which they leave a turn about both open
    most_of_relation: int = 64  # pairs of the model that a relation is joined with, evenly among all it is like
    most: int = 20_000  # joined pairs, the rarest first, after which no further pair of circles is taken


@dataclass(frozen=True)
class LineParameters:
    """Which pairs of straight edges are alike."""

    least_length: float = 12.0  # mm: length of an edge, at least
    most_seen: int = 60  # edges in space that are related, the longest
    most_of_object: int = 200  # edges of an object that are, the longest
    greatest_cosine: float = 0.9
    """cosine of the angle of two beyond which they are about parallel, and related to no one"""
    sigmas: float = 3.0  # standard deviations by which distance and cosine may differ
    least_mm: float = 1.5  # mm by which distances may differ, at least
    bin_mm: float = 8.0  # mm by which they may, at most
    least_cosine: float = 0.03  # by which cosines may differ, at least
    most_cosine: float = 0.2  # by which they may, at most
    most_sigma_mm: float = 4.0  # mm: standard deviation of a distance beyond which it says nothing
    most_sigma_cosine: float = 0.1  # that of a cosine
    along_mm: float = 6.0  # mm by which an edge may be seen beyond its ends
    most_of_relation: int = 64  # pairs of the model that a relation is joined with, evenly among all it is like
    most: int = 40_000  # joined pairs, the rarest first, after which no further pair of edges is taken


@dataclass(frozen=True)
class EllipseParameters:
    """Which arcs of one picture are taken for circles, and how well their size and turn are known."""

    least_elements: int = 12  # edge elements of an arc
    least_seen: float = 0.35  # share of the way round that an arc runs
    least_px: float = 3.0  # px: minor semi-axis
    residual_px: float = 1.0  # px: root of the mean square distance of an arc's elements from the ellipse, at most
    size_px: float = 0.25  # px: standard deviation of the major semi-axis
    well_seen: float = 0.6  # share of the way round below which it is `short_px` more
    short_px: float = 0.5  # px
    tilt: tuple[float, float] = (0.02, 0.35)
    """rad: least and greatest standard deviation of the angle at which a circle is seen"""
    same_px: float = 1.5  # px between centres and between major semi-axes of two arcs along one rim
    same_share: float = 0.02  # share of the semi-axis beyond that
    most: int = 30  # ellipses of a picture, those of which most is seen


@dataclass(frozen=True)
class OnePictureParameters:
    """Which pairs of circles that ellipses may be are alike, and which poses of these go on."""

    radius_step: float = 0.1  # mm: radii within it are one
    distance_mm: float = 1.0  # mm by which distances of centres may differ
    distance_share: float = 0.01
    """share of the distance beyond that, and beyond what the sizes of the ellipses leave open"""
    most_mm: float = 20.0  # mm by which they may differ at most
    turn: float = 0.03
    """rad by which the angles of normals and connecting line may differ beyond what size and turn leave open"""
    along: float = 0.9  # cosine of normal and connecting line beyond which they leave a turn about both open
    most_of_relation: int = 64  # pairs of the model that a pair in space is joined with, evenly among all it is like
    most: int = 40_000  # joined pairs, the rarest first, after which no further pair in space is taken
    enough: float = 30.0  # log odds of a pose below which a prior's volume is scanned instead
    points: int = 8  # points of a circle that are fitted to an ellipse
    rounds: int = 4  # steps of that fit
    robust_px: float = 5.0  # px beyond which a point counts less in it
    fit_px: float = 1.2  # px: root of the mean square distance from both ellipses, at most
    fit_share: float = 0.01  # share of the greater semi-axis beyond that
    fit_short_px: float = 1.5  # px beyond that where less than `well_seen` of an ellipse is seen
    well_seen: float = 0.6  # share of the way round
    place_px: float = 3.0  # px: standard deviation of where a circle of the model is seen
    place_share: float = 0.05  # share of the semi-axis beyond that
    size_share: float = 0.04  # standard deviation of its size, as a share
    ratio: float = 0.12  # that of the ratio of the axes
    least_cosine: float = 0.1  # cosine at which a circle is seen, at least
    chance: float = 0.15  # share of the circles in the gate of an ellipse that have its size and ratio by chance
    least_like: float = 0.05  # likeness from which on an ellipse is explained
    fitted: int = 100  # distinct poses of the best score that are fitted to all that they explain
    kept: int = 60  # distinct poses that go on


@dataclass(frozen=True)
class ConstellationParameters:
    """Parameters of finding poses by constellations."""

    join: JoinParameters = JoinParameters()
    lines: LineParameters = LineParameters()
    ellipses: EllipseParameters = EllipseParameters()
    one_picture: OnePictureParameters = OnePictureParameters()


DEFAULTS = ConstellationParameters()
