"""Rubber grows stiffer with frequency: low modes are softer and high modes stiffer than with one
modulus."""

from __future__ import annotations

from math import pi, tan

from ..case import LoadedCase
from ..case.parts import Rubber
from .edit import with_part, with_rubbers
from .effect import Effect


def add(case: LoadedCase, value: float) -> LoadedCase:
    """Each mode's shear modulus times (f / f_ref)^value, at the mode's frequency f.

    f_ref is each rubber's ``reference_frequency_Hz`` (60 Hz): a tilt over the modes, no level.
    By causality (Kramers-Kronig) a modulus ~ f^a has a loss factor of at least tan(pi a / 2): a
    smaller stated one is raised to that.
    """

    def stiffening(m: Rubber) -> Rubber:
        a, loss = m.frequency_exponent + value, m.loss_factor
        least = tan(pi * a / 2)
        if isinstance(loss, list):
            loss = [[hertz, max(eta, least)] for hertz, eta in loss]
        elif loss is not None:
            loss = max(loss, least)
        return with_part(m, frequency_exponent=a, loss_factor=loss)

    return with_rubbers(case, stiffening)


EFFECT = Effect(
    id="frequency_stiffening",
    place=20,
    title="Stiffening of rubber with frequency",
    symbol="beta",
    unit="",
    low=0.0,
    high=0.2,
    changes=("*VISCOELASTIC, FREQUENCY=TABULAR",),
    signature=(
        "a tilt, no level: [0,0] torsional -1.5 %, [0,0] lateral and [1,1] -0.4 %, [1,0] 0, "
        "[2,1] +0.2 %, [4,0] +0.7 %, [3,1] +1.0 % at beta = 0.2; a re-fit hides a tenth of it"
    ),
    toggle="a dynamic test of the compound from 20 to 150 Hz at small strain",
    aliases=("belt_width", "cap_ply", "bead_filler", "spindle_torsional"),
    add=add,
    needs="frequency_modulus",
    # error of its shifts, relative, by judgement: each compound stiffens by up to a third more or
    # less than the mean, and a mode strains several of them
    response_error=0.08,
)
