"""Files that are written whole or not at all."""

from __future__ import annotations

import contextlib
import json
import secrets
from collections.abc import Iterator
from pathlib import Path
from typing import Any

TYRE = ("section.png", "modes.png", "mode_[0-9]*_[0-9]*.png", "mode_[0-9]*_[0-9]*.vtu")
RESULTS = {  # of a study, by pattern: what a new run of it takes the place of
    "fit": ("fit.json", "fit.csv", "fit_history.csv", "fit_shapes.json", "convergence.png", *TYRE),
    "modes": ("modes.json", "modes_shapes.json", *TYRE),
    "sweep-load": ("load_sweep.json", "load_sweep.csv", "load_sweep.png"),
    "sweep-pressure": ("pressure_sweep.json", "pressure_sweep.csv", "pressure_sweep.png"),
    "footprint": ("footprint.json", "footprint.csv", "footprint_patches.json", "footprint.png",
                  "footprint_initial*.png", "footprint_fitted*.png", "footprint_*N.vtu"),
    "effects": ("effects.json", "effect_*.png"),
    "diagnose": ("diagnosis.json", "diagnosis.md", "diagnosis_*.json", "diagnosis_*.png"),
    "batch": ("batch.json",),
}  # fmt: skip
PREVIOUS = "previous"  # folder in which results stand aside


def set_aside(folder: Path, study: str) -> None:
    """Move an earlier run's results to `PREVIOUS`: they must not pass for those of a run that
    fails, nor be lost with it. Raises OSError."""
    for file in _results(folder, study):
        (folder / PREVIOUS).mkdir(exist_ok=True)
        file.replace(folder / PREVIOUS / file.name)


def forget_previous(folder: Path, study: str) -> None:
    """Remove what `set_aside` moved and a new run has written again. Raises OSError."""
    for file in _results(folder / PREVIOUS, study):
        if (folder / file.name).exists():
            file.unlink(missing_ok=True)
    with contextlib.suppress(OSError):  # it was never made, or holds more
        (folder / PREVIOUS).rmdir()


def _results(folder: Path, study: str) -> list[Path]:
    return [file for pattern in RESULTS[study] for file in folder.glob(pattern)]


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
