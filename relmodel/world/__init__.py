"""Worlds: objects placed in a cell, and their expansion into placed parts with boxes."""

from relmodel.world.placement import WorldReport, place_world
from relmodel.world.world_file import WorldFile, read_world_file

__all__ = ["WorldFile", "WorldReport", "place_world", "read_world_file"]
