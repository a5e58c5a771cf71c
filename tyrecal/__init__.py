"""tyrecal: calibrates tyre finite element models to measured modes."""

__version__ = "0.1.0"
