"""Loss factors of compounds, on which damping ratios depend and no frequency does.

    zeta_r = 1/2 sum_m eta_m w_rm,   d ln zeta_r / d ln eta_m = eta_m w_rm / (2 zeta_r)

zeta_r: damping ratio of mode r, eta_m: loss factor of compound m, w_rm: its share of the mode's
energy. The derivative is its share of the mode's loss. Shares sum to 1, so that compounds which are
all off alike move all modes alike: then only the ratios between modes carry information.
"""

from __future__ import annotations

from math import exp

import numpy as np

from ...tyre.case import LoadedCase, number_at
from ...tyre.case.schema import Rubber
from ...tyre.effects.edit import changed, with_part, with_rubbers
from .section_fields import COMPOUNDS_ALIKE  # correlation, here of the ln of their loss factors

Array = np.ndarray
# loss factor of a compound that states none, and standard deviation of its ln, by judgement: 0.08
# to 0.3 are usual for rubbers of tyres at 20 to 60 C and small strain
ASSUMED_LOSS, ASSUMED_LOSS_SD = 0.15, 0.7
# standard deviation of the ln of a stated one, by judgement: another batch, strain or temperature
STATED_LOSS_SD = 0.15


def with_losses(case: LoadedCase) -> LoadedCase:
    """The case with a loss factor in each compound."""
    return with_rubbers(case, lambda m: with_part(m, loss_factor=m.loss_factor or ASSUMED_LOSS))


def with_twice_the_loss(case: LoadedCase, name: str) -> LoadedCase:
    """The case with twice the loss factor of a compound."""
    rubber = case.case.materials[name]
    assert isinstance(rubber, Rubber)
    loss = rubber.loss_factor or 0.0
    twice = [[hertz, 2 * eta] for hertz, eta in loss] if isinstance(loss, list) else 2 * loss
    other = {name: with_part(rubber, loss_factor=twice)}
    return changed(case, materials={**case.case.materials, **other})


def losses_in_words(case: LoadedCase) -> str:
    """Loss factors of a case as a diagnosis takes them."""
    compounds = {k: m for k, m in case.case.materials.items() if isinstance(m, Rubber)}
    assumed = ", ".join(name for name, m in compounds.items() if not m.loss_factor)
    if not assumed:
        known = "the case states them" if compounds else "the deck has them"
        return f"loss factors as {known}"
    factor = f"within a factor of {exp(ASSUMED_LOSS_SD):.1g} (one standard deviation)"
    return f"loss factor {ASSUMED_LOSS:g} assumed of {assumed}, {factor}"


def loss_deviations(case: LoadedCase) -> dict[str, Array]:
    """Deviations (k,) of ln eta by compound, each of k independent parts at one standard deviation.

    By ``uncertainties`` of the case that set loss factors; of other compounds as above. Without
    compounds, in a deck of a user, one part that all modes share, by the key "".
    """
    compounds = {k: m for k, m in case.case.materials.items() if isinstance(m, Rubber)}
    names = list(compounds) or [""]
    parts: list[Array] = []
    for each in (case.case.uncertainties or {}).values():
        part = np.zeros(len(names))
        for path, sign in zip(each.sets, each.signs or [1] * len(each.sets), strict=True):
            name = path.removeprefix("materials.").removesuffix(".loss_factor")
            if path.endswith(".loss_factor") and name in compounds:
                size = each.absolute / number_at(case, path) if each.absolute else 0.0
                part[names.index(name)] = sign * (size or (each.percent or 0.0) / 100)
        parts += [part] * bool(part.any())
    free = ~np.any(parts, axis=0) if parts else np.ones(len(names), bool)
    stated = [not compounds or bool(compounds[name].loss_factor) for name in names]
    size = np.where(stated, STATED_LOSS_SD, ASSUMED_LOSS_SD) * free
    parts.append(np.sqrt(COMPOUNDS_ALIKE) * size)
    parts += list(np.sqrt(1 - COMPOUNDS_ALIKE) * np.diag(size))
    return dict(zip(names, np.array(parts).T, strict=True))
