"""Compiled kernels of the pose search: scores of many poses from one set of predicted samples.

What all take: `samples` (n, 7) point, tangent (in the rig's frame at the prior) and weight; `view` (n,) the camera's
number; `cameras` (c, 20) camera_from_rig's rotation (9, by rows) and offset (3), the pinhole's two rows (6) and the
origin of the camera's evidence, px; `layout` (c, 3) where its evidence starts in the flat `field`, rows and columns;
`cell` px of a cell.  A pose (12,) is a rotation (by rows) and a translation: prior_from_pose, both in the rig's frame.
"""

import numpy as np

from relmodel.arrays import Floats, Floats32, Ints
from relmodel.compiled import helper, kernel


@helper
def _place(sample: Floats, camera: Floats, pose: Floats, cell: float, orientations: int) -> tuple[float, float, int]:
    """Column and row, in cells, and orientation of a sample in the evidence of a camera; orientation -1 when behind."""
    dx, dy, dz = sample[0] - pose[9], sample[1] - pose[10], sample[2] - pose[11]
    px = pose[0] * dx + pose[3] * dy + pose[6] * dz
    py = pose[1] * dx + pose[4] * dy + pose[7] * dz
    pz = pose[2] * dx + pose[5] * dy + pose[8] * dz
    z = camera[6] * px + camera[7] * py + camera[8] * pz + camera[11]
    if z < 1e-6:
        return 0.0, 0.0, -1
    x = (camera[0] * px + camera[1] * py + camera[2] * pz + camera[9]) / z
    y = (camera[3] * px + camera[4] * py + camera[5] * pz + camera[10]) / z
    tx = pose[0] * sample[3] + pose[3] * sample[4] + pose[6] * sample[5]
    ty = pose[1] * sample[3] + pose[4] * sample[4] + pose[7] * sample[5]
    tz = pose[2] * sample[3] + pose[5] * sample[4] + pose[8] * sample[5]
    sz = camera[6] * tx + camera[7] * ty + camera[8] * tz
    fx = camera[0] * tx + camera[1] * ty + camera[2] * tz - x * sz
    fy = camera[3] * tx + camera[4] * ty + camera[5] * tz - y * sz
    u = camera[12] * x + camera[13] * y + camera[14]
    v = camera[15] * x + camera[16] * y + camera[17]
    angle = np.arctan2(camera[15] * fx + camera[16] * fy, camera[12] * fx + camera[13] * fy) / np.pi
    return (u - camera[18]) / cell, (v - camera[19]) / cell, int(np.rint(angle * orientations)) % orientations


@kernel(
    "void(f8[:, ::1], i8[::1], f8[:, ::1], i8[:, ::1], f4[::1], f8, i8, i8, f8[:, ::1], i8[:, ::1], f8[:, ::1],"
    " f8[::1], f8[::1], i8[::1])"
)
def scan(
    samples: Floats,
    view: Ints,
    cameras: Floats,
    layout: Ints,
    field: Floats32,
    cell: float,
    orientations: int,
    pad: int,
    poses: Floats,
    jump: Ints,
    penalty: Floats,
    total: Floats,
    best_score: Floats,
    best_shift: Ints,
) -> None:
    """For each pose (p, 12) the best of many common image shifts: fills best_score (p,) and best_shift (p,).

    jump (c, s): how far in `field` each shift leads, whole cells, at most `pad` along rows and columns; penalty (p, s):
    what the prior takes off; worked in `total` (s,).
    """
    slots = len(total)
    for p in range(len(poses)):
        total[:] = 0.0
        for i in range(len(samples)):
            c = view[i]
            column, row, turn = _place(samples[i], cameras[c], poses[p], cell, orientations)
            if turn < 0 or not (column > -1e6 and column < 1e6 and row > -1e6 and row < 1e6):
                continue
            start, rows, columns = layout[c, 0], layout[c, 1], layout[c, 2]
            x, y = int(np.rint(column)), int(np.rint(row))
            if x < pad or y < pad or x >= columns - pad or y >= rows - pad:
                continue
            base = start + (turn * rows + y) * columns + x
            for s in range(slots):
                total[s] += samples[i, 6] * field[base + jump[c, s]]
        top = 0
        for s in range(slots):
            total[s] -= penalty[p, s]
            if total[s] > total[top]:
                top = s
        best_score[p], best_shift[p] = total[top], top


