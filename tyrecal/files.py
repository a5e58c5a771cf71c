"""Files that are written whole or not at all."""

from __future__ import annotations

import contextlib
import json
import secrets
from collections.abc import Iterator
from pathlib import Path
from typing import Any

RESULTS = {  # of a study: what a new run of it takes the place of
    "fit": ("fit.json", "fit.csv", "fit_history.csv", "fit_shapes.json", "convergence.png"),
    "modes": ("modes.json", "modes_shapes.json"),
    "sweep-load": ("load_sweep.json", "load_sweep.csv", "load_sweep.png"),
    "sweep-pressure": ("pressure_sweep.json", "pressure_sweep.csv", "pressure_sweep.png"),
    "footprint": ("footprint.json", "footprint.csv", "footprint_patches.json", "footprint.png"),
    "effects": ("effects.json",),
    "diagnose": ("diagnosis.json", "diagnosis.md", "diagnosis_section.json"),
    "batch": ("batch.json",),
}


PREVIOUS = "previous"  # folder in which results stand aside


def set_aside(folder: Path, study: str) -> None:
    """Move an earlier run's results to `PREVIOUS`: they must not pass for those of a run that
    fails, nor be lost with it. Raises OSError."""
    for name in RESULTS[study]:
        if (folder / name).exists():
            (folder / PREVIOUS).mkdir(exist_ok=True)
            (folder / name).replace(folder / PREVIOUS / name)


def forget_previous(folder: Path, study: str) -> None:
    """Remove what `set_aside` moved, once a new run has taken its place. Raises OSError."""
    for name in RESULTS[study]:
        (folder / PREVIOUS / name).unlink(missing_ok=True)
    with contextlib.suppress(OSError):  # it was never made, or holds another study's
        (folder / PREVIOUS).rmdir()


@contextlib.contextmanager
def whole(path: Path, many_writers: bool = False) -> Iterator[Path]:
    """A path beside ``path`` to write to; it takes its place at the end, or is removed.

    Raises OSError, naming ``path``, where the disc is full or the folder cannot be written.
    """
    mark = f".{secrets.token_hex(8)}" if many_writers else ""
    partial = path.with_name(f".{path.name}{mark}.partial")
    try:
        yield partial
        partial.replace(path)
    except BaseException as error:
        with contextlib.suppress(OSError):
            partial.unlink(missing_ok=True)
        if isinstance(error, OSError):
            raise OSError(error.errno, error.strerror or str(error), str(path)) from None
        raise


def write_text(path: Path, text: str, many_writers: bool = False) -> None:
    """Write ``text`` whole or not at all, the same bytes on every system; see `whole`.

    Raises OSError.
    """
    with whole(path, many_writers) as partial:
        partial.write_text(text, encoding="utf-8", newline="")


def json_text(content: Any) -> str:
    """A result as JSON. Raises ValueError where a number of it is not finite."""
    return json.dumps(content, indent=1, allow_nan=False) + "\n"
