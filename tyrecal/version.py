"""The edition of the tool, the same as in pyproject.toml."""

__version__ = "0.2.0"
SITE = ""  # address of the documentation; empty until the project has a public home
BUILD_SITE = "sphinx-build -c cases/site . build/site"  # the command that builds it
