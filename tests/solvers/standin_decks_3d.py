"""Behaves as ABAQUS on decks in three dimensions: reads rubber, pressure and what is asked from the
texts as they were given, and answers with the bundled solver's modes of the axisymmetric twin."""

from __future__ import annotations

import re
import sys
from pathlib import Path

DONE = " THE ANALYSIS HAS COMPLETED SUCCESSFULLY\n"


def main(arguments: list[str]) -> int:
    given = dict(word.partition("=")[::2] for word in arguments)
    if "information" in given:
        print("Abaqus 2023")
        return 0
    job = given["job"]
    reads = "*RESTART, READ" in Path(f"{job}.inp").read_text()
    assert reads == ("oldjob" in given)
    if reads:
        assert Path(f"{given['oldjob']}.res").exists()
        _modes(Path(f"{given['oldjob']}.inp").read_text(), Path(f"{job}.inp").read_text())
    else:
        Path(f"{job}.res").write_text("restart")
    Path(f"{job}.sta").write_text(DONE)
    return 0


def _modes(inflation: str, step: str) -> None:
    import decks_3d
    import numpy as np
    from standin_abaqus import dat, fil

    from tyrecal.simulate.deck.tyre_design import TyreDesign
    from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
    from tyrecal.simulate.evaluate.results import HarmonicShape
    from tyrecal.tyre.case.own_case import own_case
    from tyrecal.tyre.load import load_case
    from tyrecal.tyre.own_deck.own_deck import read_own_deck

    expected = ["*NODE FILE, NSET=CROWN", "U, COORD", "*MODAL FILE", "*END STEP"]
    assert step.splitlines()[-4:] == expected
    assert "*FILE FORMAT, ASCII\n*STEP" in inflation and "FILE FORMAT" not in step
    c10 = float(re.findall(r"NEO HOOKE\n([^,]+),", inflation)[0])
    pressure = float(re.findall(r"RUBBER, P6, (\S+)", inflation)[0])
    wanted = int(re.findall(r"FREQUENCY\n(\d+)", step)[0])
    Path("twin.inp").write_text(decks_3d.axisymmetric(c10, pressure))
    deck = read_own_deck(Path("twin.inp"))
    flat = deck.flat({})
    Path("twin.yaml").write_text(own_case(deck, flat, "P235/75R17", None))
    design = TyreDesign(load_case("twin.yaml", allow_unusual=True))
    answer = Evaluator(design, "bundled").evaluate(Question({}))
    numbers = {n: k for k, n in enumerate(sorted(flat.model.nodes), start=1)}
    places, _, sets = decks_3d.revolved()
    points = np.array([places[n] for n in sets["CROWN"]])
    line = [
        numbers[decks_3d.number(2, decks_3d.ALONG + j)]
        for j in range(-decks_3d.CROWN, decks_3d.CROWN + 1)
    ]
    turn = np.arctan2(points[:, 2], points[:, 1])
    zero, one = 0 * turn, 1 + 0 * turn
    axes = np.array(
        [[zero, np.cos(turn), np.sin(turn)], [zero, -np.sin(turn), np.cos(turn)], [one, zero, zero]]
    )
    modes = []
    for mode in answer.modes:
        shape = mode.shape
        assert isinstance(shape, HarmonicShape)
        rows = [list(shape.nodes).index(n) for n in line] * decks_3d.SECTORS
        for half in range(mode.multiplicity):
            phase = np.exp(1j * (shape.n * turn + half * np.pi / 2 + 0.3))
            u = (shape.amplitude[rows] * phase[:, None]).real
            modes.append(((2 * np.pi * mode.frequency_Hz) ** 2, np.einsum("kc,cxk->kx", u, axes)))
    modes.sort(key=lambda mode: mode[0])
    values = [value for value, _ in modes[:wanted]]
    Path("inflate.dat").write_text(dat([], answer.mass_kg))
    Path("modes.dat").write_text(dat(values, 0.0).replace("TOTAL MASS", ""))
    Path("modes.fil").write_text(fil(points, values, [u for _, u in modes[:wanted]]))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
