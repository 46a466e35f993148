"""Boundary representations from rows alone: measures of arcs, trims, areas, volumes and boxes of faces."""
