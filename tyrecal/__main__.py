"""``python -m tyrecal`` is the command line."""

from .cli.main import main

main()
