"""Numbers of a model snapped to those of the store, from which they differ by round-off."""
