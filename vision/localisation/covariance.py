"""The covariance of a refined pose."""

from __future__ import annotations

import numpy as np

from relmodel.arrays import Floats, Ints, sum_by_group
from vision.localisation.calibration import CameraUnknowns
from vision.localisation.hypotheses import Prediction, flow_in_camera
from vision.localisation.localisation_parameters import LocalisationParameters
from vision.localisation.measurements import Measurements, share_left


def compute_covariance(
    m: Measurements,
    held: Measurements,
    prediction: Prediction,
    stretch: Ints,
    hessian: Floats,
    unknowns: CameraUnknowns,
    p: LocalisationParameters,
) -> Floats:
    """Covariance (6, 6) of a pose from its measurements, as they are and as `hold_shifts` gives them: that of an
    M-estimator (Huber, 1981) whose measurements err in several ways.

    Samples near each other err together (texture, shading), so stretches of arcs (of `group_by_stretch`) are what is
    independent.  The image of an arc may be shifted as a whole (light, a clipped edge, an arc not where the model
    says), by a random effect whose variance is common to all arcs and is estimated from how far their mean offsets
    scatter, what the pose has followed taken off (Henderson's analysis of variance).  One arc may lie on another edge
    altogether: how far the pose moves without it counts besides, arc by arc (jackknife).  Where the model has a
    tolerance, an arc lies elsewhere for all cameras alike.  The priors err by their covariance, and the cameras also by
    errors that are considered and not solved for.
    """
    group = prediction.image_of_arc
    weight = m.weight / m.sigma**2
    data = (held.jacobian * weight[:, None]).T @ held.jacobian
    # How far the loss bends away from the least squares that its weights make of it.
    bend = np.clip((m.slope / m.sigma**2).sum() / max(float(weight.sum()), 1e-12), 0.2, 1.0)
    inverse = np.linalg.inv(hessian - (1 - bend) * data)
    known = np.bincount(group, weight)
    rows = np.flatnonzero(known > 0)
    if not len(rows):
        return np.asarray(inverse[:6, :6])
    mean = np.bincount(group, weight * m.offset) / np.where(known > 0, known, 1.0)
    apart = (held.jacobian * (weight * (m.offset - mean[group]))[:, None]).T
    scatter = np.stack([np.bincount(stretch, row) for row in apart], axis=1)
    left = share_left(m, prediction)
    shift = sum_by_group(group, m.jacobian, len(known), weight * left)[rows]
    total = sum_by_group(group, m.jacobian, len(known), weight)[rows]
    followed = np.clip(np.einsum("au,uv,av->a", shift, inverse, total) / known[rows], 0, 0.9)
    noise = np.bincount(group, (weight * (m.offset - mean[group])) ** 2)[rows] / known[rows] ** 2
    length = np.bincount(group, m.weight)[rows]
    # A few arcs say little of the scatter: a usual value counts as some arcs more.
    usual = p.refinement.usual_arcs * float(length.mean())
    scattered = float((length * (mean[rows] ** 2 - noise)).sum()) + usual * p.refinement.arc_shift_px**2
    variance = scattered / (usual + float((length * (1 - followed) ** 2).sum()))
    expected = np.bincount(group, m.weight * prediction.tolerance_px**2)[rows]
    variance = max(variance - float(expected.sum() / length.sum()), 0.0)
    meat = scatter.T @ scatter + variance * shift.T @ shift + hessian - data
    meat += _scatter_by_tolerance(held, prediction, weight)
    considered = unknowns.precision[:, None] * unknowns.considered
    meat[6:, 6:] += considered @ considered.T
    covariance = (inverse @ meat @ inverse)[:6, :6] + _scatter_without_arcs(held, group, weight, hessian)
    return np.asarray((covariance + covariance.T) / 2)


def _scatter_without_arcs(m: Measurements, group: Ints, weight: Floats, hessian: Floats) -> Floats:
    """Sum (6, 6) of the outer products of how far the pose moves, to first order, without the image of each arc."""
    # What no measurement moves has no part in it.
    free = np.flatnonzero(np.abs(m.jacobian).sum(axis=0) > 0)
    jacobian, order = m.jacobian[:, free], np.argsort(group, kind="stable")
    first = np.searchsorted(group[order], np.arange(int(group.max()) + 1))
    i, j = np.triu_indices(len(free))
    scaled = jacobian * weight[:, None]
    of_arcs = np.zeros((len(first), len(free), len(free)))
    of_arcs[:, i, j] = of_arcs[:, j, i] = np.add.reduceat((scaled[:, i] * jacobian[:, j])[order], first)
    gradient = np.add.reduceat((scaled * m.offset[:, None])[order], first)
    # An arc that alone determines the pose in some direction leaves next to nothing without it.
    left = hessian[np.ix_(free, free)] - 0.999 * of_arcs
    moved = np.linalg.solve(left, gradient[..., None])[:, : int((free < 6).sum()), 0]
    out = np.zeros((6, 6))
    pose = free[free < 6]
    out[np.ix_(pose, pose)] = moved.T @ moved
    return out


def _scatter_by_tolerance(m: Measurements, prediction: Prediction, weight: Floats) -> Floats:
    """Covariance (u, u) of the gradient by arcs that lie elsewhere than the model says, in all pictures at once."""
    _, flow = flow_in_camera(prediction)
    normal = np.stack([-m.direction[:, 1], m.direction[:, 0]], axis=1)
    # Where the image moves along its normal with the point: a vector in the rig's frame, px at one tolerance.
    by_point = np.einsum("ni,nij,njk->nk", normal, flow, prediction.rotation[prediction.view])
    by_point *= (prediction.tolerance_px / np.maximum(np.linalg.norm(by_point, axis=1), 1e-12))[:, None]
    arc = np.unique(prediction.arc, return_inverse=True)[1].ravel()
    moved = m.jacobian[:, :, None] * (weight[:, None] * by_point)[:, None, :]
    by_arc = np.stack([np.bincount(arc, column) for column in moved.reshape(len(arc), -1).T], axis=1)
    by_unknown = by_arc.reshape(len(by_arc), -1, 3)
    return np.asarray(np.einsum("aux,avx->uv", by_unknown, by_unknown))


def group_by_stretch(prediction: Prediction) -> Ints:
    """A number for each stretch of each arc's image (n,) that counts as one observation."""
    group = prediction.image_of_arc
    order = np.argsort(group, kind="stable")
    along = np.cumsum(prediction.weight[order])
    first = np.searchsorted(group[order], np.arange(int(group.max(initial=-1)) + 1))
    number = np.empty(len(group), np.int64)
    number[order] = np.floor(along - along[first][group[order]]).astype(np.int64)
    pairs = group * (int(number.max(initial=0)) + 1) + number
    return np.asarray(np.unique(pairs, return_inverse=True)[1].ravel())
