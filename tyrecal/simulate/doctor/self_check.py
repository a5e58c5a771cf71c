"""Check of a solver on a small known tyre: ``check.yaml`` against the results recorded here.

The rim is fixed and the pressure that of the file.

The test that a user with ABAQUS runs for us has pairs of decks of this tyre, the frequencies that
they should have, and a page that says what to send back.
"""

from __future__ import annotations

import time
from dataclasses import replace
from math import degrees
from pathlib import Path

from ...files import Json, atomic_write, make_folder
from ...tyre.case import LoadedCase
from ...tyre.load import load_case
from ..deck.decks import Decks
from ..deck.tyre_design import TyreDesign
from ..evaluate.evaluator import Evaluator, Question
from ..evaluate.results import Evaluation
from ..modes.label import in_words, labelled

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


# between the carcass cords of the folder angular, 1 mm apart at a radius of 0.3 m; in degrees, says
# the manual, times the distance from the axle
FANNED_DEG = 0.19
READINGS: dict[str, Json] = {  # keys of a layer that mean what ABAQUS might read in FANNED_DEG
    "manual": {"geometry": "angular", "spacing_m": None, "spacing_deg": FANNED_DEG},
    "one spacing": {"spacing_m": 1e-3},
    "radians": {"geometry": "angular", "spacing_m": None, "spacing_deg": degrees(FANNED_DEG)},
    "metres": {"spacing_m": FANNED_DEG},
}
PAGE = """A selftest of tyrecal's decks on ABAQUS/Standard

1. In each of the folders plain and angular run, with any release from 6.14 on,

       abaqus job=inflate interactive
       abaqus job=modes oldjob=inflate interactive

   The first inflates a tyre's section, the second revolves it and finds {modes} modes.
2. modes.dat lists frequencies in cycles per time (Hz). Modes come in pairs, except two.
   Expected frequencies, by tyrecal's solver with the same mesh of the section and an exact
   circumference:

{plain}
   If they agree within 1 %, the decks are right. The list has other modes between and above
   these, of more waves round the tyre.
3. In the folder angular the carcass has *REBAR LAYER, GEOMETRY=ANGULAR with the number {deg:g}.
   Compare its frequencies with these columns. The matching column shows how the revolve reads the
   number: in degrees times the distance from the axle, as in the manual; as one spacing of 1 mm;
   in radians; as metres.

{angular}
   The first two columns differ less than two meshes may. To separate them, divide by the frequency
   of the same mode in the folder plain. {last} is {ratio:.4f} by the manual, and 1.0000 with one
   spacing. TOTAL MASS OF MODEL in inflate.dat shows how the section reads the number, that in
   modes.dat how the revolve does. A job that stops because an orientation is missing is a result,
   too: the manual requires a cylindrical one in three dimensions, which the revolve should make.
4. Send back, from each folder: inflate.dat, inflate.msg, inflate.sta, modes.dat, modes.msg,
   modes.sta, modes.fil, and the output of 'abaqus information=release'. If a job stops, send its
   ***ERROR lines in .dat or .msg, and change nothing.

The selftest also shows: whether ABAQUS accepts the decks; whether the revolve keeps the node set
CROWN and turns about y; whether shapes are written to modes.fil without SIM=NO; and where the .dat
file states the total mass, {mass_kg:.4f} kg in the folder plain.
"""


def write_selftest(folder: Path) -> list[Path]:
    """Write the pairs and the page into a folder; the files. Raises InputError, OSError."""
    plain, paths = load_case(CASE), list[Path]()
    cases = {"plain": plain, "angular": _with_carcass(plain, READINGS["manual"])}
    for name, case in cases.items():
        files = Decks(TyreDesign(case)).texts("abaqus")
        files["expected.csv"] = "mode,frequency_Hz,modes\n" + "".join(
            f'"{mode.label}",{mode.frequency_Hz:.4f},{mode.multiplicity}\n'
            for mode in labelled(_answer(case))
        )
        for file, text in files.items():
            paths.append(_written(folder / name / file, text))
    answer = _answer(plain)
    answers = {each: _answer(_with_carcass(plain, how)) for each, how in READINGS.items()}
    last_label = str(labelled(answer)[-1].label)
    # as many as the deck requests, two a pair; single modes, n = 0, leave some to spare
    count = 2 * plain.case.analysis.modes_per_harmonic * (plain.case.analysis.highest_harmonic + 1)
    page = PAGE.format(
        modes=count,
        plain=_table({"Hz": answer}),
        angular=_table(answers),
        deg=FANNED_DEG,
        last=last_label,
        ratio=_hertz(answers["manual"])[last_label] / _hertz(answer)[last_label],
        mass_kg=answer.mass_kg,
    )
    return [_written(folder / "README.txt", page), *paths]


def _answer(case: LoadedCase) -> Evaluation:
    return Evaluator(TyreDesign(case), "bundled").evaluate(Question({}))


def _hertz(answer: Evaluation) -> dict[str, float]:
    """Frequencies by label."""
    return {str(mode.label): mode.frequency_Hz for mode in labelled(answer)}


def _table(answers: dict[str, Evaluation]) -> str:
    """Frequencies and masses, a column each."""
    first = next(iter(answers.values()))
    twice = {str(mode.label): "  twice" * (mode.multiplicity == 2) for mode in labelled(first)}
    rows = [("", "", *answers)]
    rows += [
        (in_words(label), words, *(f"{_hertz(each)[label]:.3f}" for each in answers.values()))
        for label, words in twice.items()
    ]
    rows.append(("total mass, kg", "", *(f"{each.mass_kg:.4f}" for each in answers.values())))
    lines = (
        f"       {label:16}" + "".join(f"{text:>13}" for text in texts) + words
        for label, words, *texts in rows
    )
    return "\n".join(line.rstrip() for line in lines) + "\n"


def _with_carcass(case: LoadedCase, update: Json) -> LoadedCase:
    """The tyre with the keys ``update`` of its layer carcass."""
    layers = dict(case.case.rebar_layers)
    layers["carcass"] = layers["carcass"].model_copy(update=update)
    return replace(case, case=case.case.model_copy(update={"rebar_layers": layers}))


def _written(path: Path, text: str) -> Path:
    make_folder(path.parent)
    with atomic_write(path) as partial:
        partial.write_text(text, encoding="utf-8", newline="")
    return path
