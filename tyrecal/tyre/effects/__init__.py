"""What a plain model leaves out: one file an effect, each with one parameter; 0 = absent."""

from __future__ import annotations

from functools import cache
from importlib import import_module

from ..plugins import ADDED, IDS, OWN
from .effect import Effect, EffectRefused

__all__ = ["IDS", "Effect", "EffectRefused", "catalogue"]


@cache
def catalogue() -> dict[str, Effect]:
    """Every effect by its id. (Modules are imported here: the case's schema needs the ids only.)"""
    modules = [import_module(f".{name}", __package__) for name in dict.fromkeys(OWN.values())]
    own = [x for m in modules for x in (m.EFFECTS if hasattr(m, "EFFECTS") else [m.EFFECT])]
    found = {effect.id: effect for effect in own}
    return {id: found[id] if id in OWN else ADDED[id].load() for id in IDS}
