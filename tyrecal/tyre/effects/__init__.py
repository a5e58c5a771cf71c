"""Effects that a plain model leaves out: one file an effect, each with one parameter; 0 =
absent."""

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
    """Every effect by its id; an installed package's that cannot be loaded is named and left out.

    (Modules are imported here: the case's schema needs the ids only.)
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
    if not isinstance(effect, Effect):
        raise TypeError(f"it is a {type(effect).__name__}, no Effect")
    return effect
