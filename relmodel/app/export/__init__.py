"""What other programs take from a store: tables, results of a run, GLB."""
