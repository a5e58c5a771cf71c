"""Names of effects, the tool's own and those of installed packages, for which nothing is imported;
and the one way in which anything of an installed package is loaded.

The tool's own are found by the first two fields of an `Effect` in the files of `effects`. Installed
packages add theirs under the entry point group EFFECT_GROUP: the id, and where its `Effect` is.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from typing import Any

from ..errors import InputError

EFFECT_GROUP = "tyrecal.effects"
# id and place of an `Effect` in its file
_ENTRY = re.compile(r'^ +id="(\w+)",\n +place=(\d+),$', re.MULTILINE)


def load_plugin(entry: EntryPoint, kind: str, use: Callable[[Any], Any] = lambda x: x) -> Any:
    """Load an installed package's object and pass it to ``use``. kind: its kind, as "solver".

    Raises InputError, which names the package, whatever the package's code raises.
    """
    try:
        return use(entry.load())
    except InputError:
        raise
    except Exception as error:
        package = f"package '{entry.dist.name}'" if entry.dist else f"'{entry.value}'"
        raise InputError(
            f"{kind} '{entry.name}' of {package} cannot be loaded ({type(error).__name__}:"
            f" {error}): install a newer version of the package, or uninstall it"
        ) from None


def _own() -> dict[str, str]:
    """Id to module of each effect of the folder, by rising place."""
    modules = [
        (int(place), id, path.stem)
        for path in (Path(__file__).parent / "effects").glob("*.py")
        for id, place in _ENTRY.findall(path.read_text(encoding="utf-8"))
    ]
    return {id: module for _, id, module in sorted(modules)}


OWN = _own()
ADDED = {entry.name: entry for entry in entry_points(group=EFFECT_GROUP) if entry.name not in OWN}
IDS = (*OWN, *sorted(ADDED))
