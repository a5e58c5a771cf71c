"""Laws of the tyre's materials."""
