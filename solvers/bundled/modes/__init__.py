"""Modes of the inflated tyre that is the same all round, and their slopes."""
