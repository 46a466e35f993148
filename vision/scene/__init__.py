"""The model that pictures are compared with: triangles and sampled arcs of a world."""
