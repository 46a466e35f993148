"""Chaining edges of a mesh into arcs, by pointer jumping instead of a walk over the edges."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from relmodel.arrays import Bools, Floats, Ints
from relmodel.readers.mesh.mesh_parameters import DEFAULTS

_P = DEFAULTS.arcs


@dataclass
class Chains:
    """Edges in their order along chains: chain i has edges `edges[offsets[i]:offsets[i + 1]]`, and its vertices (one
    more than edges) are `vertices[offsets[i] + i : offsets[i + 1] + i + 1]`.  `turned` marks the edges that the chain
    runs against, whose side b is to the left of the chain."""

    offsets: Ints
    edges: Ints
    turned: Bools
    vertices: Ints

    @property
    def count(self) -> int:
        return len(self.offsets) - 1


def chain_edges(vertices: Floats, ends: Ints, side_a: Ints, side_b: Ints) -> Chains:
    """Chain edges (n, 2) that lie between the same two sides, where two meet and go on in about one direction.

    `side_a` and `side_b` (n,) are what lies to the left and to the right of an edge in its direction, -1 for nothing.
    A chain has the lesser of the two to its left.
    """
    n = len(ends)
    if n == 0:
        return Chains(np.zeros(1, np.int64), np.empty(0, np.int64), np.empty(0, bool), np.empty(0, np.int64))
    # Turn edges so that the lesser side is to the left: then chains have a direction.
    turned = (side_b < side_a) & (side_b >= 0)
    tail, head = np.where(turned, ends[:, 1], ends[:, 0]), np.where(turned, ends[:, 0], ends[:, 1])
    left, right = np.where(turned, side_b, side_a), np.where(turned, side_a, side_b)

    meeting = np.bincount(ends.ravel(), minlength=len(vertices))
    incoming = np.full(len(vertices), -1)
    incoming[head] = np.arange(n)
    before = incoming[tail]
    candidate = np.flatnonzero((before >= 0) & (meeting[tail] == 2))
    p = before[candidate]
    same = (left[p] == left[candidate]) & (right[p] == right[candidate])
    direction = vertices[head] - vertices[tail]
    direction /= np.maximum(np.linalg.norm(direction, axis=1, keepdims=True), 1e-300)
    same &= np.sum(direction[p] * direction[candidate], axis=1) > np.cos(_P.corner_rad)
    previous = np.full(n, -1)
    previous[candidate[same]] = p[same]

    start, rank = _ranks(previous)
    closed = np.flatnonzero(start < 0)
    if len(closed):
        # Rings have no beginning: cut them at their first edge.
        reach = np.full(n, n)
        reach[closed] = closed
        jump = previous.copy()
        for _ in range(max(1, int(np.ceil(np.log2(n + 1))))):
            reach[closed] = np.minimum(reach[closed], reach[jump[closed]])
            jump[closed] = jump[jump[closed]]
        previous[np.unique(reach[closed])] = -1
        start, rank = _ranks(previous)
    order = np.lexsort((rank, start))
    firsts = np.flatnonzero(np.concatenate([[True], start[order][1:] != start[order][:-1]]))
    offsets = np.append(firsts, n).astype(np.int64)
    # Chains follow each other by their first edge, which is their start.
    last_vertex = head[order[offsets[1:] - 1]]
    walked = np.insert(tail[order], offsets[1:], last_vertex)
    return Chains(offsets, order, turned[order], walked)


def without_lines(vertices: Floats, chains: Chains, which: Bools, fine: float) -> Chains:
    """Chains of which those that `which` says are cut where a straight run begins or ends that is much longer than
    what comes before and after: between two surfaces an edge may go on as another curve.

    Edges are one run where their common vertex is off its neighbours' line by rounding, `fine`, only.
    """
    chain = np.repeat(np.arange(chains.count), np.diff(chains.offsets))
    first = np.arange(len(chain)) + chain
    vector = vertices[chains.vertices[first + 1]] - vertices[chains.vertices[first]]
    length = np.linalg.norm(vector, axis=1)
    inside = chain[1:] == chain[:-1]
    off = np.linalg.norm(np.cross(vector[1:], vector[:-1]), axis=1) / np.maximum(length[1:], length[:-1])
    begins = np.concatenate([[True], ~inside | (off > 4 * fine)])
    start = np.flatnonzero(begins)
    run, of = np.add.reduceat(length, start), chain[start]
    before = np.where(np.concatenate([[False], of[1:] == of[:-1]]), np.concatenate([[0.0], run[:-1]]), 0.0)
    after = np.where(np.concatenate([of[1:] == of[:-1], [False]]), np.concatenate([run[1:], [0.0]]), 0.0)
    long = which[of] & (run > _P.long_run * np.maximum(before, after))
    cuts = np.concatenate([chains.offsets, start[long], np.append(start[1:], len(chain))[long]])
    offsets = np.unique(cuts)
    tail, last = chains.vertices[first], chains.vertices[first[offsets[1:] - 1] + 1]
    return Chains(offsets, chains.edges, chains.turned, np.insert(tail, offsets[1:], last))


def _ranks(previous: Ints) -> tuple[Ints, Ints]:
    """First edge of the chain of each edge and how far it is from there; -1 for edges of rings."""
    n = len(previous)
    rank = (previous >= 0).astype(np.int64)
    jump = np.where(previous >= 0, previous, np.arange(n))
    for _ in range(max(1, int(np.ceil(np.log2(n + 1))))):
        rank = rank + rank[jump]
        jump = jump[jump]
    ends_there = previous[jump] < 0
    return np.where(ends_there, jump, -1), rank
