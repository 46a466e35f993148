"""Pictures of what the store holds: the model over a camera's picture, solids, scenes of a page, plots; from rows."""
