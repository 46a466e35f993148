"""What a matcher found, and the tree of its search."""

from __future__ import annotations

from dataclasses import dataclass

from relmodel.arrays import Ints

OPTIMAL, BOUNDED, STOPPED = "optimal", "bounded", "stopped"

ROOT, TAKE, REST = "root", "take", "rest"
BRANCHED, PRUNED, OPEN = "branched", "pruned", "open"


@dataclass(frozen=True)
class SearchNode:
    """A set of labellings, bounded from below.

    branch: `root` (all of them), `take` (those of the parent in which `unit` has `label`, -1 for none) or `rest` (those
    of the parent that none of its `take` children holds); so the children of a node cover it.  bound: no labelling of
    the node costs less, or none costs less than what was found.  status: `branched` (it has children), `pruned` (it
    holds nothing better than what was found, or nothing within the limit), `open` (the search ended before it).
    """

    node: int
    parent: int
    depth: int
    branch: str
    unit: int
    label: int
    bound: int
    status: str


@dataclass(frozen=True)
class MatchingResult:
    """label (units,), -1 for none; cost of it; bound: no labelling costs less.

    status: `optimal` (cost = bound), `bounded` (the search ended with a gap: no labelling costs less than bound, which
    suffices to know that none is within the limit, or is all that the mode can tell), `stopped` (a limit on nodes or
    seconds ended it).  nodes: searched; selections: units or functions instantiated.  tree: of the default mode.
    """

    mode: str
    label: Ints
    cost: int
    bound: int
    status: str
    nodes: int
    selections: int
    tree: tuple[SearchNode, ...]
