"""What is there and what is not: evidence for every part, feature and surface in view, at the pose found."""
