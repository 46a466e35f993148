"""Cameras, rigs and priors; the pictures they take; what they can see of the world."""
