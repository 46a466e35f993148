"""The parameters of an inspection: those of all its stages, as a run records them."""

from dataclasses import dataclass, field, replace

from vision.cameras.cameras import SelectionParameters
from vision.constellations.constellation_parameters import ConstellationParameters
from vision.extraction.extraction_parameters import ExtractionParameters
from vision.inspection.pictures import PictureParameters
from vision.localisation.localisation_parameters import LocalisationParameters
from vision.matching import MatchingParameters
from vision.presence.presence_parameters import PresenceParameters
from vision.stereo.stereo_parameters import StereoParameters


@dataclass(frozen=True)
class InspectionParameters:
    """All parameters of an inspection, a field a stage."""

    selection: SelectionParameters = field(default_factory=SelectionParameters)
    extraction: ExtractionParameters = field(default_factory=ExtractionParameters)
    pictures: PictureParameters = field(default_factory=PictureParameters)
    stereo: StereoParameters = field(default_factory=StereoParameters)
    constellations: ConstellationParameters = field(default_factory=ConstellationParameters)
    localisation: LocalisationParameters = field(default_factory=LocalisationParameters)
    believe_pictures: bool = False
    """whether a pose that the pictures show surely is accepted where it contradicts the prior"""
    ignore_blind_camera: bool = False
    """whether the other cameras answer where one does not see the model or its picture says nothing"""
    most_parts: int = 20_000  # placed parts of a world in which the prior is doubted: all of them are then looked for
    matching: MatchingParameters = field(default_factory=MatchingParameters)
    presence: PresenceParameters = field(default_factory=PresenceParameters)
    most_variants: int = 5
    """other loaded variants that are weighed unasked where something is not as the model says: each takes about as long
    as presence, a second or less"""
    most_objects: int = 3
    """objects that are localised, of those that pictures are compared with without a world: those of the best joins"""
    same_edges: float = 0.5
    """share of the edges that an object explains from which on another one that explains them is its rival, and does
    not stand beside it"""


def choose_methods(parameters: InspectionParameters, *, stereo: str, search: str) -> InspectionParameters:
    """The parameters with that method of stereo (`vision.stereo.match.METHODS`) and, in stereo and in each view, that
    search of labellings (`relmodel.labelling.solve.MODES`)."""
    of_stereo = replace(parameters.stereo, method=stereo, search=search)
    of_views = replace(parameters.matching, pose=replace(parameters.matching.pose, search=search))
    return replace(parameters, stereo=of_stereo, matching=of_views)


DEFAULTS = InspectionParameters()
