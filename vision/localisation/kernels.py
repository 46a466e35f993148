"""Compiled kernels of localisation: scores of many poses, edge elements along normals, pixels covered."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np

from relmodel.arrays import Floats, Floats32, Ints
from relmodel.compiled import helper, kernel

# The evidence that kernels take: `samples` (n, 7) point, tangent (in the rig's frame at the prior) and weight; `view`
# (n,) the camera's number; `cameras` (c, 20) camera_from_rig's rotation (9, by rows) and offset (3), the pinhole's two
# rows (6) and the origin of the camera's evidence, px; `layout` (c, 3) where its evidence starts in the flat `field`,
# rows and columns; `cell` px of a cell; how many orientations there are. A pose (12,) is a rotation (by rows) and a
# translation: prior_from_pose, both in the rig's frame.

Evidence: TypeAlias = tuple[Floats, Ints, Floats, Ints, Floats32, float, int]
_EVIDENCE = "Tuple((f8[:, ::1], i8[::1], f8[:, ::1], i8[:, ::1], f4[::1], f8, i8))"


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


@kernel(f"void({_EVIDENCE}, i8, f8[:, ::1], i8[:, ::1], f8[:, ::1], f8[::1], f8[::1], i8[::1])")
def scan(
    evidence: Evidence,
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
    what the prior takes off; worked in `total` (s,)."""
    samples, view, cameras, layout, field, cell, orientations = evidence
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
def _score(evidence: Evidence, information: Floats, delta: Floats, pose: Floats) -> float:
    """Evidence at a perturbation (6,), less half its squared distance by `information`; works in `pose` (12,)."""
    samples, view, cameras, layout, field, cell, orientations = evidence
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


