"""Kernels on poses of one camera: the fit of circles of the model to ellipses, and how many ellipses of a
picture a pose explains.

A pose (12,) is camera_from_model: a rotation by rows and a translation, mm.  `matrix` (3, 3): the camera's, no skew."""

import numpy as np

from relmodel.arrays import Floats, Ints
from relmodel.compiled import helper, kernel


@helper
def _solve(a: Floats, b: Floats) -> None:
    """Overwrites b (6,) with the solution of a x = b; a (6, 6) symmetric and positive, overwritten (Cholesky)."""
    for i in range(6):
        for j in range(i + 1):
            total = a[i, j]
            for k in range(j):
                total -= a[i, k] * a[j, k]
            a[i, j] = np.sqrt(total) if i == j else total / a[j, j]
    for i in range(6):
        for k in range(i):
            b[i] -= a[i, k] * b[k]
        b[i] /= a[i, i]
    for i in range(5, -1, -1):
        for k in range(i + 1, 6):
            b[i] -= a[k, i] * b[k]
        b[i] /= a[i, i]


@helper
def _turn(pose: Floats, step: Floats, room: Floats) -> None:
    """Moves a pose by a step (6,): a rotation vector about the camera, a translation of the model."""
    angle2 = step[0] * step[0] + step[1] * step[1] + step[2] * step[2]
    angle = np.sqrt(angle2)
    a, b = 1.0, 0.5
    if angle >= 1e-9:
        a, b = np.sin(angle) / angle, (1 - np.cos(angle)) / angle2
    x, y, z = step[0], step[1], step[2]
    for column in range(3):
        p, q, r = pose[column], pose[3 + column], pose[6 + column]
        along = b * (x * p + y * q + z * r)
        room[column] = np.cos(angle) * p + a * (y * r - z * q) + along * x
        room[3 + column] = np.cos(angle) * q + a * (z * p - x * r) + along * y
        room[6 + column] = np.cos(angle) * r + a * (x * q - y * p) + along * z
    for i in range(9):
        pose[i] = room[i]
    for i in range(3):
        pose[9 + i] += step[3 + i]


@kernel(
    "void(f8[:, :, ::1], i8[:, ::1], f8[:, :, ::1], i8[:, ::1], f8[:, ::1], i8, f8, f8[:, ::1], f8[::1], f8[::1],"
    " f8[:, ::1], f8[::1])"
)
def fit(
    circles: Floats,
    circle: Ints,
    conics: Floats,
    ellipse: Ints,
    matrix: Floats,
    rounds: int,
    robust: float,
    hessian: Floats,
    step: Floats,
    room: Floats,
    poses: Floats,
    off: Floats,
) -> None:
    """Leads poses (k, 12) to where some circles each are seen as some ellipses: steps of Gauss and Newton on the
    distances of their points from the ellipses (Sampson's, px), which count less beyond `robust` px.  Overwrites
    `poses`, fills `off` (k,) with the root of the mean square distance; infinite where a point lies behind the
    camera.

    circles (c, n, 3): points along the model's circles; circle, ellipse (k, m): which, and -1 for
    none; conics (e, 3, 3); works in
    `hessian` (6, 6), `step` (6,) and `room` (15,)."""
    count = circles.shape[1]
    for k in range(len(poses)):
        pose = poses[k]
        for turn in range(rounds + 1):
            square, used = 0.0, 0
            for i in range(6):
                step[i] = 0.0
                for j in range(6):
                    hessian[i, j] = 0.0
                hessian[i, i] = 1e-3 if i < 3 else 1e-9
            for side in range(circle.shape[1]):
                if circle[k, side] < 0:
                    continue
                c = conics[ellipse[k, side]]
                used += count
                for point in range(count):
                    x, y, z = circles[circle[k, side], point]
                    rx = pose[0] * x + pose[1] * y + pose[2] * z
                    ry = pose[3] * x + pose[4] * y + pose[5] * z
                    rz = pose[6] * x + pose[7] * y + pose[8] * z
                    px, py, pz = rx + pose[9], ry + pose[10], rz + pose[11]
                    if pz < 1.0:
                        square = np.inf
                        break
                    u = matrix[0, 0] * px / pz + matrix[0, 2]
                    v = matrix[1, 1] * py / pz + matrix[1, 2]
                    gu = c[0, 0] * u + c[0, 1] * v + c[0, 2]
                    gv = c[1, 0] * u + c[1, 1] * v + c[1, 2]
                    value = gu * u + gv * v + c[2, 0] * u + c[2, 1] * v + c[2, 2]
                    length = 2 * np.sqrt(gu * gu + gv * gv) + 1e-12
                    distance = value / length
                    square += distance * distance
                    dx = 2 * gu / length * matrix[0, 0] / pz
                    dy = 2 * gv / length * matrix[1, 1] / pz
                    dz = -(dx * px + dy * py) / pz
                    room[9], room[10], room[11] = ry * dz - rz * dy, rz * dx - rx * dz, rx * dy - ry * dx
                    room[12], room[13], room[14] = dx, dy, dz
                    weight = 1.0 if abs(distance) < robust else robust / abs(distance)
                    for i in range(6):
                        step[i] -= weight * room[9 + i] * distance
                        for j in range(i + 1):
                            hessian[i, j] += weight * room[9 + i] * room[9 + j]
            off[k] = np.sqrt(square / max(used, 1))
            if turn == rounds or not off[k] < np.inf:
                break
            _solve(hessian, step)
            angle = np.sqrt(step[0] * step[0] + step[1] * step[1] + step[2] * step[2])
            if angle > 0.3:
                for i in range(6):
                    step[i] *= 0.3 / angle
            _turn(pose, step, room)


