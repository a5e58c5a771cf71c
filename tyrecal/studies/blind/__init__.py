"""Blind trials of the diagnosis: data whose effect is sealed, answers, and a separate scorer."""
