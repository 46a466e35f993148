"""A camera's view widened by what is not known of its pose."""

from __future__ import annotations

import numpy as np

from relmodel.arrays import Floats
from relmodel.errors import InputError
from relmodel.find.volumes import Frustum, Polyhedron


def widened(view: Frustum, covariance: Floats, confidence: float, rig_from_camera: Floats | None = None) -> Polyhedron:
    """A polyhedron that holds the view from any pose of the rig within an ellipsoid of confidence about the one given.

    view: what the camera sees from the pose believed.
    covariance: (6, 6), ordered (t mm, r rad), of a right perturbation of world_from_rig: the true pose is
        world_from_rig @ [exp(r), t].  The ellipsoid is that of the chi-square distribution with six degrees of freedom.
    rig_from_camera: (4, 4); without it the camera is the rig.

    The bounds are in closed form.  A ray within an angle a of a direction with the tangents (u, v) stays below the
    tangent tan(atan u + asin(sin a sqrt(1 + v^2 / (1 + u^2)))).  A rig turned by r moves a camera at c by r x c, give
    or take |r|^2 |c| / 2.  Raises InputError where the covariance is invalid.
    """
    from scipy.special import chdtri

    covariance = np.asarray(covariance, float)
    finite = covariance.shape == (6, 6) and np.isfinite(covariance).all()
    slack = 1e-9 * (1 + np.abs(covariance).max()) if finite else 0.0
    if not finite or np.abs(covariance - covariance.T).max() > slack or np.linalg.eigvalsh(covariance)[0] < -slack:
        raise InputError(
            "the pose's covariance is invalid: give a symmetric 6x6 matrix, (t mm, r rad), no variance below 0"
        )
    if not 0 < confidence < 1:
        raise InputError(f"the confidence of the pose is {confidence}: give one between 0 and 1")
    sigmas = float(np.sqrt(chdtri(6, 1 - confidence)))
    camera = np.eye(4) if rig_from_camera is None else np.asarray(rig_from_camera, float)
    turn = sigmas * float(np.sqrt(max(0.0, np.linalg.eigvalsh(covariance[3:, 3:])[-1])))
    x, y, z = camera[:3, 3]
    moved = np.hstack([np.eye(3), np.array([[0, z, -y], [-z, 0, x], [y, -x, 0]])])  # of the camera, by (t, r)
    spread = camera[:3, :3].T @ moved @ covariance @ moved.T @ camera[:3, :3]  # in the camera's frame
    bent = turn**2 * float(np.linalg.norm(camera[:3, 3])) / 2

    def reach(normal: Floats) -> float:
        """The camera's greatest displacement along a unit normal in its frame."""
        return sigmas * float(np.sqrt(max(0.0, normal @ spread @ normal))) + bent

    pixels = np.array([[c, r, 1.0] for c in (-0.5, view.width - 0.5) for r in (-0.5, view.height - 0.5)])
    rays = pixels @ np.linalg.inv(view.matrix).T
    steepest = float(np.hypot(rays[:, 0], rays[:, 1]).max())
    planes = []
    for axis in (0, 1):
        u, v = rays[:, axis], rays[:, 1 - axis]
        flattest = max(0.0, float(u.min()), -float(u.max()))
        sine = np.sin(min(turn, np.pi / 2)) * float(np.sqrt(1 + (v**2).max() / (1 + flattest**2)))
        for sign in (-1.0, 1.0):
            angle = float(np.arctan(sign * u).max()) + float(np.arcsin(min(sine, 1.0)))
            if angle >= np.pi / 2 or sine >= 1:
                continue
            normal = np.zeros(3)
            normal[axis], normal[2] = sign * np.cos(angle), -np.sin(angle)
            planes.append([*normal, reach(normal)])
    forward = np.array([0.0, 0.0, 1.0])
    if len(planes) == 4:  # else the view may reach behind the eye
        planes.append([*-forward, reach(forward)])
    # What is far along the turned axis is no farther along this one, but for the corners that turn towards it.
    planes.append([*forward, view.far * (1 + np.sin(min(turn, np.pi / 2)) * steepest) + reach(forward)])
    longest = view.far * float(np.sqrt(1 + steepest**2))
    planes += [[*(sign * axis), longest + reach(axis)] for axis in np.eye(3) for sign in (-1.0, 1.0)]

    in_camera = np.array(planes)
    normals = in_camera[:, :3] @ view.world_from_camera[:3, :3].T
    return Polyhedron(np.column_stack([normals, in_camera[:, 3] + normals @ view.world_from_camera[:3, 3]]))
