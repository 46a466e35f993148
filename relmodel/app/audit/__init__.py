"""What runs decided and why, and what differs between two of them: asked of the rows alone."""
