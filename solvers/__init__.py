"""Solvers that tyrecal can drive, one folder each. None of them imports tyrecal."""
