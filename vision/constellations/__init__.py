"""Poses of a rig from constellations: circles that stereo puts in space, joined in pairs with those of the model."""
