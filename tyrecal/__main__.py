"""The command ``tyrecal``, as ``python -m tyrecal`` too: interruptions count from here on."""

from .interrupt import leave_when_interrupted

leave_when_interrupted()

from .cli.main import main  # noqa: E402  takes a tenth of a second

if __name__ == "__main__":
    main()
