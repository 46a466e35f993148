"""Kernels of the pose search (numba): scores of many poses from one set of predicted samples.

Common arguments, for samples of all cameras in one list: point, tangent (n, 3) in the rig's frame at the prior;
weight (n,); view (n,) the camera's number; and per camera rotation (c, 3, 3), offset (c, 3) = camera_from_rig, matrix
(c, 2, 3) pinhole rows, start (c,) of its evidence in the flat `field`, shape (c, 2) rows and columns, origin (c, 2) px.
A pose is a rotation (3, 3) and a translation (3,): prior_from_pose, both in the rig's frame.
"""

from __future__ import annotations

import numpy as np
from numba import njit, prange


@njit(cache=True, nogil=True, inline="always")
def _place(point, tangent, rotation, translation, camera_rotation, camera_offset, matrix):  # type: ignore[no-untyped-def]
    """Pixel and tangent angle (modulo pi, as a share of pi) of a sample under a pose; z <= 0 when behind."""
    dx, dy, dz = point[0] - translation[0], point[1] - translation[1], point[2] - translation[2]
    px = rotation[0, 0] * dx + rotation[1, 0] * dy + rotation[2, 0] * dz
    py = rotation[0, 1] * dx + rotation[1, 1] * dy + rotation[2, 1] * dz
    pz = rotation[0, 2] * dx + rotation[1, 2] * dy + rotation[2, 2] * dz
    tx = rotation[0, 0] * tangent[0] + rotation[1, 0] * tangent[1] + rotation[2, 0] * tangent[2]
    ty = rotation[0, 1] * tangent[0] + rotation[1, 1] * tangent[1] + rotation[2, 1] * tangent[2]
    tz = rotation[0, 2] * tangent[0] + rotation[1, 2] * tangent[1] + rotation[2, 2] * tangent[2]
    c = camera_rotation
    x = c[0, 0] * px + c[0, 1] * py + c[0, 2] * pz + camera_offset[0]
    y = c[1, 0] * px + c[1, 1] * py + c[1, 2] * pz + camera_offset[1]
    z = c[2, 0] * px + c[2, 1] * py + c[2, 2] * pz + camera_offset[2]
    if z < 1e-6:
        return 0.0, 0.0, 0.0, z
    x, y = x / z, y / z
    sx = c[0, 0] * tx + c[0, 1] * ty + c[0, 2] * tz
    sy = c[1, 0] * tx + c[1, 1] * ty + c[1, 2] * tz
    sz = c[2, 0] * tx + c[2, 1] * ty + c[2, 2] * tz
    fx, fy = sx - x * sz, sy - y * sz
    u = matrix[0, 0] * x + matrix[0, 1] * y + matrix[0, 2]
    v = matrix[1, 0] * x + matrix[1, 1] * y + matrix[1, 2]
    angle = np.arctan2(matrix[1, 0] * fx + matrix[1, 1] * fy, matrix[0, 0] * fx + matrix[0, 1] * fy)
    return u, v, angle / np.pi, z


@njit(cache=True, nogil=True, parallel=True)
def scan(  # type: ignore[no-untyped-def]
    point, tangent, weight, view, rotation, offset, matrix, field, start, shape, origin, cell, pad, orientations,
    pose_rotation, pose_translation, shifts, penalty, best_score, best_shift,
):  # fmt: skip
    """For each pose the best of many common image shifts: fills best_score (p,) and best_shift (p,).

    shifts (c, s, 2): whole cells (column, row), at most `pad`; penalty (p, s): what the prior takes off.
    """
    count, slots = len(pose_rotation), shifts.shape[1]
    jump = np.empty((len(start), slots), np.int64)
    for c in range(len(start)):
        for s in range(slots):
            jump[c, s] = shifts[c, s, 1] * shape[c, 1] + shifts[c, s, 0]
    for p in prange(count):
        total = np.zeros(slots)
        for i in range(len(point)):
            c = view[i]
            u, v, angle, z = _place(
                point[i], tangent[i], pose_rotation[p], pose_translation[p], rotation[c], offset[c], matrix[c]
            )
            if z < 1e-6:
                continue
            fc, fr = (u - origin[c, 0]) / cell, (v - origin[c, 1]) / cell
            if not (fc > -1e6 and fc < 1e6 and fr > -1e6 and fr < 1e6):
                continue
            col, row = int(np.rint(fc)), int(np.rint(fr))
            if col < pad or row < pad or col >= shape[c, 1] - pad or row >= shape[c, 0] - pad:
                continue
            b = int(np.rint(angle * orientations)) % orientations
            base = start[c] + (b * shape[c, 0] + row) * shape[c, 1] + col
            for s in range(slots):
                total[s] += weight[i] * field[base + jump[c, s]]
        top = 0
        for s in range(slots):
            total[s] -= penalty[p, s]
            if total[s] > total[top]:
                top = s
        best_score[p], best_shift[p] = total[top], top


