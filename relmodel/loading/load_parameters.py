"""The parameters of a load: what readers and recognition go by, and when numbers count as those of the store."""

from dataclasses import dataclass, field

from relmodel.features.feature_parameters import DEFAULTS as FEATURES
from relmodel.features.feature_parameters import FeatureParameters
from relmodel.readers.mesh.triangles import DEFAULTS as MESH
from relmodel.readers.mesh.triangles import MeshParameters
from relmodel.readers.step.step_parameters import DEFAULTS as STEP
from relmodel.readers.step.step_parameters import StepParameters


@dataclass(frozen=True)
class SnapParameters:
    """Which numbers differ from the store's only by round-off."""

    round_off_mm: float = 2e-6  # mm: as far as the digits of a file reach
    place_mm: float = 1e-4  # mm of a centroid, which is less exact for slivers
    box_mm: float = 1e-5  # mm of boxes, in which the round-off of several numbers adds up
    least_size_mm: float = 1e-3  # mm: what is smaller is turned as if it were this large
    cell_mm: float = 1e-2  # mm of the cells by which what is near is found
    cell_shift: float = 2**-0.5  # cells, so that nominal dimensions do not lie on their edges
    turn_rad: float = 1e-7  # rad of placed parts
    knot_share: float = 1e-9  # of the range of knots and weights
    attribute_share: float = 1e-9  # of the value of an attribute


@dataclass(frozen=True)
class LoadParameters:
    """All that a load goes by, a field a stage."""

    step: StepParameters = STEP
    mesh: MeshParameters = MESH
    features: FeatureParameters = FEATURES
    snap: SnapParameters = field(default_factory=SnapParameters)


DEFAULTS = LoadParameters()
