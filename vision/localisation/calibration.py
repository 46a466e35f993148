"""Unknowns of the cameras, solved along with the pose: response, principal point, focal length, place.

A camera has ten unknowns: how far its response moves edges toward their dark side (px at a contrast of the whole range
of grey), the principal point (px, 2), the focal length (as a share of it), and a right perturbation of its place in
the rig (t mm, r rad).  The rig says how well each is known; what is exact stays out of the solution.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from relmodel.arrays import Floats, Ints
from relmodel.geometry.transforms import skew
from vision.cameras.cameras import CalibrationSigma, Rig, perturb
from vision.localisation.hypotheses import Prediction, flow_in_camera
from vision.localisation.localisation_parameters import RefinementParameters

COUNT = 10


@dataclass(frozen=True)
class CameraUnknowns:
    """Expected values and standard deviations (c, 10) of the cameras' own unknowns; sigma zero: exact.

    considered (10 c, k): k errors that are not solved for but that the covariance holds (Schmidt, 1966), one standard
    deviation each: of a rig that does not say how well it is known, all principal points off alike, as where files
    disagree on what pixel (0, 0) is the centre of.
    """

    mean: Floats
    sigma: Floats
    considered: Floats

    @property
    def precision(self) -> Floats:
        """Inverse variances (10 c,); one for what is exact, which no measurement moves."""
        return np.where(self.sigma > 0, self.sigma, 1.0).ravel() ** -2.0


def describe_unknowns(rig: Rig, p: RefinementParameters) -> CameraUnknowns:
    """The unknowns of a rig's cameras, in its order."""
    mean, sigma = np.zeros((2, len(rig.cameras), COUNT))
    considered = np.zeros((len(rig.cameras), COUNT, 2))
    mean[:, 0] = p.response_px
    for number, name in enumerate(rig.cameras):
        stated = rig.sigma.get(name, CalibrationSigma())
        sigma[number, 0] = p.response_sigma_px
        sigma[number, 1:3] = max(stated.centre_px, p.calibration_px)
        sigma[number, 3] = stated.focal
        sigma[number, 4:7] = stated.translation_mm
        sigma[number, 7:] = stated.rotation
        if name not in rig.sigma:
            considered[number, [1, 2], [0, 1]] = p.convention_px
    return CameraUnknowns(mean, sigma, considered.reshape(-1, 2))


def differentiate(
    prediction: Prediction, delta: Floats, rows: Ints, pixel: Floats, normal: Floats, response: Floats, sigma: Floats
) -> Floats:
    """Derivatives (k, 10) of the predicted place along the normals (k, 2) by the unknowns of the camera that the `rows`
    (k,) of the prediction belong to; `pixel` (k, 2) where they are, `response` (k,) what moves them by its response;
    zero for what `sigma` (10,) has as exact."""
    out = np.zeros((len(rows), COUNT))
    out[:, 0] = response
    out[:, 1:3] = normal
    if sigma[3] > 0:
        centre = prediction.matrix[prediction.view[rows], :, 2]
        out[:, 3] = np.einsum("ni,ni->n", normal, pixel - centre)
    if (sigma[4:] > 0).any():
        point, flow = flow_in_camera(prediction, delta, rows)
        out[:, 4:7] = -np.einsum("ni,nij->nj", normal, flow)
        out[:, 7:] = np.einsum("ni,nij->nj", normal, flow @ skew(point))
    return np.asarray(out * (sigma > 0))


def shift_pixels(prediction: Prediction, delta: Floats, pixel: Floats, own: Floats) -> Floats:
    """How far (n, 2) px the cameras' unknowns (c, 10), all but their responses, move the samples' pixels (n, 2)."""
    of = own[prediction.view]
    centre = prediction.matrix[prediction.view, :, 2]
    out = of[:, 1:3] + of[:, 3:4] * (pixel - centre)
    if own[:, 4:].any():
        point, flow = flow_in_camera(prediction, delta)
        out += np.einsum("nij,nj->ni", flow, np.cross(point, of[:, 7:]) - of[:, 4:7])
    return np.asarray(out)


def correct_rig(rig: Rig, own: Floats) -> Rig:
    """The rig as the cameras' unknowns (c, 10) say that it is."""
    cameras, poses = {}, {}
    for (name, camera), values in zip(rig.cameras.items(), own, strict=True):
        matrix = camera.matrix.copy()
        matrix[[0, 1], [0, 1]] *= 1 + values[3]
        matrix[:2, 2] += values[1:3]
        cameras[name] = replace(camera, matrix=matrix)
        poses[name] = perturb(rig.rig_from_camera[name], values[4:])
    return Rig(cameras, poses, rig.sigma)
