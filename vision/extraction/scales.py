"""Edges over several scales: each at the finest scale that shows it, if a coarser one confirms it.

A fine operator places an edge best and sees more noise and texture; a coarse one sees fewer, displaced at corners.  An
element stands where the next coarser scale has one of like direction within 1.5 of its standard deviations of the
operator; what a finer scale already shows is not shown again.  Brush texture has no partner from scale 2.5 on.
"""

import numpy as np

from relmodel.arrays import Bools, Floats
from relmodel.errors import UsageError
from vision.extraction.edges import EdgeElements, concatenate, detect_edges
from vision.extraction.extraction_parameters import EdgeParameters


def detect_edges_over_scales(
    grey: Floats,
    p: EdgeParameters,
    *,
    noise: Floats,
) -> EdgeElements:
    """Edge elements of a grey image at the facet scales `p.scales`, ascending; one scale needs no partner.

    `noise` (256,) is the curve of `estimate_noise`.  Raises UsageError for scales that do not ascend.
    """
    scales = p.scales
    if list(scales) != sorted(set(scales)) or not scales:
        raise UsageError(f"facet scales {', '.join(map(str, scales))} do not ascend: name each once, the finest first")
    found = [detect_edges(grey, scale, p, noise=noise) for scale in scales]

    def partnered(some: EdgeElements, others: EdgeElements, scale: float) -> Bools:
        from vision.extraction import scale_kernels

        return scale_kernels.partnered(
            some.x, some.y, some.nx, some.ny, others.x, others.y, others.nx, others.ny, others.pixel,
            p.partner_reach * scale, p.min_partner_cosine, *grey.shape,
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
