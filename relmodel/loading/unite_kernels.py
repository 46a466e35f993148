"""Compiled union of neighbouring pieces of one surface.

Importing this module loads numba: import it where a mesh is cut.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from relmodel.loading.algebra_kernels import INTEGERS, MATRIX, VECTOR, inner, types
from relmodel.loading.distance_kernels import CONE, TORUS, worst
from relmodel.loading.patch_kernels import (
    LEAST_EXACT,
    LEAST_STEEP,
    MOST_INEXACT,
    PATCHES,
    SHARE_OF_GAP,
    Patches,
    facets_of,
    gap_of,
    points_of,
    share,
    trim,
)
from relmodel.loading.refine_kernels import refine
from relmodel.loading.start_kernels import start

_MOST_OF_GAP = 0.5  # vertices on a border lie nearer to a surface than this share of its gap
_MORE_GAP = 1.2  # what the gap of a union may be in that of its pieces


@inner(
    types.Tuple((types.int64, types.float64))(
        types.int64, VECTOR, types.int64, VECTOR, INTEGERS, types.int64, MATRIX, PATCHES, types.float64, VECTOR
    )
)
def _common(
    kind_a: int, row_a: Any, kind_b: int, row_b: Any, members: Any, n: int, points: Any, m: Patches, tolerance: float,
    s: Any,
) -> tuple[int, float]:  # fmt: skip
    """Kind (0 none) and gap of a surface, put into `s`, that holds the members of two."""
    middles, facing = facets_of(members, n, m)
    for kind in range(1, max(kind_a, kind_b) + 1):
        if kind == TORUS:
            s[:] = row_a if kind_a == TORUS else row_b
        elif not start(kind, points, middles, facing, row_a, s):
            continue
        refine(kind, s, points, tolerance)
        trim(kind, s, points, tolerance)
        if kind == CONE and not abs(s[8]) >= LEAST_STEEP:
            continue
        gap = gap_of(kind, s, members, n, m)
        near = min(_MOST_OF_GAP * gap, MOST_INEXACT * tolerance)
        if worst(kind, s, points) <= near and share(kind, s, points, SHARE_OF_GAP * gap) >= LEAST_EXACT:
            return kind, gap
    return 0, 0.0


@inner(wrapped=True)
def unite(m: Patches, tolerance: float, owner: Any, kinds: Any, rows: Any, gaps: Any, count: int) -> None:
    """Make surfaces that run smoothly into each other one where there is one, of a kind of no more parameters, that
    holds both: where a border is less exact than the mesh is fine, a surface comes in pieces."""
    mark, members = np.full(len(m.points), -1), np.empty(len(owner), np.int64)
    begin, tail, met = np.full(count, -1), np.full(count, -1), np.full(count, -1)
    following = np.full(len(owner), -1)
    for p in range(len(owner)):
        o = owner[p]
        if o >= 0:
            if begin[o] < 0:
                begin[o] = p
            else:
                following[tail[o]] = p
            tail[o] = p
    s, stamp = np.empty(10), 0
    for a in range(count):
        patch = begin[a]
        while patch >= 0:  # those of the surfaces that `a` takes, too
            for e in range(m.next_start[patch], m.next_start[patch + 1]):
                b = owner[m.next_patch[e]]
                if b < 0 or b == a or met[b] == a or m.crease[e, 1] == 0:
                    continue
                met[b] = a
                n = 0
                for o in (a, b):
                    p = begin[o]
                    while p >= 0:
                        members[n] = p
                        n += 1
                        p = following[p]
                stamp += 1
                points = points_of(members, n, m, mark, stamp)
                kind, gap = _common(kinds[a], rows[a], kinds[b], rows[b], members, n, points, m, tolerance, s)
                if kind == 0 or gap > _MORE_GAP * max(gaps[a], gaps[b]):
                    continue
                rows[a] = s
                kinds[a], gaps[a] = kind, gap
                following[tail[a]], tail[a], begin[b] = begin[b], tail[b], -1
                for k in range(n):
                    owner[members[k]] = a
            patch = following[patch]
