"""A hierarchical relational model of machined objects, kept as SQL tables."""

__version__ = "0.1.0"
