"""The catalogue: effects that a plain model leaves out, each one number; 0 is absent.

One file an effect. `plugins` lists their ids without importing them: OWN of this folder, ADDED of
installed packages, IDS of both.
"""

from __future__ import annotations

import logging
from functools import cache
from importlib import import_module

from ...errors import InputError
from ..plugins import ADDED, IDS, OWN, load_plugin
from .effect import Effect, EffectRefused

__all__ = ["IDS", "Effect", "EffectRefused", "catalogue"]

log = logging.getLogger("tyrecal")


class Catalogue(dict[str, Effect]):
    """Effects by id; one that cannot be loaded raises InputError where a case uses it."""

    def __missing__(self, id: str) -> Effect:
        if id in ADDED:
            return _load(id)
        raise KeyError(id)


@cache
def catalogue() -> Catalogue:
    """Every effect by its id, in the order of the catalogue.

    An effect of an installed package that cannot be loaded is left out, with a warning. Modules are
    imported here, because the case's schema needs the ids only.
    """
    modules = [import_module(f".{name}", __package__) for name in dict.fromkeys(OWN.values())]
    own = [x for m in modules for x in (m.EFFECTS if hasattr(m, "EFFECTS") else [m.EFFECT])]
    effects = Catalogue((effect.id, effect) for effect in own)
    for id in sorted(ADDED):
        try:
            effects[id] = _load(id)
        except InputError as error:
            log.warning("%s", error)
    return Catalogue((id, effects[id]) for id in IDS if id in effects)


def _load(id: str) -> Effect:
    """The effect of an installed package. Raises InputError."""
    effect: Effect = load_plugin(ADDED[id], "effect", _checked)
    return effect


def _checked(effect: Effect) -> Effect:
    """The effect itself. Raises TypeError if a package offers something else."""
    if not isinstance(effect, Effect):
        raise TypeError(f"it is a {type(effect).__name__}, no Effect")
    return effect
