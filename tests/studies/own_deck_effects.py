"""Effects withheld from a user's deck, and what a diagnosis says of each.

    python -m tests.studies.own_deck_effects

The deck is the tests' (`tests.tyre.own_decks.compounds`), its parts named; the tyre has another
cord area and modulus than the case, an effect of `DRAWN`, and its labelled frequencies at two
pressures scatter by 0.05 %, its mass by 10 g. Two variables are calibrated. Prints a table; about a
minute of a core.
"""

from __future__ import annotations

import json
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from ruamel.yaml import YAML

from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.simulate.modes.label import paired_labels
from tyrecal.studies.diagnose.study import study
from tyrecal.tyre.case import LoadedCase
from tyrecal.tyre.case.own_case import own_case
from tyrecal.tyre.load import load_case
from tyrecal.tyre.own_deck.own_deck import read_own_deck

from ..tyre import own_decks

PARTS = {"tread": ["TREAD"], "sidewall": ["SIDEWALL"], "bead_filler": ["BODY"], "belts": ["BELT"]}
DRAWN = {
    "sidewall_gauge": 0.12,
    "bead_filler": 2.0,
    "tread_wear": 0.4,
    "tread_density": -0.2,
    "belt_angle": -3.0,
    "": 0.0,
}
CONSIDERED = [id for id in DRAWN if id]
PRESSURES_kPa = (160.0, 240.0)
SCATTER, MASS_SIGMA_kg = 5e-4, 0.01


def case_of(folder: Path) -> LoadedCase:
    """The deck's, with one variable for the shear constants of all its rubber."""
    path = folder / "tyre.inp"
    path.write_text(own_decks.compounds())
    deck = read_own_deck(path)
    case = YAML(typ="safe").load(own_case(deck, deck.flat({}), "not given", None))
    case["deck"]["parts"] = PARTS
    case["analysis"]["highest_harmonic"] = 3
    shear, area = case["variables"]["C10_BODY"], case["variables"]["A_CORD"]
    shear["sets"] = [f"material {m} / HYPERELASTIC / C10" for m in ("TREAD", "SIDEWALL", "BODY")]
    case["variables"] = {"A_CORD": area, "C10": shear}
    path.with_suffix(".yaml").write_text(json.dumps(case))
    return load_case(path.with_suffix(".yaml"))


def measured(evaluator: Evaluator, effect: dict[str, float], path: Path) -> None:
    """Write what is measured of the tyre with an effect."""
    noise = np.random.default_rng(1)
    rows = ["quantity,c,m,kind,member,pressure_kPa,load_N,value,sigma"]
    for kPa in PRESSURES_kPa:
        design = {**effect, "A_CORD": 4e-7, "C10": 9e5, "pressure_kPa": kPa}
        evaluation = evaluator.evaluate(Question(design))
        for mode in paired_labels(evaluation.modes):
            f = mode.frequency_Hz * (1 + SCATTER * noise.standard_normal())
            label = f"{mode.label.c},{mode.label.m},{mode.label.kind or ''}"
            rows += [f"frequency_Hz,{label},,{kPa},0,{f!r},{SCATTER * f!r}"] * (mode.label.m < 2)
    rows.append(f"mass_kg,,,,,{PRESSURES_kPa[-1]},0,{evaluation.mass_kg!r},{MASS_SIGMA_kg}")
    path.write_text("\n".join(rows) + "\n")


def main() -> None:
    print("| drawn | size | said | likeliest | probability |\n" + "|---" * 5 + "|")
    with TemporaryDirectory() as folder:
        case, path = case_of(Path(folder)), Path(folder) / "measured.csv"
        evaluator = Evaluator(TyreDesign(case))
        for id, size in DRAWN.items():
            measured(evaluator, {f"effects.{id}": size} if id else {}, path)
            d = study(case, evaluator, path, effects=CONSIDERED, section_map=False).diagnosis
            best = max(d.probabilities, key=lambda key: d.probabilities[key])
            print(
                f"| {id or 'none'} | {size:g} | {d.verdict.words} | {best} |"
                f" {d.probabilities[best]:.2f} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
