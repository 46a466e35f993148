"""Compiled kernels of linking: what lies near to what, and what belongs together."""

from math import sqrt

from relmodel.arrays import Bools, Floats, Ints, Ints32
from relmodel.compiled import kernel


@kernel("void(f8[::1], f8[::1], f8[::1], f8[::1], i4[::1], i4[:, ::1], f8[::1], f8[:, ::1], i4[:, ::1])")
def best_links(
    x: Floats,
    y: Floats,
    nx: Floats,
    ny: Floats,
    pixel: Ints32,
    at: Ints32,
    limits: Floats,
    least: Floats,
    best: Ints32,
) -> None:
    """The best element ahead of each along its tangent (-ny, nx), and the best behind: `best` (2, n), at first -1.

    Looked for in 5 x 5 pixels at cost d + a (1 - cos turn) + b (1 - cos(chord, mean tangent)).  `limits`: the least of
    both cosines, a and b.  `at` (rows, columns) contains the elements of the pixels, or -1; `least` (2, n) the costs,
    at first what none exceeds.
    """
    rows, columns = at.shape
    min_turn, min_along, turn_price, chord_price = limits[0], limits[1], limits[2], limits[3]
    # Each pair is priced once, from its first; `pixel` ascends, so of equal prices the first in the picture is kept.
    for i in range(len(x)):
        r, c = pixel[i] // columns, pixel[i] % columns
        for rr in range(r, min(r + 3, rows)):
            for cc in range(c + 1 if rr == r else max(c - 2, 0), min(c + 3, columns)):
                j = at[rr, cc]
                if j < 0:
                    continue
                turn = nx[i] * nx[j] + ny[i] * ny[j]
                if turn < min_turn:
                    continue
                dx, dy = x[j] - x[i], y[j] - y[i]
                d = sqrt(dx * dx + dy * dy)
                mx, my = -(ny[i] + ny[j]), nx[i] + nx[j]
                along = (dx * mx + dy * my) / (max(d, 1e-9) * sqrt(mx * mx + my * my))
                if abs(along) < min_along:
                    continue
                cost = d + turn_price * (1.0 - turn) + chord_price * (1.0 - abs(along))
                ahead = 0 if along > 0.0 else 1
                if cost < least[ahead, i]:
                    least[ahead, i] = cost
                    best[ahead, i] = j
                if cost < least[1 - ahead, j]:
                    least[1 - ahead, j] = cost
                    best[1 - ahead, j] = i


@kernel("i8(i4[::1], b1[::1], b1[::1], i4[::1], i4[::1], b1[::1])")
def follow(successor: Ints32, starts: Bools, seen: Bools, order: Ints32, offsets: Ints32, closed: Bools) -> int:
    """Chains of a one-to-one successor map of n elements, and how many: the elements in order (n,), the offsets
    (n + 1,) of the chains, and whether each is a loop (n,).

    Open chains first, then loops, each in the order of their first (least) element.  `starts`: what succeeds nothing;
    `seen` is False at first.
    """
    n = len(successor)
    chains, filled = 0, 0
    offsets[0] = 0
    for loops in range(2):
        for start in range(n):
            if seen[start] or not (loops or starts[start]):
                continue
            i = start
            while i >= 0 and not seen[i]:
                seen[i] = True
                order[filled] = i
                filled += 1
                i = successor[i]
            closed[chains] = loops == 1
            chains += 1
            offsets[chains] = filled
    return chains


@kernel("i8(f8[::1], f8[::1], b1[::1], i8[::1], f8, i8[:, ::1])")
def pairs_within(x: Floats, y: Floats, looked: Bools, order: Ints, reach: float, out: Ints) -> int:
    """How many pairs i < j of points, at least one of them `looked` at, lie no farther from each other than `reach`, in
    any order; of these as many in `out` (n, 2) as it has room for.  By `order` x ascends."""
    count = 0
    for first in range(len(order)):
        i = order[first]
        for second in range(first + 1, len(order)):
            j = order[second]
            dx, dy = x[j] - x[i], y[j] - y[i]
            if dx > reach:
                break
            if dx * dx + dy * dy <= reach * reach and (looked[i] or looked[j]):
                if count < len(out):
                    out[count, 0], out[count, 1] = min(i, j), max(i, j)
                count += 1
    return count


@kernel("void(i8[:, ::1], i8[::1], i8[::1])")
def components(pairs: Ints, root: Ints, out: Ints) -> None:
    """Which belong together by `pairs` (n, 2): `out` (m,) their number, in the order of their first.  `root` (m,) is
    each itself at first."""
    for at in range(len(pairs)):
        one, other = pairs[at, 0], pairs[at, 1]
        while root[one] != one:
            root[one] = root[root[one]]
            one = root[one]
        while root[other] != other:
            root[other] = root[root[other]]
            other = root[other]
        root[max(one, other)] = min(one, other)
    found = 0
    for i in range(len(out)):
        if root[i] == i:
            out[i] = found
            found += 1
        else:
            out[i] = out[root[i]]  # of one before it
