"""Origin of results: tool, solver, tyre, state, mesh and measurements, the same in every file; and
the hash of the tool's own sources, so that results of two editions are never mixed."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import lru_cache
from hashlib import sha256
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..files import Json
from ..tyre.case import LoadedCase
from ..tyre.case.identity import tyre_sha256
from ..tyre.resolve import resolved
from ..version import __version__

if TYPE_CHECKING:
    from .evaluate.solver import Solver

KEY = "provenance"
OneOrMore = float | Sequence[float]


def provenance(
    case: LoadedCase,
    solver: Solver,
    measured: Iterable[Path] = (),
    pressure_kPa: OneOrMore | None = None,
    load_N: OneOrMore = 0.0,
    rim: Sequence[str] = (),
) -> Json:
    """The block ``provenance`` of a result file.

    pressure_kPa, rim (words of `TyreState`; default: the case's), load_N: of the study, several
    where it has several; measured files in the order of the command. Raises OSError.
    """
    c = case.case
    files = list(measured)
    return {
        "tyrecal": __version__,
        "solver": solver.name,
        "solver_version": solver.version,
        "name": c.name,
        "size": c.size,
        "tyre_sha256": tyre_sha256(case),
        "overrides": dict(case.overrides),
        "state": {
            "pressure_kPa": _plain(c.pressure_kPa if pressure_kPa is None else pressure_kPa),
            "load_N": _plain(load_N),
            "rim": list(rim) or _rim(case),
        },
        "mesh": c.mesh.level,
        "targets": c.targets.source or None,
        "measured_sha256": measured_sha256(files) if files else None,
        **({"measured_files": [file.name for file in files]} if files else {}),
    }


def stamped(content: Any, block: Json) -> Any:
    """A result with its provenance after its key ``format``; each entry of a list has it."""
    if isinstance(content, list):
        return [stamped(each, block) for each in content]
    head = {"format": content["format"]} if "format" in content else {}
    return {**head, KEY: block, **content}


def measured_sha256(files: Sequence[Path]) -> str:
    """Hash of a file's bytes; of several that of their hashes, one a line, in this order.

    Raises OSError.
    """
    hashes = [sha256(path.read_bytes()).hexdigest() for path in files]
    if len(hashes) == 1:
        return hashes[0]
    return sha256("".join(f"{each}\n" for each in hashes).encode()).hexdigest()


def _rim(case: LoadedCase) -> str:
    """How the rim is held while the tyre vibrates."""
    rim = resolved(case).case.rim
    return "free" if rim.free else "spindle" if rim.spindle.gives_way else "fixed"


def _plain(number: OneOrMore) -> float | list[float]:
    return float(number) if isinstance(number, int | float) else [float(each) for each in number]


PACKAGES = {"tyrecal": "*.py", "tyrecal_solvers": "*.py", "tyrecal_templates": "*.j2"}


@lru_cache(maxsize=1)
def sources() -> str:
    """Hash of all Python files and templates of the tool and its solvers, 64 hexadecimal digits."""
    digest = sha256()
    for package, pattern in PACKAGES.items():
        root = Path(str(files(package)))
        for path in sorted(root.rglob(pattern)):
            digest.update(f"{package}/{path.relative_to(root).as_posix()}\0".encode())
            digest.update(sha256(path.read_bytes()).digest())
    return digest.hexdigest()
