"""What a person sees of a store: pages of runs, objects and variants, each one file that needs no network."""
