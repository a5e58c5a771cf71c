"""Files that are written whole or not at all, and read only where they are files.

Whatever lies in a folder of results or a record may be a stranger's: from an archive, a shared
disc, a repository. No link in it is followed, to write, delete or read; the folder that the user
names may be one.
"""

from __future__ import annotations

import contextlib
import errno
import glob
import json
import os
import secrets
import stat
import threading
from collections.abc import Collection, Iterator, Mapping
from pathlib import Path
from typing import Any, BinaryIO

from .errors import TyrecalError

MAX_FILE_BYTES = 50_000_000  # bytes of a file that is read whole; ours are a hundredth of it
NOFOLLOW = getattr(os, "O_NOFOLLOW", 0)  # Windows has none: there `refuse_link` is all
Json = dict[str, Any]  # an object of a JSON file, or of a part of it
PICTURE_FORMATS = ("png", "svg", "pdf")


def _tyre(study: str, overview: str) -> tuple[str, ...]:
    """Pictures of a tyre and its modes, which carry the study's name."""
    return (overview, f"{study}_section.png", f"{study}_mode_*.vtu")


RESULTS = {  # of a study, by pattern: what a new run of it takes the place of
    "fit": (
        "fit.json",
        "fit.csv",
        "fit_history.csv",
        "fit_variables.csv",
        "fit_states.csv",
        "fit_labels.csv",
        "fit_shapes.json",
        "fit_mac_*.png",
        "convergence.png",
        *_tyre("fit", "fit_modes.png"),
    ),
    "modes": ("modes.json", "modes.csv", "modes_shapes.json", *_tyre("modes", "modes.png")),
    "sweep-load": ("load_sweep.json", "load_sweep.csv", "load_sweep.png"),
    "sweep-pressure": (
        "pressure_sweep.json",
        "pressure_sweep.csv",
        "pressure_sweep_rise.csv",
        "pressure_sweep.png",
    ),
    "footprint": (
        "footprint.json",
        "footprint.csv",
        "footprint_patches.json",
        "footprint.png",
        "footprint_initial*.png",
        "footprint_fitted*.png",
        "footprint_*N.vtu",
    ),
    "effects": ("effects.json", "effects.csv", "effects_modes.csv", "effect_*.png"),
    "diagnose": (
        "diagnosis.json",
        "diagnosis.md",
        "diagnosis_*.json",
        "diagnosis.csv",
        "diagnosis_*.csv",
        "diagnosis_*.png",
    ),
    "batch": ("batch.json",),
}
CHANGED = threading.Event()  # set once this process writes a file with `atomic_write`
RUN = "run.json"  # what differs from run to run, an entry a study
PREVIOUS = "previous"  # folder for what a new run of the same study did not write again


def take_place(new: Path, folder: Path, study: str) -> None:
    """Move the files of ``new``, a run's results, to ``folder`` in the place of those of an
    earlier run of ``study``; see `set_aside`. Raises NotAFile, NotWritten."""
    with writing(folder):
        files = sorted(new.iterdir())
        set_aside(folder, study, {file.name for file in files})
        for file in files:
            file.replace(folder / file.name)


def set_aside(folder: Path, study: str, written: Collection[str]) -> None:
    """Move what an earlier run of ``study`` left and the new one has not ``written`` to
    `PREVIOUS`: it must not pass for the new one's. Raises OSError."""
    refuse_link(folder / PREVIOUS)
    for file in results(folder, study):
        if file.name not in written:
            private_dir(folder / PREVIOUS)
            file.replace(folder / PREVIOUS / file.name)
    for file in results(folder / PREVIOUS, study):
        if file.name in written:
            file.unlink(missing_ok=True)
    with contextlib.suppress(OSError):  # it was never made, or holds more
        (folder / PREVIOUS).rmdir()


def results(folder: Path, study: str) -> list[Path]:
    """Files in ``folder`` that are results of ``study``."""
    stem = study.replace("-", "_")  # of a study from outside
    patterns = RESULTS.get(study, (f"{stem}.*", f"{stem}_*"))
    pictures = [
        pattern.removesuffix("png") + kind
        for pattern in patterns
        if pattern.endswith(".png")
        for kind in PICTURE_FORMATS[1:]
    ]
    return [file for pattern in (*patterns, *pictures) for file in folder.glob(pattern)]


def read_runs(folder: Path) -> dict[str, dict[str, Any]]:
    """The entries of `RUN` by study; empty where it is damaged, or not there. Raises OSError."""
    try:
        content = read_json(folder / RUN, follow=False)
    except (FileNotFoundError, ValueError):
        return {}
    if not isinstance(content, dict):
        return {}
    if isinstance(content.get("command"), str):  # of one study, as older versions wrote it
        content = {content["command"]: content}
    return {name: facts for name, facts in content.items() if isinstance(facts, dict)}


def write_runs(folder: Path, new: Mapping[str, Any], many_writers: bool = False) -> None:
    """Put ``new`` entries in the place of those of the same studies. Raises OSError."""
    write_text(folder / RUN, json_text({**read_runs(folder), **new}), many_writers)


