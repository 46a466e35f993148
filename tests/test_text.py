"""Which name was meant."""

from __future__ import annotations

import pytest

from relmodel.names import nearest_name

PATHS = (
    "bulkhead/BODY",
    *(f"bulkhead/BODY/{name}" for name in ("web 1", "web 19", "rib 1", "through_hole 2", "through_hole 12", "body 1")),
    *(f"bulkhead/CLIP_{i}/CLIP/through_hole 1" for i in (1, 2)),
)


@pytest.mark.parametrize(
    ("asked", "meant"),
    [
        ("bulkhead/BODY/hole 1", "bulkhead/BODY/through_hole 2"),
        ("bulkhead/CLIP_2/CLIP/hole 7", "bulkhead/CLIP_2/CLIP/through_hole 1"),
        ("bulkhead/BODY/through_hole 11", "bulkhead/BODY/through_hole 12"),
        ("bulkhead/BODY/wep 18", "bulkhead/BODY/web 19"),
        ("bulkhead/BODI", "bulkhead/BODY"),
        ("bulkhed/BODY/rib 1", "bulkhead/BODY/rib 1"),
        ("rib 7", "bulkhead/BODY/rib 1"),
        ("bulkhead/BODY/gusset 1", None),
        ("", None),
        ("a\nb" + "7" * 5000, None),
    ],
)
def test_the_word_decides_then_the_place_then_the_number(asked: str, meant: str | None) -> None:
    assert nearest_name(asked, PATHS) == meant
