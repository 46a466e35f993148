"""The cell of the paper's figure 1: two arms on translating bases, a table between them, the bulkhead on it."""
