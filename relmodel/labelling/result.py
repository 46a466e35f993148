"""What a matcher found, and the proof of it."""

from __future__ import annotations

from dataclasses import dataclass

from relmodel.arrays import Ints

OPTIMAL, BOUNDED, STOPPED = "optimal", "bounded", "stopped"

ROOT, TAKE, REST = "root", "take", "rest"
BRANCHED, PRUNED, OPEN = "branched", "pruned", "open"


@dataclass(frozen=True)
class SearchNode:
    """A set of labellings, bounded from below by the duals of `proof`: the node itself, or its parent.

    branch: `root` (all of them), `take` (those of the parent in which `unit` has `label`, -1 for none) or `rest` (those
    of the parent that none of its `take` children holds); so the children of a node cover it.  bound: no labelling of
    the node costs less, or none costs less than what was found.  status: `branched` (it has children), `pruned` (it
    holds nothing better than what was found, or nothing within the limit), `open` (the search ended before it).
    """

    node: int
    parent: int
    proof: int
    depth: int
    branch: str
    unit: int
    label: int
    bound: int
    status: str


@dataclass(frozen=True)
class Proof:
    """Duals of one node, in units of 1 / SCALE of a cost; what is not listed is 0.

    label, price (prices,): label duals, <= 0; unit, unit_label, neighbour, message (messages,): y(u, l, v) >= 0.
    """

    node: int
    label: Ints
    price: Ints
    unit: Ints
    unit_label: Ints
    neighbour: Ints
    message: Ints


@dataclass(frozen=True)
class MatchingResult:
    """label (units,), -1 for none; cost of it; bound: no labelling costs less.

    status: `optimal` (cost = bound), `bounded` (the search ended with a gap: no labelling costs less than bound, which
    suffices to know that none is within the limit, or is all that the mode can tell), `stopped` (a limit on nodes or
    seconds ended it).  nodes: searched; selections: units or functions instantiated.  tree, proofs: of the default
    mode; from them follows `proved`, which falls short of `bound` where the proof was too long to be kept.
    """

    mode: str
    label: Ints
    cost: int
    bound: int
    proved: int
    status: str
    nodes: int
    selections: int
    tree: tuple[SearchNode, ...]
    proofs: tuple[Proof, ...]

    @property
    def gap(self) -> float:
        """Part of the cost that is not proved, 0 to 1."""
        return (self.cost - self.bound) / max(abs(self.cost), 1)
