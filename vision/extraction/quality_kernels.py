"""Compiled kernels of arc quality: the grey on both sides of edge elements, and what runs parallel around them."""

from relmodel.arrays import Bytes, Floats, Ints, Ints32
from relmodel.compiled import kernel


@kernel("void(f8[:, ::1], f8[::1], f8[::1], f8[::1], f8[::1], f8[::1], f8[:, ::1])")
def grey_across(grey: Floats, x: Floats, y: Floats, nx: Floats, ny: Floats, distances: Floats, out: Floats) -> None:
    """`out` (n, d): the bilinear grey at each distance along the normals; beyond the border, that of the border."""
    rows, columns = grey.shape
    for i in range(len(x)):
        for j in range(len(distances)):
            px = min(max(x[i] + distances[j] * nx[i], 0.0), columns - 1.0)
            py = min(max(y[i] + distances[j] * ny[i], 0.0), rows - 1.0)
            c, r = min(int(px), columns - 2), min(int(py), rows - 2)
            u, v = px - c, py - r
            above = grey[r, c] + u * (grey[r, c + 1] - grey[r, c])
            below = grey[r + 1, c] + u * (grey[r + 1, c + 1] - grey[r + 1, c])
            out[i, j] = above + v * (below - above)


@kernel("void(i4[::1], i4[::1], i8[::1], i8[::1], i8, i4[::1], i8, u1[::1], f8[::1])")
def parallels(
    cell: Ints32,
    kind: Ints32,
    near: Ints,
    alike: Ints,
    grades: int,
    which: Ints32,
    fainter: int,
    grid: Bytes,
    out: Floats,
) -> None:
    """(n,) for each element of `which`: how many lie in the cells `near`, are of a turn that is `alike`, and of its
    grade, of up to `fainter` grades below, or above.

    `cell` is the place of an element's cell in `grid`, zeros at first, which counts in each cell those of each kind,
    turn times `grades` plus grade, and of higher grade; `near` are steps from one cell to another, `alike` from one
    turn's kinds to another's, those of turn t at 3 t.
    """
    for i in range(len(cell)):
        for faint in range(cell[i] + kind[i] - kind[i] % grades, cell[i] + kind[i] + 1):
            grid[faint] += 1
    for at in range(len(which)):
        i = which[at]
        turn = kind[i] // grades
        first = max(kind[i] - turn * grades - fainter, 0)
        total = 0
        for offset in near:
            for step in alike[3 * turn : 3 * turn + 3]:
                total += grid[cell[i] + offset + step + first]
        out[at] = total
