"""From an image to edge elements, arcs, regions, topography and the relations among them."""
