"""Relations among units, and the problems that are joined from them."""
