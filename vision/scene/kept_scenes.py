"""Scenes of a store's worlds that are read once and kept, with what was made of them, for the next inspection."""

from __future__ import annotations

from collections.abc import Collection, Sequence

from sqlalchemy import Connection

from relmodel.store import Store
from vision.scene.stored_scene import StoredScene, read_scene

_MOST = 4  # selections of a world that are kept: views from a few places, over and over; some 60 MB each of a bulkhead


class Scenes:
    """Scenes of worlds of a store, as `read_scene` gives them; what is asked for again is the one that was given.

    A revision of a world is a world of its own.  All are read anew where a run that is no inspection has written since.
    """

    def __init__(self, store: Store) -> None:
        self.store = store
        self._changed: object = None
        self._kept: dict[tuple[int, tuple[int, ...] | None], StoredScene] = {}

    def read(self, connection: Connection, world_id: int, among: Sequence[int] | None = None) -> StoredScene:
        """The scene of the placed parts of a world; `among` and errors as those of `read_scene`."""
        (changed,) = self.store.rows(connection, "scene/changes")
        if changed != self._changed:
            self._kept.clear()
            self._changed = changed
        key = (world_id, None if among is None else tuple(among))
        found = self._kept.pop(key, None) or read_scene(self.store, connection, world_id, among)
        mine = [other for other in self._kept if other[0] == world_id]
        if len(mine) >= _MOST:
            del self._kept[mine[0]]  # what was asked for longest ago
        self._kept[key] = found
        return found

    def keep_only(self, worlds: Collection[int]) -> None:
        """Drop the scenes of all other worlds: of earlier revisions, and what is not inspected any more."""
        self._kept = {key: scene for key, scene in self._kept.items() if key[0] in worlds}
