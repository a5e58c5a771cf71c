"""The tyre's section: its mesh and parts, what holds it, and its state under pressure."""