@kernel(
    "void(f8[:, ::1], f8[:, ::1], f8[:, ::1], f8[:, ::1], f8[::1], f8[::1], f8[::1], f8[:, ::1], f8[:, ::1],"
    " i8[:, ::1], i8[::1])"
)
def explain(
    centre: Floats,
    normal: Floats,
    ellipses: Floats,
    matrix: Floats,
    size: Floats,
    radius: Floats,
    limits: Floats,
    poses: Floats,
    like: Floats,
    which: Ints,
    inside: Ints,
) -> None:
    """How like (k, e) each ellipse is to the circle that explains it best at poses (k, 12), 0 to 1, `which` (k, e)
    that is, -1 for none, and how many circles are `inside` (k,) the picture of `size` (2,) px.

    centre, normal (c, 3), radius (c,) mm: of the model's circles; ellipses (e, 4): centre, major semi-axis and ratio of
    the axes; limits: standard deviations of the centre (px, and as a share of the semi-axis), of the size as a share,
    of the ratio, and the least cosine at which a circle is seen."""
    for k in range(len(poses)):
        pose = poses[k]
        inside[k] = 0
        for j in range(len(ellipses)):
            like[k, j] = 0.0
            which[k, j] = -1
        for i in range(len(centre)):
            cx, cy, cz = centre[i]
            pz = pose[6] * cx + pose[7] * cy + pose[8] * cz + pose[11]
            if pz < 10.0:
                continue
            px = pose[0] * cx + pose[1] * cy + pose[2] * cz + pose[9]
            py = pose[3] * cx + pose[4] * cy + pose[5] * cz + pose[10]
            u = matrix[0, 0] * px / pz + matrix[0, 2]
            v = matrix[1, 1] * py / pz + matrix[1, 2]
            if not (u > 0 and v > 0 and u < size[0] and v < size[1]):
                continue
            nx, ny, nz = normal[i]
            cosine = px * (pose[0] * nx + pose[1] * ny + pose[2] * nz)
            cosine += py * (pose[3] * nx + pose[4] * ny + pose[5] * nz)
            cosine += pz * (pose[6] * nx + pose[7] * ny + pose[8] * nz)
            cosine = abs(cosine) / np.sqrt(px * px + py * py + pz * pz)
            if cosine < limits[4]:
                continue
            inside[k] += 1
            wide = matrix[0, 0] * radius[i] / pz
            for j in range(len(ellipses)):
                near = limits[0] + limits[1] * ellipses[j, 2]
                du, dv = u - ellipses[j, 0], v - ellipses[j, 1]
                # Farther off than this nothing is explained, and most circles are.
                if abs(du) > 4 * near or abs(dv) > 4 * near:
                    continue
                a, b = (wide / ellipses[j, 2] - 1) / limits[2], (cosine - ellipses[j, 3]) / limits[3]
                square = (du * du + dv * dv) / (near * near) + a * a + b * b
                if square < 16 and np.exp(-0.5 * square) > like[k, j]:
                    like[k, j], which[k, j] = np.exp(-0.5 * square), i