@helper
def _set_pose(delta: Floats, pose: Floats) -> None:
    """The pose of a perturbation: translation and rotation vector (6,)."""
    rx, ry, rz = delta[3], delta[4], delta[5]
    angle2 = rx * rx + ry * ry + rz * rz
    angle = np.sqrt(angle2)
    a, b = 1.0, 0.5
    if angle >= 1e-9:
        a, b = np.sin(angle) / angle, (1 - np.cos(angle)) / angle2
    for i in range(3):
        for j in range(3):
            pose[3 * i + j] = b * delta[3 + i] * delta[3 + j]
        pose[4 * i] += np.cos(angle)
        pose[9 + i] = delta[i]
    pose[1] -= a * rz
    pose[3] += a * rz
    pose[2] += a * ry
    pose[6] -= a * ry
    pose[5] -= a * rx
    pose[7] += a * rx


@helper
def _score(
    samples: Floats,
    view: Ints,
    cameras: Floats,
    layout: Ints,
    field: Floats32,
    cell: float,
    orientations: int,
    information: Floats,
    delta: Floats,
    pose: Floats,
) -> float:
    """Evidence at a perturbation (6,), less half its squared distance by `information`; works in `pose` (12,)."""
    _set_pose(delta, pose)
    total = 0.0
    for i in range(len(samples)):
        c = view[i]
        x, y, turn = _place(samples[i], cameras[c], pose, cell, orientations)
        start, rows, columns = layout[c, 0], layout[c, 1], layout[c, 2]
        if turn < 0 or not (x >= 0 and y >= 0 and x < columns - 1 and y < rows - 1):
            continue
        column, row = int(x), int(y)
        a, d = x - column, y - row
        base = start + (turn * rows + row) * columns + column
        below = base + columns
        total += samples[i, 6] * (
            (1 - d) * ((1 - a) * field[base] + a * field[base + 1])
            + d * ((1 - a) * field[below] + a * field[below + 1])
        )
    distance = 0.0
    for j in range(6):
        along = 0.0
        for i in range(6):
            along += 0.5 * delta[i] * information[i, j]
        distance += along * delta[j]
    return total - distance


@kernel(
    "void(f8[:, ::1], i8[::1], f8[:, ::1], i8[:, ::1], f4[::1], f8, i8, f8[:, ::1], f8[:, ::1], f8, f8, f8[::1],"
    " f8[:, ::1], f8[::1])"
)
def climb(
    samples: Floats,
    view: Ints,
    cameras: Floats,
    layout: Ints,
    field: Floats32,
    cell: float,
    orientations: int,
    information: Floats,
    basis: Floats,
    first_step: float,
    last_step: float,
    room: Floats,
    delta: Floats,
    score: Floats,
) -> None:
    """Pattern search of each perturbation `delta` (p, 6) of the prior along `basis` (6, 6; columns move about 1 px).

    Maximises evidence - delta' information delta / 2; overwrites `delta`, fills `score` (p,), works in `room` (18,).
    """
    pose, trial = room[:12], room[12:]
    for p in range(len(delta)):
        best = delta[p]
        value = _score(samples, view, cameras, layout, field, cell, orientations, information, best, pose)
        step = first_step
        while step >= last_step:
            moved = False
            for way in range(12):
                for _ in range(8):  # a direction that improves is followed while it does
                    for j in range(6):
                        trial[j] = best[j] + (step if way % 2 else -step) * basis[j, way // 2]
                    t = _score(samples, view, cameras, layout, field, cell, orientations, information, trial, pose)
                    if t <= value:
                        break
                    value, moved = t, True
                    for j in range(6):
                        best[j] = trial[j]
            if not moved:
                step *= 0.5
        score[p] = value


@kernel("void(f8[:, ::1], i8[::1], f8[:, ::1], i8[:, ::1], f4[::1], f8, i8, f8[:, ::1], i8[::1], f8[:, ::1])")
def gather(
    samples: Floats,
    view: Ints,
    cameras: Floats,
    layout: Ints,
    field: Floats32,
    cell: float,
    orientations: int,
    poses: Floats,
    group: Ints,
    out: Floats,
) -> None:
    """Adds to `out` (p, a) the evidence of the samples of each group (n,) of a arcs at each pose (p, 12)."""
    for p in range(len(poses)):
        for i in range(len(samples)):
            c = view[i]
            column, row, turn = _place(samples[i], cameras[c], poses[p], cell, orientations)
            start, rows, columns = layout[c, 0], layout[c, 1], layout[c, 2]
            if turn < 0 or not (column > -0.5 and row > -0.5 and column < columns - 0.5 and row < rows - 0.5):
                continue
            x, y = int(np.rint(column)), int(np.rint(row))
            out[p, group[i]] += samples[i, 6] * field[start + (turn * rows + y) * columns + x]
