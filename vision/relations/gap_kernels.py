"""Compiled kernels: which curves come near to each other, and where."""

from relmodel.arrays import Floats, Ints
from relmodel.compiled import helper, kernel


@helper
def _along(px: float, py: float, x0: float, y0: float, x1: float, y1: float) -> float:
    """Where on a segment, 0 to 1, it is nearest to a point."""
    dx, dy = x1 - x0, y1 - y0
    square = dx * dx + dy * dy
    return 0.0 if square == 0.0 else min(max(((px - x0) * dx + (py - y0) * dy) / square, 0.0), 1.0)


@kernel("i8(f8[:, ::1], i8[::1], i8, f8, f8, i8[:, ::1])")
def near_boxes(boxes: Floats, order: Ints, first: int, reach: float, shorter: float, out: Ints) -> int:
    """Pairs of boxes (n, 4: least x and y, greatest x and y) no farther apart than `reach` along x and along y, or than
    `shorter`, which is no longer, where one is numbered from `first` on: their count, and the lesser and greater number
    of as many as `out` has room for.  `order`: by least x."""
    count = 0
    for at in range(len(order)):
        i = order[at]
        for later in range(at + 1, len(order)):
            j = order[later]
            if boxes[j, 0] - boxes[i, 2] > reach:
                break
            allowed = reach if max(i, j) < first else shorter
            down = max(boxes[j, 1] - boxes[i, 3], boxes[i, 1] - boxes[j, 3])
            if boxes[j, 0] - boxes[i, 2] <= allowed and down <= allowed:
                if count < len(out):
                    out[count, 0], out[count, 1] = min(i, j), max(i, j)
                count += 1
    return count


@kernel("void(f8[:, ::1], i8[::1], f8[:, ::1], i8[::1], i8[::1], f8[:, ::1], i8[:, ::1])")
def least_gaps(
    segments: Floats, offsets: Ints, boxes: Floats, one: Ints, other: Ints, place: Floats, which: Ints
) -> None:
    """Of each pair of curves the least gap squared and how far along its segment each comes nearest, `place` (k, 3),
    the first filled in with the greatest gap squared that is looked for; and the two segments, `which` (k, 2), which
    stay as they are where the gap is greater.

    Curve i has the `segments` (m, 4: x and y of both ends) from `offsets[i]` to `offsets[i + 1]`, in its box
    `boxes[i]` (n, 4: least x and y, greatest x and y)."""
    for k in range(len(one)):
        a, b = one[k], other[k]
        best = place[k, 0]
        for i in range(offsets[a], offsets[a + 1]):
            ax0, ay0, ax1, ay1 = segments[i, 0], segments[i, 1], segments[i, 2], segments[i, 3]
            across = max(boxes[b, 0] - max(ax0, ax1), min(ax0, ax1) - boxes[b, 2], 0.0)
            down = max(boxes[b, 1] - max(ay0, ay1), min(ay0, ay1) - boxes[b, 3], 0.0)
            if across * across + down * down >= best:
                continue
            for j in range(offsets[b], offsets[b + 1]):
                bx0, by0, bx1, by1 = segments[j, 0], segments[j, 1], segments[j, 2], segments[j, 3]
                across = max(min(bx0, bx1) - max(ax0, ax1), min(ax0, ax1) - max(bx0, bx1), 0.0)
                down = max(min(by0, by1) - max(ay0, ay1), min(ay0, ay1) - max(by0, by1), 0.0)
                if across * across + down * down >= best:
                    continue
                # where they cross, or else at an end of one of them
                dx, dy, ex, ey = ax1 - ax0, ay1 - ay0, bx1 - bx0, by1 - by0
                cross = dx * ey - dy * ex
                crossed = False
                if cross != 0.0:
                    t = ((bx0 - ax0) * ey - (by0 - ay0) * ex) / cross
                    u = ((bx0 - ax0) * dy - (by0 - ay0) * dx) / cross
                    crossed = 0.0 <= t <= 1.0 and 0.0 <= u <= 1.0
                    if crossed:
                        best = 0.0
                        place[k, 1], place[k, 2] = t, u
                        which[k, 0], which[k, 1] = i, j
                if not crossed:
                    for end in range(4):
                        if end < 2:
                            t = float(end)
                            u = _along(ax0 + t * dx, ay0 + t * dy, bx0, by0, bx1, by1)
                        else:
                            u = float(end - 2)
                            t = _along(bx0 + u * ex, by0 + u * ey, ax0, ay0, ax1, ay1)
                        x, y = ax0 + t * dx - bx0 - u * ex, ay0 + t * dy - by0 - u * ey
                        if x * x + y * y < best:
                            best = x * x + y * y
                            place[k, 1], place[k, 2] = t, u
                            which[k, 0], which[k, 1] = i, j
        place[k, 0] = best
