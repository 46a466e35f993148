"""One account of the predicted edges: where each lies in each picture, what is found there, and what that says."""
