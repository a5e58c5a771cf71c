"""What somebody with an ABAQUS runs for us: pairs of decks of the known tyre, the frequencies that
they should have, and a page that says what to send back."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from ...files import whole
from ...tyre.case import LoadedCase
from ...tyre.load import load_case
from ..deck.decks import Decks
from ..deck.tyre_design import TyreDesign
from ..evaluate.evaluator import Evaluator, Question
from ..modes.label import labelled
from .self_check import CASE

# degrees between the carcass cords of the second pair, 1 mm apart at a radius of 0.3 m
FANNED_DEG = 0.19
PAGE = """A selftest of tyrecal's decks on ABAQUS/Standard

1. In each of the folders {folders} run, with any release from 6.14 on,

       abaqus job=inflate interactive
       abaqus job=modes oldjob=inflate interactive

   The first inflates a tyre's section, the second revolves it and finds {modes} modes.
2. modes.dat lists frequencies in cycles per time (Hz). Modes come in pairs but for two.
   Expected, of the solver that comes with tyrecal, whose section is the same mesh and whose
   circumference is exact:

{tables}
   Within 1 % of them, the decks say what they should. The list holds other modes between and
   above these, of more waves round the tyre.
3. Send back, of each folder: inflate.dat, inflate.msg, inflate.sta, modes.dat, modes.msg,
   modes.sta, modes.fil, and what 'abaqus information=release' prints. Where a job stops, its
   ***ERROR lines in .dat or .msg are what we want; stop there, change nothing.

What it answers: whether ABAQUS accepts the decks as they are; whether the revolve takes the node
set CROWN along and turns about y; whether shapes get into modes.fil without SIM=NO; where the
.dat file states the total mass, {mass_kg:.4f} kg here; and, from the folder angular, whether a
revolve gives a *REBAR LAYER, GEOMETRY=ANGULAR the cylindrical orientation that its manual asks
for.
"""


def write_selftest(folder: Path) -> list[Path]:
    """Write the pairs and the page into a folder; the files. Raises InputError, OSError."""
    plain, paths, tables = load_case(CASE), list[Path](), ""
    cases = {"plain": plain, "angular": _fanned(plain)}
    for name, case in cases.items():
        design = TyreDesign(case)
        answer = Evaluator(design, "bundled").evaluate(Question({}))
        rows = [(f"{m.label}", m.frequency_Hz, m.multiplicity) for m in labelled(answer)]
        files = Decks(design).texts("abaqus")
        files["expected.csv"] = "mode,frequency_Hz,modes\n" + "".join(
            f'"{label}",{hertz:.4f},{count}\n' for label, hertz, count in rows
        )
        lines = [
            f"       {label:16} {hertz:9.3f} Hz  {'twice' * (n == 2)}" for label, hertz, n in rows
        ]
        tables += "\n".join([f"   {name}:", *map(str.rstrip, lines)]) + "\n"
        for file, text in files.items():
            paths.append(_written(folder / name / file, text))
    asked = 2 * plain.case.analysis.modes_per_harmonic * (plain.case.analysis.highest_harmonic + 1)
    page = PAGE.format(
        folders=" and ".join(cases), modes=asked, tables=tables, mass_kg=answer.mass_kg
    )
    return [_written(folder / "README.txt", page), *paths]


def _fanned(case: LoadedCase) -> LoadedCase:
    """The tyre with a carcass whose cords fan out with the radius."""
    layers = dict(case.case.rebar_layers)
    update = {"geometry": "angular", "spacing_m": None, "spacing_deg": FANNED_DEG}
    layers["carcass"] = layers["carcass"].model_copy(update=update)
    return replace(case, case=case.case.model_copy(update={"rebar_layers": layers}))


def _written(path: Path, text: str) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    with whole(path) as partial:
        partial.write_text(text, encoding="utf-8", newline="")
    return path
