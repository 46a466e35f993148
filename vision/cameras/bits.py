"""How many bits of sixteen a picture's values fill.

Cameras of 10, 12 or 14 bits write files of sixteen.  White has all bits set.  How many these are the rig says, else the
file, else the values: the least number of bits that holds them.  Values that were shifted up fill sixteen.
"""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from relmodel.errors import InputError

if TYPE_CHECKING:
    from PIL import Image

BITS = (8, 10, 12, 14, 16)
BITS_PER_SAMPLE = 258  # TIFF's tag
_GREATEST = (341, 281, 50717)  # SMaxSampleValue, MaxSampleValue, and WhiteLevel of DNG: the greatest value
_PNG_CHUNKS = 8  # where those of a PNG begin


def stated_bits(image: Image.Image, data: bytes) -> tuple[int, ...]:
    """How many bits a file of more than eight says that its values fill, the likelier first."""
    if image.format == "PPM":  # the reader stretches values to sixteen bits where their maximum is another
        codec = image.tile[0].args  # type: ignore[attr-defined]
        return (16,) if isinstance(codec, tuple) and codec[-1] < 2**16 - 1 else ()
    if image.format == "PNG":
        bits = _significant_bits(data)
        return (bits, 16) if 8 <= bits <= 16 else ()  # a file that keeps to the standard has shifted them up
    tags = getattr(image, "tag_v2", {})
    bits = max(tags.get(BITS_PER_SAMPLE, (8,)))
    if 8 < bits < 16:
        return (bits,)
    given = [np.asarray(tags.get(tag, 0)) for tag in _GREATEST]
    greatest = [value.max() for value in given if value.size and value.dtype.kind in "iuf"]
    return tuple(_least_bits(int(value).bit_length()) for value in greatest if 2**8 <= value < 2**16)


def _significant_bits(data: bytes) -> int:
    """What a PNG says in its chunk sBIT of its grey or colours; zero where it has none."""
    at = _PNG_CHUNKS
    while at + 8 < len(data) and (kind := data[at + 4 : at + 8]) != b"IDAT":
        (size,) = struct.unpack(">I", data[at : at + 4])
        if kind == b"sBIT":
            alpha = size in (2, 4)
            return max(data[at + 8 : at + 8 + size - alpha], default=0)
        at += size + 12
    return 0


def find_bits(
    pixels: npt.NDArray[np.generic], stated: tuple[int, ...], of_rig: int | None, path: object
) -> tuple[int, str]:
    """How many bits of sixteen pixels fill, and what says so: `of_rig` by the rig, `stated` by the file, or the values;
    path: what messages call the picture.

    Raises InputError where the rig says fewer than they have.
    """
    colours = pixels[..., :3] if pixels.ndim == 3 else pixels  # alpha fills all
    together = int(np.bitwise_or.reduce(colours, axis=None))
    used, unused = together.bit_length(), (together & -together).bit_length() - 1
    if of_rig is not None and used > of_rig:
        raise InputError(
            f"the image {path} has values of {used} bits, but its camera in the rig has {of_rig}: correct bits "
            "there, to 16 where values are shifted up"
        )
    if of_rig is not None:
        return of_rig, "rig"
    enough = [bits for bits in stated if used <= bits]
    if enough:
        return enough[0], "file"
    # Zeros below more than eight bits: values of a camera, shifted up.  Eight bits may come of a common picture.
    shifted = unused >= 2 and used - unused > 8
    return 16 if shifted else _least_bits(used), "values"


def _least_bits(used: int) -> int:
    return next(bits for bits in BITS if used <= bits)
