"""Edges over several scales: each at the finest scale that shows it, if a coarser one confirms it.

A fine operator places an edge best and sees more noise and texture; a coarse one sees fewer, displaced at corners.  An
element stands where the next coarser scale has one of like direction within 1.5 of its standard deviations of the
operator; what a finer scale already shows is not shown again.  Brush texture has no partner from scale 2.5 on.
"""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from relmodel.errors import UsageError
from vision.extraction.edges import EdgeElements, concatenate, detect_edges

FloatArray = npt.NDArray[np.float64]

_REACH = 1.5  # standard deviations of the operator within which a partner lies


def detect_edges_over_scales(
    grey: FloatArray,
    scales: Sequence[float],
    *,
    min_contrast: float,
    significance: float,
    max_sigma: float,
    noise: FloatArray,
) -> EdgeElements:
    """Edge elements of a grey image at facet scales `scales` px, ascending; one scale needs no partner.

    The other arguments are those of `detect_edges`.  Raises UsageError for scales that do not ascend.
    """
    if list(scales) != sorted(set(scales)) or not scales:
        raise UsageError(f"facet scales {', '.join(map(str, scales))} do not ascend: name each once, the finest first")
    found = [
        detect_edges(
            grey, scale, min_contrast=min_contrast, significance=significance, max_sigma=max_sigma, noise=noise
        )
        for scale in scales
    ]

    def partnered(some: EdgeElements, others: EdgeElements, scale: float) -> npt.NDArray[np.bool_]:
        from vision.extraction import _scale_kernels

        return _scale_kernels.partnered(
            some.x, some.y, some.nx, some.ny, others.x, others.y, others.nx, others.ny, others.pixel,
            _REACH * scale, *grey.shape,
        )  # fmt: skip

    kept = found[0]
    if len(found) > 1:
        kept = kept.take(partnered(kept, found[1], scales[1]))
    for at in range(1, len(found)):
        here = found[at]
        if at + 1 < len(found):
            here = here.take(partnered(here, found[at + 1], scales[at + 1]))
        new = ~partnered(here, kept, scales[at]) & ~np.isin(here.pixel, kept.pixel)
        kept = concatenate([kept, here.take(new)])
    return kept.take(np.argsort(kept.pixel, kind="stable"))
