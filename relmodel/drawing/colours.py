"""What each colour means, in every picture and page."""

from __future__ import annotations

from collections.abc import Sequence

Rgb = tuple[int, int, int]

# Of edges of the model over pictures, the worst first: the worse is drawn above.
STATES: dict[str, Rgb] = {
    "contradicted": (255, 59, 48),
    "changed": (255, 159, 10),
    "not_confirmed": (255, 214, 10),
    "undecidable": (154, 167, 176),
    "confirmed": (61, 220, 115),
}
BLEND: Rgb = (90, 162, 255)  # edges of fillets, which show as shading and not as edges
UNEXPLAINED: Rgb = (255, 107, 255)  # what the model does not account for

# Of features by kind.
KINDS: dict[str, Rgb] = {
    "body": (214, 206, 190),
    "pocket": (124, 164, 206),
    "through_hole": (230, 85, 60),
    "blind_hole": (240, 150, 60),
    "boss": (60, 150, 110),
    "lug": (150, 105, 190),
    "duct": (200, 60, 130),
    "flange": (222, 190, 80),
    "rib": (130, 190, 120),
    "web": (170, 205, 225),
    "open_slot": (90, 175, 180),
    "slot": (60, 130, 150),
    "step": (165, 140, 100),
    "fillet": (245, 200, 190),
    "chamfer": (190, 120, 90),
}
PLAIN: Rgb = (196, 200, 204)  # what belongs to no feature
INK: Rgb = (40, 40, 40)
_OTHERS: tuple[Rgb, ...] = ((160, 160, 60), (110, 110, 200), (200, 130, 200), (100, 140, 60))


def colours_of(kinds: Sequence[str]) -> list[Rgb]:
    """The colour of each kind of feature; of kinds that have none of their own, in turn."""
    return [KINDS.get(kind, _OTHERS[i % len(_OTHERS)]) for i, kind in enumerate(kinds)]


def hexadecimal(rgb: Sequence[float]) -> str:
    """A colour (0 to 255) as pages spell it."""
    return "#" + "".join(f"{int(c):02x}" for c in rgb)
