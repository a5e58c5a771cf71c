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
    spindle = {effect.id: effect for effect in import_module(".spindle", __package__).EFFECTS}
    own = {id: spindle.get(id) or import_module(f".{id}", __package__).EFFECT for id in OWN}
    return {**own, **{id: ADDED[id].load() for id in sorted(ADDED)}}
