"""Loaded objects shown and handed on: their trees, files for other programs, pictures."""
