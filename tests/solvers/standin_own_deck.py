"""Behaves as ABAQUS on a user's deck and the job that revolves it: reads the text as it was given,
solves what it describes with the bundled solver, and answers in the deck's own units."""

from __future__ import annotations

import sys
from pathlib import Path

SECTORS = 24
DONE = " THE ANALYSIS HAS COMPLETED SUCCESSFULLY\n"


def main(arguments: list[str]) -> int:
    given = dict(word.partition("=")[::2] for word in arguments)
    if "information" in given:
        print("Abaqus 2023")
        return 0
    job = given["job"]
    if job == "modes":
        assert Path("inflate.res").exists()
        _modes()
    else:
        Path("inflate.res").write_text("restart")
    Path(f"{job}.sta").write_text(DONE)
    return 0


def _modes() -> None:
    import numpy as np
    from standin_abaqus import _cartesian, dat, fil
    from tyrecal_solvers.language.text import read_keywords

    from tyrecal.simulate.deck.tyre_design import TyreDesign
    from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
    from tyrecal.simulate.evaluate.results import HarmonicShape
    from tyrecal.tyre.case.own_case import own_case
    from tyrecal.tyre.load import load_case
    from tyrecal.tyre.own_deck.own_deck import UNIT_LENGTH, UNIT_MASS, read_own_deck

    deck = read_own_deck(Path("inflate.inp"))
    length, mass = UNIT_LENGTH[deck.units], UNIT_MASS[deck.units]
    flat = deck.flat({})
    Path("own.yaml").write_text(own_case(deck, flat, "P235/75R17", None))
    design = TyreDesign(load_case("own.yaml", allow_unusual=True))
    answer = Evaluator(design, "bundled").evaluate(Question({}, modes_per_harmonic=3))
    blocks = read_keywords(Path("modes.inp").read_text())
    transfer = next(k for k in blocks if k.name == "SYMMETRIC RESULTS TRANSFER")
    assert transfer.get("STEP") == "1"
    (load,) = (k for k in blocks if k.name == "DSLOAD")
    assert float(load.rows[0].text(2)) * mass / length == flat.pressure_Pa
    wanted = next(k for k in blocks if k.name == "FREQUENCY").rows[0].integer(0)
    name = next(k for k in blocks if k.name == "NODE FILE").get("NSET")
    numbers = {n: k for k, n in enumerate(sorted(flat.model.nodes), start=1)}
    crown = [numbers[n] for n in flat.model.node_sets[name]]
    angles = 2 * np.pi * np.arange(SECTORS) / SECTORS
    modes = []
    for mode in answer.modes:
        shape = mode.shape
        assert isinstance(shape, HarmonicShape)
        places = [list(shape.nodes).index(n) for n in crown]
        for half in range(mode.multiplicity):
            turned = np.exp(1j * (shape.n * angles[:, None, None] + half * np.pi / 2))
            u = (shape.amplitude[places] * turned).real
            modes.append(((2 * np.pi * mode.frequency_Hz) ** 2, _cartesian(u, angles)))
    modes.sort(key=lambda mode: mode[0])
    values = [value for value, _ in modes[:wanted]]
    R, Z = shape.points[places].T / length
    rest = np.stack([R, 0 * R, Z], -1)[None] * np.ones((SECTORS, 1, 1))
    Path("modes.dat").write_text(dat(values, answer.mass_kg / mass))
    Path("modes.fil").write_text(
        fil(_cartesian(rest, angles), values, [u for _, u in modes[:wanted]])
    )


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
