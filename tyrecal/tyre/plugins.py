"""Names of effects, the tool's own and those of installed packages; nothing is imported for them.

The tool's own are found by the first two fields of an `Effect` in the files of `effects`. Installed
packages add theirs under the entry point group EFFECT_GROUP: the id, and where its `Effect` is.
"""

from __future__ import annotations

import re
from importlib.metadata import entry_points
from pathlib import Path

EFFECT_GROUP = "tyrecal.effects"
_ENTRY = re.compile(r'^ +id="(\w+)",\n +place=(\d+),$', re.MULTILINE)


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
