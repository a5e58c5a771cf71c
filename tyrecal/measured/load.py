"""A case with its targets, those too that stand in a file of measurements: what commands, batches
and programs load."""

from __future__ import annotations

from pathlib import Path

from ..errors import InputError
from ..tyre import load
from ..tyre.case import CaseError, LoadedCase
from ..tyre.case.mistakes import Mistake


def load_case(path: Path | str, allow_unusual: bool = False) -> LoadedCase:
    """Read a case file, and the file that its targets stand in. Raises CaseError with every mistake
    in them."""
    return _with_own_file(load.load_case(path, allow_unusual))


def judged(
    path: Path | str, allow_unusual: bool = False
) -> tuple[LoadedCase | None, list[Mistake]]:
    """The case, None where it is wrong, and every mistake in it and the files that it names:
    targets that no fit can use are one, too."""
    loaded, mistakes = load.judged(path, allow_unusual)
    if loaded is None or loaded.measured is None:
        return loaded, mistakes
    try:
        loaded = _with_own_file(loaded, to_fit=True)
    except CaseError as error:
        return None, error.mistakes
    mistake = load.unfit_targets(loaded)
    return (None, [mistake]) if mistake else (loaded, [])


def _with_own_file(loaded: LoadedCase, to_fit: bool = False) -> LoadedCase:
    """`with_own_file`; to_fit: check also what a fit checks (`with_measured`), if all frequencies
    have labels. Raises CaseError."""
    path = loaded.measured
    if path is None:
        return loaded
    from .tables import read_measurements
    from .targets import with_measured, with_own_file

    try:
        if to_fit and not any(
            each.is_unlabelled for each in read_measurements(path, labelled=False)
        ):
            with_measured(loaded, path)
        return with_own_file(loaded)
    except OSError as error:
        # of no line, key or value
        mistakes = [Mistake(str(path), 0, "", "", f"cannot be read: {error.strerror or error}")]
    except InputError as error:
        mistakes = [_mistake(path, line) for line in str(error).splitlines()]
    raise CaseError(mistakes)


def _mistake(path: Path, sentence: str) -> Mistake:
    """A sentence that begins with the file, and its line where it has one."""
    place, _, words = sentence.removeprefix(str(path)).partition(": ")
    line = place.rpartition(", line ")[2]
    return Mistake(str(path), int(line) if line.isdecimal() else 0, "", "", words)
