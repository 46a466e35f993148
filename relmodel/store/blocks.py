"""The blocks of a DuckDB file against the checksum that each begins with.

DuckDB itself compares them when it reads a block: one of an index perhaps never, until it is to be written.  The layout
is that of its single_file_block_manager.cpp and metadata_manager.cpp, all little-endian: three headers of 4096 bytes,
of which the later two describe the database and the newer of these counts, then blocks of one size.
"""

from __future__ import annotations

import struct
from pathlib import Path
from typing import BinaryIO

import numpy as np

from relmodel.store.replacing import locked_for_reading

_HEADER = 4096
_FIRST = 3 * _HEADER  # where the blocks begin
_PARTS = 64  # of a block of metadata; each begins with where the next of its chain is
_LAST = 2**64 - 1


def damaged_blocks(file: Path) -> list[int]:
    """Numbers of the blocks in use whose content is not what their checksums say.

    No connection of this process may have the file open: closing it here would let go of DuckDB's lock.
    """
    with locked_for_reading(file) as source:
        heads = source.read(_FIRST)
        _, _, free_list, count, size = max(struct.unpack_from("<5Q", heads, at + 8) for at in (_HEADER, 2 * _HEADER))
        used = sorted(set(range(count)) - _free_blocks(source, free_list, size))
        return [number for number in used if _read(source, number, size) is None]


def _read(source: BinaryIO, number: int, size: int) -> bytes | None:
    """What a block holds behind its checksum; None where it is damaged."""
    source.seek(_FIRST + number * size)
    words = np.fromfile(source, "<u8", size // 8)
    if len(words) < size // 8:
        return None
    mixed = words[1:] * np.uint64(0xBF58476D1CE4E5B9)
    return words[1:].tobytes() if np.bitwise_xor.reduce(mixed) ^ np.uint64(5381) == words[0] else None


def _free_blocks(source: BinaryIO, pointer: int, size: int) -> set[int]:
    """The blocks that the free list names, none where it is damaged.  A pointer is the number of a block, and in its
    highest byte that of a part of it."""
    listed, part = b"", (size - 8) // _PARTS // 8 * 8
    while pointer != _LAST:
        content = _read(source, pointer & (1 << 56) - 1, size)
        if content is None:
            return set()
        begin = (pointer >> 56) * part
        pointer = int.from_bytes(content[begin : begin + 8], "little")
        listed += content[begin + 8 : begin + part]
    count = int.from_bytes(listed[:8], "little")
    return set(struct.unpack_from(f"<{count}Q", listed, 8)) if count else set()
