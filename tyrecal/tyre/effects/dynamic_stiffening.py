"""Rubber is stiffer in a small, fast vibration than in the slow, large inflation."""

from __future__ import annotations

from math import pi

from ...errors import InputError
from ..case import LoadedCase
from ..case.parts import Prony, Rubber
from ..case.schema import Analysis
from .deck_numbers import with_prony
from .edit import changed, with_part, with_rubbers
from .effect import Effect

# A term relaxed in a static step, and in no vibration: 1/(2 pi f tau)^2 = 2.5e-12
FREQUENCY_HZ, TAU_S = 100.0, 1000.0


def add(case: LoadedCase, value: float) -> LoadedCase:
    """Shear modulus of the vibration times 1 + value; that of the inflated state is unchanged."""
    analysis = case.case.analysis
    long_term = analysis.static_moduli == "long_term"

    def stiffened(m: Rubber) -> Rubber:
        """The same static state, its vibration as one Prony term: G'/G_static = 1/(1 - g)."""
        static, ratio = zip(*(_moduli(m, k, long_term, analysis) for k in "gk"), strict=True)
        shear, bulk = ratio[0] * (1 + value), ratio[1]
        if not (shear >= 1 and bulk >= 1):
            raise InputError("must leave the vibration at least as stiff as the inflated state")
        return with_part(
            m,
            C10_Pa=m.C10_Pa * static[0],
            C01_Pa=m.C01_Pa * static[0],
            D1_per_Pa=m.D1_per_Pa / static[1],
            moduli="long_term",
            prony=[Prony(g=1 - 1 / shear, k=1 - 1 / bulk, tau_s=TAU_S)],
        )

    return _fast(with_rubbers(case, stiffened))


def _fast(case: LoadedCase) -> LoadedCase:
    """The case with its vibration at the frequency that the terms are for."""
    relaxed = dict(static_moduli="long_term", vibration_frequency_Hz=FREQUENCY_HZ)
    return changed(case, analysis=with_part(case.case.analysis, **relaxed))


def add_to_deck(case: LoadedCase, value: float) -> LoadedCase:
    """In a deck: all compounds, by their Prony series."""
    analysis = case.case.analysis
    if analysis.static_moduli != "long_term" or analysis.vibration_frequency_Hz is not None:
        raise InputError("needs static_moduli: long_term and vibration_frequency_Hz: null")
    if value < 0:
        raise InputError("must leave the vibration at least as stiff as the inflated state")
    return _fast(with_prony(case, 1 + value, TAU_S))


def _moduli(m: Rubber, share: str, long_term: bool, analysis: Analysis) -> tuple[float, float]:
    """The static modulus over the given constants', and the vibration's over the static one.

    share: g (shear) or k (bulk); long_term: whether the static state is relaxed. Of the
    instantaneous modulus G0: G'(w)/G0 = 1 - sum g + sum g w^2 tau^2 / (1 + w^2 tau^2).
    """
    terms = [(getattr(term, share), term.tau_s) for term in m.prony]
    relaxed = 1 - sum(g for g, _ in terms)
    given = relaxed if m.moduli == "long_term" else 1.0
    static = relaxed if long_term else 1.0
    if analysis.vibration_frequency_Hz is None:
        return static / given, 1.0
    squares = [((2 * pi * analysis.vibration_frequency_Hz * tau) ** 2, g) for g, tau in terms]
    return static / given, (relaxed + sum(g * x / (1 + x) for x, g in squares)) / static


EFFECT = Effect(
    id="dynamic_stiffening",
    place=10,
    title="Dynamic stiffening of rubber",
    symbol="e",
    unit="",
    # 0.43 is the shipped case's own Prony series (g = 0.3); filled rubber is 1.5 to 3 times as
    # stiff at 0.1 % strain as at 10 % (Payne effect)
    low=0.0,
    high=1.0,
    changes=("*VISCOELASTIC", "*FREQUENCY"),
    signature=(
        "all up, [0,0] torsional most: +12 % at e = 1, [2,1] and [3,1] +7 %, [0,0] lateral "
        "least, +3 %; a little less at higher pressure; C10 absorbs all but 0.4 %"
    ),
    toggle="excite ten times harder: the modulus of filled rubber falls with strain amplitude",
    aliases=("temperature", "bead_filler"),
    add=add,
    add_to_deck=add_to_deck,
    needs="vibration_modulus",
    # error of its shifts, relative, by judgement: each compound stiffens by up to a third more or
    # less than the mean, and a mode strains several of them
    response_error=0.08,
)
