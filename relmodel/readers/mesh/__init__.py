"""Meshes: triangles cut into regions, surfaces fitted to these, and arcs between them."""