@njit(cache=True, nogil=True)
def _score(  # type: ignore[no-untyped-def]
    point, tangent, weight, view, rotation, offset, matrix, field, start, shape, origin, cell, orientations, pr, pt,
):  # fmt: skip
    total = 0.0
    for i in range(len(point)):
        c = view[i]
        u, v, angle, z = _place(point[i], tangent[i], pr, pt, rotation[c], offset[c], matrix[c])
        if z < 1e-6:
            continue
        fc, fr = (u - origin[c, 0]) / cell, (v - origin[c, 1]) / cell
        if not (fc >= 0 and fr >= 0 and fc < shape[c, 1] - 1 and fr < shape[c, 0] - 1):
            continue
        col, row = int(fc), int(fr)
        a, d = fc - col, fr - row
        b = int(np.rint(angle * orientations)) % orientations
        base = start[c] + (b * shape[c, 0] + row) * shape[c, 1] + col
        below = base + shape[c, 1]
        total += weight[i] * (
            (1 - d) * ((1 - a) * field[base] + a * field[base + 1])
            + d * ((1 - a) * field[below] + a * field[below + 1])
        )
    return total


@njit(cache=True, nogil=True, inline="always")
def _exp(r):  # type: ignore[no-untyped-def]
    angle2 = r[0] * r[0] + r[1] * r[1] + r[2] * r[2]
    angle = np.sqrt(angle2)
    if angle < 1e-9:
        a, b = 1.0, 0.5
    else:
        a, b = np.sin(angle) / angle, (1 - np.cos(angle)) / angle2
    out = np.empty((3, 3))
    for i in range(3):
        for j in range(3):
            out[i, j] = b * r[i] * r[j]
        out[i, i] += np.cos(angle)
    out[0, 1] -= a * r[2]
    out[1, 0] += a * r[2]
    out[0, 2] += a * r[1]
    out[2, 0] -= a * r[1]
    out[1, 2] -= a * r[0]
    out[2, 1] += a * r[0]
    return out


@njit(cache=True, nogil=True, parallel=True)
def climb(  # type: ignore[no-untyped-def]
    point, tangent, weight, view, rotation, offset, matrix, field, start, shape, origin, cell, orientations,
    delta, basis, information, first_step, last_step, score,
):  # fmt: skip
    """Pattern search of each perturbation `delta` (p, 6) of the prior along `basis` (6, 6; columns move about 1 px).

    Maximises evidence - delta' information delta / 2; overwrites `delta` and fills `score` (p,).
    """
    for p in prange(len(delta)):
        best = delta[p].copy()
        value = _score(
            point, tangent, weight, view, rotation, offset, matrix, field, start, shape, origin, cell, orientations,
            _exp(best[3:]), best[:3],
        ) - 0.5 * best @ information @ best  # fmt: skip
        step = first_step
        while step >= last_step:
            moved = False
            for k in range(basis.shape[1]):
                for sign in (-1.0, 1.0):
                    # A direction that improves is followed while it does.
                    for _ in range(8):
                        trial = best + sign * step * basis[:, k]
                        t = _score(
                            point, tangent, weight, view, rotation, offset, matrix, field, start, shape, origin, cell,
                            orientations, _exp(trial[3:]), trial[:3],
                        ) - 0.5 * trial @ information @ trial  # fmt: skip
                        if t <= value:
                            break
                        value, best, moved = t, trial, True
            if not moved:
                step *= 0.5
        delta[p], score[p] = best, value
