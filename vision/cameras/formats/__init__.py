"""Formats of calibrated rigs, a module each.  A format refuses by name what a rig cannot hold.

`parse(data, path)` makes a rig of what a file says; only the project's own is written (`own.write`).  Lengths of a rig
are mm and pixel (0, 0) is the centre of the top-left pixel, whatever the format has.
"""
