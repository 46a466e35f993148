"""From where to look next: the views that would check most of what is left of a part."""
