"""What the pictures are held against: triangles and sampled arcs of a world."""
