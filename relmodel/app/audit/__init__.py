"""What runs decided and why, and what differs between two of them, from rows only."""
