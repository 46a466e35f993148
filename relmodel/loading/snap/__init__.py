"""Numbers of a model settled on those of the store, from which they differ by round-off."""
