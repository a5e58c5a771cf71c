"""Check of a solver on a small known tyre: ``check.yaml`` against the results recorded here.

The rim is fixed and the pressure that of the file.
"""

from __future__ import annotations

import time
from pathlib import Path

from ...files import Json

CASE = Path(__file__).with_name("check.yaml")
# Results of the bundled solver on the coarse mesh of check.yaml. CalculiX 2.20, an independent
# program with other elements, differs by at most 1.2 % on the same section. The fine mesh of the
# shipped P235/75R17, a finer drawing of this section, differs by at most 1.1 %.
RECORDED_HZ = {
    "[0,0] axial": 37.0277,
    "[0,0] torsional": 38.1141,
    "[1,1]": 43.3964,
    "[1,0]": 66.7627,
    "[2,1]": 73.6586,
    "[2,0]": 88.5548,
}
RECORDED_KG = 12.7887  # mass of the whole tyre
TOLERANCE_PERCENT = {"bundled": 0.1}  # far above the differences by rounding between machines
OTHERS_PERCENT = 2.5  # tolerance for solvers with other elements and other laws of the cords


def self_check(solver: str = "bundled") -> Json:
    """Mass and modes of the known tyre by a solver, compared with the recorded ones.

    Keys: ``solver``, ``ok``, ``seconds``, ``tolerance_percent``, ``mass_kg``, ``modes`` [{label,
    frequency_Hz, recorded_Hz, deviation_percent}] and ``problem``, the reason if the solver gave no
    results, else None. Raises InputError if no solver has this name.
    """
    from ...tyre.load import load_case
    from ..deck.tyre_design import TyreDesign
    from ..evaluate.evaluator import Evaluator, Question
    from ..evaluate.failure import DeckRefused, EvaluationFailed, SolverUnavailable
    from ..modes.label import labelled

    started = time.monotonic()
    tolerance = TOLERANCE_PERCENT.get(solver, OTHERS_PERCENT)
    result: Json = {
        "solver": solver,
        "ok": False,
        "tolerance_percent": tolerance,
        "mass_kg": None,
        "modes": [],
        "problem": None,
    }
    try:
        start = Question({})  # every variable at its start value
        answer = Evaluator(TyreDesign(load_case(CASE)), solver).evaluate(start)
        hertz = {str(m.label): m.frequency_Hz for m in labelled(answer)}
        result["mass_kg"] = answer.mass_kg
        result["modes"] = [
            {
                "label": label,
                "frequency_Hz": hertz.get(label),
                "recorded_Hz": recorded,
                "deviation_percent": _percent(hertz.get(label), recorded),
            }
            for label, recorded in RECORDED_HZ.items()
        ]
        deviations = [mode["deviation_percent"] for mode in result["modes"]]
        deviations.append(_percent(answer.mass_kg, RECORDED_KG))
        result["ok"] = all(each is not None and abs(each) <= tolerance for each in deviations)
    except (DeckRefused, EvaluationFailed, SolverUnavailable, OSError) as error:
        result["problem"] = str(error)
    result["seconds"] = round(time.monotonic() - started, 2)
    return result


def _percent(value: float | None, recorded: float) -> float | None:
    """Deviation from the recorded value, %; None if there is no value."""
    return None if value is None else 100 * (value / recorded - 1)
