"""Compiled kernel behind `coverage`."""

from relmodel.arrays import Floats, Ints
from relmodel.compiled import kernel


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
    that a ray met.
    """
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
