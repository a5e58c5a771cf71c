"""Real frequencies predicted by a tyre that was fitted to others: what an effect leaves of the gap.

    python -m tests.studies.real_data [EFFECT=VALUE ...|tread_modulus=MPa ...]

The 205/60R15 is fitted to the four MF-Swift modes (220 kPa, rim fixed), A_belt held, with one
effect in it, or with a tread of its own rubber, whose shear modulus in the vibration is stated;
then the modes [3,0] to [8,0] are evaluated at 160 kPa with the rim free, and compared
with Vervoort's six frequencies as if they were these. Told: what the fit has left, its rubber, how
far each predicted one is off, their rms, and the rms beside a common factor: what no modulus mends.
"""

from __future__ import annotations

import sys

import numpy as np

from tests.conftest import CASES
from tyrecal.measured.tables import read_measurements
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.simulate.modes.find import LabelledModes, find_modes
from tyrecal.simulate.modes.label import Label
from tyrecal.tyre.case import LoadedCase
from tyrecal.tyre.case.schema import Rubber, Solid
from tyrecal.tyre.effects.edit import changed
from tyrecal.tyre.load import load_case
from tyrecal.tyre.state import TyreState
from tyrecal.tyre.values import set_values

from ..solved import calibrate

CASE = load_case(CASES / "205_60r15.yaml")
MEASURED = read_measurements(CASES / "205_60r15_vervoort.csv", labelled=False)
LABELS = [Label(c, 0) for c in range(3, 9)]
STATE = TyreState(160.0, 0.0, "free")
TRIED = (
    ("tread_modulus", 5.0),
    ("tread_modulus", 10.0),
    ("tread_modulus", 20.0),
    ("dynamic_stiffening", 0.5),
    ("dynamic_stiffening", 1.0),
    ("frequency_stiffening", 0.1),
    ("frequency_stiffening", 0.2),
    ("cap_ply", 1e6),
    ("cap_ply", 2e6),
    ("tread_density", -0.25),
    ("tread_wear", 0.25),
    ("belt_angle", 3.0),
    ("belt_width", 0.01),
    ("sidewall_gauge", 0.15),
    ("bead_filler", 1.0),
    ("cavity_air", 1.0),
)


def with_tread(modulus_MPa: float) -> LoadedCase:
    """The case with another rubber outside the outer belt's line, of this shear modulus in the
    vibration, 2 C10 / (1 - g), and the other's ratio of bulk to shear modulus."""
    rubber = CASE.case.materials["rubber"]
    assert isinstance(rubber, Rubber) and rubber.D1_per_Pa
    C10 = 1e6 * modulus_MPa * (1 - rubber.prony[0].g) / 2
    D1 = rubber.D1_per_Pa * rubber.C10_Pa / C10
    tread = rubber.model_copy(update={"C10_Pa": C10, "D1_per_Pa": D1})
    solids = [*CASE.case.solids, Solid(material="tread", between=["belt2", "outer"])]
    return changed(CASE, materials={**CASE.case.materials, "tread": tread}, solids=solids)


def predicted(case: LoadedCase) -> None:
    """A line of the table."""
    held = {"A_belt": CASE.case.variables["A_belt"].start}
    fit = calibrate(case, Evaluator(TyreDesign(case)), fixed=held)
    analysis = case.case.analysis.model_copy(update={"highest_harmonic": LABELS[-1].c})
    wide = changed(case, analysis=analysis)
    question = Question(STATE.design(wide, fit.fitted.values))
    ((_, labelled),) = find_modes(Evaluator(TyreDesign(wide)), [question], LABELS)
    assert isinstance(labelled, LabelledModes), labelled
    hertz = np.array([labelled.wanted[label].frequency_Hz for label in LABELS])
    off = np.log(hertz / [each.value for each in MEASURED])
    cells = " | ".join(f"{100 * np.expm1(x):+.1f}" for x in off)
    rms, beside = 100 * np.sqrt(np.mean(off**2)), 100 * np.std(off)
    C10 = fit.fitted.values["C10"] / 1e6
    print(
        f" {fit.found.objective_Hz:.2f} | {C10:.2f} | {fit.found.mass_kg:.2f} | {cells} |"
        f" {rms:.1f} | {beside:.1f} |",
        flush=True,
    )


if __name__ == "__main__":
    pairs = [each.split("=") for each in sys.argv[1:]]
    chosen = [(name, float(value)) for name, value in pairs] or TRIED
    print(
        "| effect | F, sigma | C10, MPa | kg | [3,0] % | [4,0] | [5,0] | [6,0] | [7,0] | [8,0] |",
        end="",
    )
    print(" rms % | beside a factor |")
    print("| nothing |", end="")
    predicted(CASE)
    for name, value in chosen:
        print(f"| {name} {value:g} |", end="")
        own_tread = name == "tread_modulus"
        with_it = with_tread(value) if own_tread else set_values(CASE, {f"effects.{name}": value})
        predicted(with_it)
