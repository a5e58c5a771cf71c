"""The rules of a set of trials: what is drawn, what is given, what is held out. Written openly."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from pathlib import Path

from ...errors import InputError
from ...files import json_text, write_text
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
