"""Parts placed in the assemblies of a model, however deep these are nested."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

import numpy as np

from relmodel.arrays import Floats, Ints
from relmodel.model.content_keys import assembly_order
from relmodel.model.model import Model


@dataclass(frozen=True)
class Places:
    """Parts placed in an assembly, in the order of the file.

    child: ordinal of the instance of the assembly that the part is, or stands in; pose: assembly_from_part, mm."""

    child: Ints  # (n,)
    shape: Ints  # (n,)
    pose: Floats  # (n, 4, 4)


class PlacedParts:
    """What is placed in each assembly of a model: each from those that stand in it, without recursion."""

    def __init__(self, model: Model) -> None:
        self.model = model
        self._of: dict[int, Places] = {}
        self._segments: dict[int, list[str]] = {}
        for i in assembly_order(model.assemblies):
            self._of[i] = self._places(i)

    def of(self, assembly: int) -> Places:
        return self._of[assembly]

    def path(self, assembly: int, place: int) -> str:
        """Path of the part of an assembly that stands in the row `place` of its places."""
        names = []
        while True:
            no = int(self._of[assembly].child[place])
            if assembly not in self._segments:
                self._segments[assembly] = segments([i.name for i in self.model.assemblies[assembly].instances])
            names.append(self._segments[assembly][no])
            instance = self.model.assemblies[assembly].instances[no]
            if instance.kind == "part":
                return "/".join(names)
            place -= int(np.searchsorted(self._of[assembly].child, no))
            assembly = instance.child

    def _places(self, assembly: int) -> Places:
        child, shape, pose = [np.empty(0, np.int64)], [np.empty(0, np.int64)], [np.empty((0, 4, 4))]
        for no, one in enumerate(self.model.assemblies[assembly].instances):
            if one.kind == "part":
                shape.append(np.array([self.model.parts[one.child].shape]))
                pose.append(one.parent_from_child[None])
            else:
                inside = self._of[one.child]
                shape.append(inside.shape)
                pose.append(one.parent_from_child @ inside.pose)
            child.append(np.full(len(shape[-1]), no))
        return Places(np.concatenate(child), np.concatenate(shape), np.concatenate(pose))


def segments(names: list[str]) -> list[str]:
    """Names of instances as pieces of paths, unlike each other; as the view `object_child` makes them."""
    plain = [name.replace("/", "_") for name in names]
    count = Counter(plain)
    return [f"{name}#{no}" if not name or "#" in name or count[name] > 1 else name for no, name in enumerate(plain)]