@kernel(f"void({_EVIDENCE}, f8[:, ::1], f8[:, ::1], f8, f8, f8[::1], f8[:, ::1], f8[::1])")
def climb(
    evidence: Evidence,
    information: Floats,
    basis: Floats,
    first_step: float,
    last_step: float,
    room: Floats,
    delta: Floats,
    score: Floats,
) -> None:
    """Pattern search of each perturbation `delta` (p, 6) of the prior along `basis` (6, 6; columns move about 1 px).

    Maximises evidence - delta' information delta / 2; overwrites `delta`, fills `score` (p,), works in `room` (18,)."""
    pose, trial = room[:12], room[12:]
    for p in range(len(delta)):
        best = delta[p]
        value = _score(evidence, information, best, pose)
        step = first_step
        while step >= last_step:
            moved = False
            for way in range(12):
                for _ in range(8):  # a direction that improves is followed while it does
                    for j in range(6):
                        trial[j] = best[j] + (step if way % 2 else -step) * basis[j, way // 2]
                    t = _score(evidence, information, trial, pose)
                    if t <= value:
                        break
                    value, moved = t, True
                    for j in range(6):
                        best[j] = trial[j]
            if not moved:
                step *= 0.5
        score[p] = value


@kernel(f"void({_EVIDENCE}, f8[:, ::1], i8[::1], f8[:, ::1])")
def gather(evidence: Evidence, poses: Floats, group: Ints, out: Floats) -> None:
    """Adds to `out` (p, a) the evidence of the samples of each group (n,) of a arcs at each pose (p, 12)."""
    samples, view, cameras, layout, field, cell, orientations = evidence
    for p in range(len(poses)):
        for i in range(len(samples)):
            c = view[i]
            column, row, turn = _place(samples[i], cameras[c], poses[p], cell, orientations)
            start, rows, columns = layout[c, 0], layout[c, 1], layout[c, 2]
            if turn < 0 or not (column > -0.5 and row > -0.5 and column < columns - 0.5 and row < rows - 0.5):
                continue
            x, y = int(np.rint(column)), int(np.rint(row))
            out[p, group[i]] += samples[i, 6] * field[start + (turn * rows + y) * columns + x]


@kernel(
    "void(f8[:, ::1], f8[:, ::1], f8[::1], f8[:, ::1], f8[:, ::1], f8[::1], i8[::1], i8[::1], i8[::1], f8[::1],"
    " f8[::1], i8[::1])"
)
def nearest_edges(
    pixel: Floats,
    direction: Floats,
    limits: Floats,
    position: Floats,
    normal: Floats,
    strength: Floats,
    start: Ints,
    order: Ints,
    size: Ints,
    low: Floats,
    offset: Floats,
    found: Ints,
) -> None:
    """For each predicted pixel the edge element on its normal that counts most, as `offset` (px) and `found` (index).

    `limits`: reach, scale, least cosine, max_along.  Candidates lie within the reach (px) along the normal and within
    `max_along` px of it, with a tangent within the cosine of the predicted direction; the one with the highest
    log(strength) - (offset / scale)^2 / 2 wins; found = -1 for none.
    The normal is the direction turned a quarter: (-dy, dx).  Elements are bucketed by whole pixels (start, order):
    `size` (2,) columns and rows of them, from the pixel `low` (2,) on."""
    columns, rows = size[0], size[1]
    reach, scale, min_cosine, max_along = limits[0], limits[1], limits[2], limits[3]
    box = int(np.ceil(reach + max_along))
    # Whole pixels far from the normal's line contain nothing of use: elements are up to 0.71 px off them.
    wide = max_along + 0.85
    for i in range(len(pixel)):
        found[i], offset[i] = -1, 0.0
        nx, ny = -direction[i, 1], direction[i, 0]
        best = -1e300
        col, row = int(np.rint(pixel[i, 0] - low[0])), int(np.rint(pixel[i, 1] - low[1]))
        tx, ty = direction[i, 0], direction[i, 1]
        for r in range(max(row - box, 0), min(row + box + 1, rows)):
            first, last = max(col - box, 0), min(col + box, columns - 1)
            if abs(tx) > 1e-3:
                # The columns of this row that the strip of that half width about the line crosses.
                middle = pixel[i, 0] - low[0] - (r + low[1] - pixel[i, 1]) * ty / tx
                first = max(first, int(np.ceil(middle - wide / abs(tx))))
                last = min(last, int(np.floor(middle + wide / abs(tx))))
            elif abs((r + low[1] - pixel[i, 1]) * ty) > wide + 1e-3 * (box + 1):
                continue
            for c in range(first, last + 1):
                for k in range(start[r * columns + c], start[r * columns + c + 1]):
                    e = order[k]
                    ex, ey = position[e, 0] - pixel[i, 0], position[e, 1] - pixel[i, 1]
                    if abs(ex * direction[i, 0] + ey * direction[i, 1]) > max_along:
                        continue
                    along = ex * nx + ey * ny
                    if abs(along) > reach or abs(normal[e, 0] * nx + normal[e, 1] * ny) < min_cosine:
                        continue
                    score = np.log(strength[e]) - 0.5 * (along / scale) ** 2
                    if score > best:
                        best, found[i], offset[i] = score, e, along


@kernel("void(f8[:, :, ::1], f8[:, ::1], i8[:, ::1], f8[:, ::1], i8[::1], i8[::1], i8[::1], i8[:, ::1], f8[::1])")
def covered(
    directions: Floats,
    weight: Floats,
    boxes: Ints,
    sides: Floats,
    first: Ints,
    surfaces: Ints,
    group_first: Ints,
    met: Ints,
    total: Floats,
) -> None:
    """Add to `total` (g,) the weight (rows, columns) of the rays (rows, columns, 3) that meet each group's triangles.

    boxes (t, 4): first and last column, first and last row of the rays that may meet each triangle; sides (t, 9): the
    planes through the camera and the triangle's three sides, on whose negative side a ray that meets it lies.
    Triangles stand by surface: those of s are first[s]:first[s + 1]; group g has the surfaces
    surfaces[group_first[g]:group_first[g + 1]].  `met` (rows, columns), zeros at first: the last group, counted from 1,
    that a ray met."""
    for g in range(len(total)):
        for k in range(group_first[g], group_first[g + 1]):
            for t in range(first[surfaces[k]], first[surfaces[k] + 1]):
                n = sides[t]
                for y in range(boxes[t, 2], boxes[t, 3] + 1):
                    for x in range(boxes[t, 0], boxes[t, 1] + 1):
                        if met[y, x] == g + 1 or weight[y, x] == 0:
                            continue
                        p, q, r = directions[y, x, 0], directions[y, x, 1], directions[y, x, 2]
                        if (
                            p * n[0] + q * n[1] + r * n[2] <= 0
                            and p * n[3] + q * n[4] + r * n[5] <= 0
                            and p * n[6] + q * n[7] + r * n[8] <= 0
                        ):
                            met[y, x] = g + 1
                            total[g] += weight[y, x]
