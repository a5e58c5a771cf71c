"""Modes of a tyre that is not the same all round, or that turns."""
