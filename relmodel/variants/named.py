"""Resolving a name and a variant to a loaded variant."""

from __future__ import annotations

from typing import NamedTuple

from sqlalchemy import Connection

from relmodel.errors import UsageError
from relmodel.store import Store
from relmodel.text import nearest_name


class NamedVariant(NamedTuple):
    """The newest revision of a variant of an object."""

    id: int
    object_id: int
    name: str
    variant: str
    revision: int


def find_variant(store: Store, connection: Connection, name: str, variant: str = "") -> NamedVariant:
    """The newest revision of a variant; where none is said, of the plain variant or of the only one.

    Raises UsageError that lists the variants, or the objects, where there is no such one.
    """
    loaded = store.rows(connection, "object/newest", run=None)
    own = {row.variant: row for row in loaded if row.name == name}
    found = own.get(variant) or (next(iter(own.values())) if not variant and len(own) == 1 else None)
    if found is not None:
        return NamedVariant(
            int(found.object_variant_id), int(found.object_id), name, str(found.variant), int(found.revision)
        )
    asked = f"{name} variant {variant}" if variant else name
    if own:
        known = ", ".join(v or "the plain one" for v in own)
        lacks = f"there is no object {asked}" if variant else f"{name} has several variants"
        raise UsageError(f"{lacks}: name one of its variants: {known}")
    names = sorted({str(row.name) for row in loaded})
    near = nearest_name(name, names)
    raise UsageError(
        f"there is no object {asked}: "
        + (f"did you mean {near}? " if near else "")
        + f"name one of those loaded: {', '.join(names) or 'there are none'}"
    )
