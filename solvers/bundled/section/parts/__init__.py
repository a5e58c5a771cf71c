"""Parts of the tyre and the loads that act on it, one per file."""
