"""The rules of a set of trials, written openly: what is drawn, given and held out; and their seal.

The truth of blind trials is in a separate folder, its sha256 with the trials. truth.json has a
random number, so that the truth cannot be guessed from its hash. ``answer`` never opens its folder,
and refuses to work if a truth is among the trials. Answers are hashed before ``score`` opens the
truth and checks its hash.
"""

from __future__ import annotations

import secrets
from dataclasses import asdict, dataclass, replace
from hashlib import sha256
from pathlib import Path

from ...errors import InputError
from ...files import Json, json_text, read_bytes, write_text
from ...files import read_json as read_file

PROTOCOL_FILE = "protocol.json"


@dataclass(frozen=True)
class Protocol:
    """Numbers of a study; the standard deviations of constants are the case's `uncertainties`."""

    maker: str  # who made the data, in words
    case: str  # the case file beside it
    counts: dict[str, int]  # trials by kind
    spread: float = 0.4  # design variables: start exp(U(-ln(1 + spread), ln(1 + spread)))
    given_kPa: tuple[float, ...] = (160.0, 240.0, 320.0)  # pressures of the trials' measurements
    held_out_kPa: float = 200.0  # pressure at which predictions are scored
    noise: float = 0.002  # standard deviation of every frequency, relative
    mass: float = 0.005  # standard deviation of the weighed mass, relative
    # standard deviation of a doublet's split, relative, that each tyre has at all pressures
    split: float = 0.003
    missing: int = 2  # values a pressure, at most
    swapped: float = 0.05  # share of trials in which two labels are exchanged
    smallest: float = 0.2  # least size, as a share of an effect's range

    def about(self, pressure_kPa: float) -> Protocol:
        """Rules of the protocol at two thirds, all and four thirds of a tyre's pressure, held out
        between the first two."""
        low, own, high, between = (round(k * pressure_kPa / 6) for k in (4, 6, 8, 5))
        return replace(self, given_kPa=(low, own, high), held_out_kPa=between)

    @property
    def pressures_kPa(self) -> tuple[float, ...]:
        """All that the maker computes, the held-out one last."""
        return (*self.given_kPa, self.held_out_kPa)


def write_json(path: Path, content: object) -> None:
    """A file of JSON, whole or not at all."""
    write_text(path, json_text(content))


def read_json(path: Path) -> dict:
    """A file of JSON; a link is not followed (`files`). Raises InputError."""
    try:
        content = read_file(path, follow=False)
    except FileNotFoundError:
        raise InputError(f"{path} is missing") from None
    except ValueError:
        raise InputError(f"{path} is not JSON") from None
    if not isinstance(content, dict):
        raise InputError(f"{path} must hold an object")
    return content


def write_protocol(folder: Path, protocol: Protocol) -> None:
    """Write the rules of ``folder``."""
    write_json(folder / PROTOCOL_FILE, {"format": 1, **asdict(protocol)})


def read_protocol(folder: Path) -> Protocol:
    """The rules of ``folder``. Raises InputError."""
    content = read_json(folder / PROTOCOL_FILE)
    try:
        content.pop("format")
        content["given_kPa"] = tuple(content["given_kPa"])
        return Protocol(**content)
    except (KeyError, TypeError) as error:
        raise InputError(f"{folder / PROTOCOL_FILE}: not the rules of trials ({error})") from None


SEAL, TRUTH, ANSWERS = "seal.json", "truth.json", "answers.json"


def seal(folder: Path, sealed: Path, content: Json) -> str:
    """Write the truth to ``sealed`` and its sha256 to ``folder``; returns the sha256."""
    write_json(sealed / TRUTH, {"nonce": secrets.token_hex(32), **content})
    digest = _sha256(sealed / TRUTH)
    write_json(folder / SEAL, {"sha256": digest})
    return digest


def open_truth(folder: Path, sealed: Path) -> Json:
    """Content of truth.json. Raises InputError if it is not the sealed one, or an answer is missing
    or was changed since `seal_answers`."""
    stated = read_json(folder / ANSWERS)
    answered = {path.stem for path in (folder / "answers").glob("*.json")}
    if answered != {path.stem for path in (folder / "trials").glob("*.csv")}:
        raise InputError(f"{folder}: not every trial has one answer; 'tyrecal blind answer' first")
    if stated != _hashed_answers(folder):
        raise InputError(f"{folder}: answers were changed after they were hashed")
    content = read_json(sealed / TRUTH)
    if _sha256(sealed / TRUTH) != read_json(folder / SEAL).get("sha256"):
        raise InputError(f"{sealed / TRUTH} is not the truth that {folder / SEAL} seals")
    return content


def refuse_open_truth(folder: Path) -> None:
    """Raises InputError if a truth is in ``folder``, where answers are computed, or no seal is."""
    paths = sorted(folder.rglob(TRUTH))
    if paths:
        raise InputError(f"{paths[0]} is open among the trials; move it to another folder")
    read_json(folder / SEAL)


def seal_answers(folder: Path) -> str:
    """Write the sha256 of all answers together to ``folder``; returns it."""
    hashed = _hashed_answers(folder)
    write_json(folder / ANSWERS, hashed)
    return str(hashed["sha256"])


def _hashed_answers(folder: Path) -> Json:
    """sha256 of one line for each answer, its file's name and sha256; and how many these are."""
    files = sorted((folder / "answers").glob("*.json"))
    lines = "".join(f"{path.name} {_sha256(path)}\n" for path in files)
    return {"sha256": sha256(lines.encode()).hexdigest(), "count": len(files)}


def _sha256(path: Path) -> str:
    return sha256(read_bytes(path, follow=False)).hexdigest()
