"""Samples along arcs as the store keeps them: of straight ones the two ends, of what is the same everywhere one."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from relmodel.arrays import Floats, Ints
from relmodel.columns import Ragged
from relmodel.model.model import ArcSamples, Table

_ROUND_OFF = 8 * np.finfo(float).eps  # of the greatest value: what interpolating between the ends may be off


def pack_samples(samples: ArcSamples) -> Table:
    """Columns of `shape_arc_sample` but for the shape; every arc has two samples at least."""
    count = np.diff(samples.points.offsets) // 3
    directions = {name: getattr(samples, name) for name in ("tangents", "normals_a", "normals_b")}
    return {
        "arc_no": samples.arc_no,
        "sample_count": count,
        "points": _keep(samples.points, count, 2),
        **{name: _keep(values, count, 1) for name, values in directions.items()},
    }


def spread_samples(kept: Sequence[npt.ArrayLike], count: Ints, width: int) -> Floats:
    """All samples (sum of count, width) of arcs (n,), of each of which all, the two ends or one is kept."""
    arrays = [np.asarray(values, float).reshape(-1, width) for values in kept]
    there = np.array([len(values) for values in arrays], np.int64)
    return _interpolate(np.concatenate([np.empty((0, width)), *arrays]), there, count)


def _keep(column: Ragged, count: Ints, ends: int) -> Ragged:
    """A column of arcs (n,), of `count` (n,) samples each, without what follows from the first, or from both ends."""
    first = np.cumsum(count) - count
    values = column.values.reshape(count.sum(), -1)
    kept = np.stack([first, first + count - 1], axis=1)[:, :ends]
    bound = _ROUND_OFF * (ends - 1) * np.abs(values[kept]).max(axis=(1, 2), initial=0.0)
    off = np.abs(values - _interpolate(values[kept.ravel()], np.full(len(count), ends), count)).max(axis=1)
    own = np.maximum.reduceat(off, first) > bound
    chosen = np.repeat(own, count)
    chosen[kept] = True
    offsets = np.concatenate([[0], np.cumsum(np.where(own, count, ends))])
    return Ragged(values[chosen].ravel(), values.shape[1] * offsets)


def _interpolate(values: Floats, there: Ints, count: Ints) -> Floats:
    """Samples (sum of count, w) of arcs (n,), of which values (sum of there, w) has all, the two ends or one."""
    arc = np.repeat(np.arange(len(count)), count)
    step = np.arange(len(arc)) - (np.cumsum(count) - count)[arc]
    first, every = (np.cumsum(there) - there)[arc], (there == count)[arc]
    low, high = first + np.where(every, step, 0), first + np.where(every, step, there[arc] - 1)
    share = np.where(high > low, step / (count[arc] - 1), 0.0)[:, None]
    return np.asarray(values[low] * (1 - share) + values[high] * share)
