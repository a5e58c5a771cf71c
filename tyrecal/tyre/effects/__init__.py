"""Effects that a plain model leaves out: one file an effect, each with one parameter; 0 =
absent."""

from __future__ import annotations

import logging
from functools import cache
from importlib import import_module

from ...errors import InputError
from ..plugins import ADDED, IDS, OWN
from .effect import Effect, EffectRefused

__all__ = ["IDS", "Effect", "EffectRefused", "catalogue"]

log = logging.getLogger("tyrecal")


class Catalogue(dict[str, Effect]):
    """Effects by id; one that cannot be loaded raises InputError where a case uses it."""

    def __missing__(self, id: str) -> Effect:
        if id in ADDED:
            raise InputError(_unusable(id))
        raise KeyError(id)


@cache
def catalogue() -> Catalogue:
    """Every effect by its id; an installed package's that cannot be loaded is named and left out.

    (Modules are imported here: the case's schema needs the ids only.)
    """
    modules = [import_module(f".{name}", __package__) for name in dict.fromkeys(OWN.values())]
    own = [x for m in modules for x in (m.EFFECTS if hasattr(m, "EFFECTS") else [m.EFFECT])]
    effects = Catalogue((effect.id, effect) for effect in own)
    for id in sorted(ADDED):
        try:
            effects[id] = ADDED[id].load()
        except Exception as error:  # a stranger's code may raise anything
            log.warning("%s (%s: %s)", _unusable(id), type(error).__name__, error)
    return Catalogue((id, effects[id]) for id in IDS if id in effects)


def _unusable(id: str) -> str:
    package = ADDED[id].dist
    name = f"package '{package.name}'" if package else f"'{ADDED[id].value}'"
    return f"effect '{id}' of {name} cannot be loaded and is left out: install a newer one"