class NotAFile(TyrecalError, OSError):
    """A file or folder of ours that is something else: a link, a pipe, a device."""

    def __init__(self, path: Path, words: str):
        super().__init__(errno.EINVAL, words, str(path))

    def __str__(self) -> str:
        return f"'{self.filename}' {self.strerror}"


class NotWritten(TyrecalError, OSError):
    """A file or folder that cannot be written: arguments and attributes of an OSError."""

    def __str__(self) -> str:
        return f"cannot write to '{self.filename}': {self.strerror}"


@contextlib.contextmanager
def writing(path: Path | str) -> Iterator[None]:
    """Raises NotWritten, which names ``path``, where the system refuses what is done in it."""
    try:
        yield
    except TyrecalError:
        raise
    except OSError as error:
        raise NotWritten(error.errno, error.strerror or str(error), str(path)) from None


def make_folder(path: Path) -> None:
    """Make a folder, and those above it, unless it is there. Raises NotWritten."""
    with writing(path):
        path.mkdir(parents=True, exist_ok=True)


def os_words(error: OSError) -> str:
    """An error of the system in words: the file and the reason."""
    if isinstance(error, TyrecalError) or not error.strerror:
        return str(error)
    return f"'{error.filename}': {error.strerror}" if error.filename else error.strerror


def refuse_link(path: Path) -> None:
    """Raises NotAFile where ``path`` is a link (on Windows also a junction)."""
    junction = getattr(os.path, "isjunction", lambda path: False)  # from Python 3.12 on
    if path.is_symlink() or junction(path):
        raise NotAFile(path, "is a link, which is not followed: remove it")


def private_dir(path: Path) -> Path:
    """``path``, made if need be, as one of our own folders. Raises NotAFile, NotWritten."""
    refuse_link(path)
    make_folder(path)
    return path


def open_file(path: Path, follow: bool = True) -> BinaryIO:
    """A regular file, open to be read; a pipe or device is not waited for.

    ``follow``: links too, as for files that the user names. Raises NotAFile; OSError.
    """
    if not follow:
        refuse_link(path)
    flags = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
    descriptor = os.open(path, flags | (0 if follow else NOFOLLOW))
    if not stat.S_ISREG(os.fstat(descriptor).st_mode):
        os.close(descriptor)
        raise NotAFile(path, "is not a regular file")
    return os.fdopen(descriptor, "rb")


def read_bytes(path: Path, most: int = MAX_FILE_BYTES, follow: bool = True) -> bytes:
    """The content of a file of at most ``most`` bytes. Raises as `open_file` does."""
    with open_file(path, follow) as file:
        content = file.read(most + 1)
    if len(content) > most:
        raise NotAFile(path, f"is larger than {most / 1e6:g} MB")
    return content


def read_text(path: Path, follow: bool = True) -> str:
    """`read_bytes` as text. Raises UnicodeDecodeError too, where it is not UTF-8."""
    return read_bytes(path, follow=follow).decode("utf-8")


def read_json(path: Path, follow: bool = True) -> Any:
    """`read_text` as JSON. Raises ValueError too, where it is none, or nested too deep."""
    try:
        return json.loads(read_text(path, follow))
    except RecursionError:
        raise ValueError("it is nested too deep") from None


@contextlib.contextmanager
def atomic_write(path: Path, many_writers: bool = False) -> Iterator[Path]:
    """Yield a temporary path next to ``path`` that replaces it on success, or is removed.

    Nobody can have laid a link there: its name is drawn, and the file is new. Leftovers of writers
    that were killed go, unless there are ``many_writers``. Raises NotWritten where the disc is full
    or the folder cannot be written.
    """
    partial = path.with_name(f".{path.name}.{secrets.token_hex(8)}.partial")
    try:
        if not many_writers:
            for leftover in path.parent.glob(f".{glob.escape(path.name)}.{'?' * 16}.partial"):
                with contextlib.suppress(OSError):
                    leftover.unlink()
        os.close(os.open(partial, os.O_WRONLY | os.O_CREAT | os.O_EXCL | NOFOLLOW, 0o666))
        yield partial
        CHANGED.set()
        partial.replace(path)
    except BaseException as error:
        with contextlib.suppress(OSError):
            partial.unlink(missing_ok=True)
        if isinstance(error, OSError):
            raise NotWritten(error.errno, error.strerror or str(error), str(path)) from None
        raise


def write_text(path: Path, text: str, many_writers: bool = False) -> None:
    """Write ``text`` whole or not at all, the same bytes on every system; see `atomic_write`.

    Raises OSError.
    """
    with atomic_write(path, many_writers) as partial:
        partial.write_text(text, encoding="utf-8", newline="")


def printable(text: str) -> str:
    """``text`` on one line, without control characters."""
    return "".join(c if c.isprintable() else " " for c in text)


def json_text(content: Any) -> str:
    """A result as JSON. Raises ValueError where a number of it is not finite."""
    return json.dumps(content, indent=1, allow_nan=False) + "\n"
