"""Sensitivities to the numbers of a case, and which numbers to free in a fit."""
