"""Writing a loaded model into a store."""
