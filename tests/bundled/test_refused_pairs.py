"""Pairs of jobs that are refused, as they mean something else than the tool would write."""

from __future__ import annotations

import re

import pytest
from tyrecal_solvers.bundled.deck.steps import Deck
from tyrecal_solvers.language.text import DeckError

from .job_pairs import FREQUENCY, MASS, PLAIN, STEP, TURNING, WHEEL, run, texts

RELEASED = "*BOUNDARY, OP=NEW\n"
SPRING_ON = "*ELEMENT, TYPE=SPRING1, ELSET=K\n999000009, 900001\n*SPRING, ELSET=K\n"


@pytest.mark.parametrize(
    ("effects", "old", "new", "words"),
    [
        (PLAIN, "*SYMMETRIC RESULTS TRANSFER, STEP=1, INC=10\n", "", "needs *SYMMETRIC RESULTS"),
        (PLAIN, "*FREQUENCY", "*STATIC\n1., 1.\n*FREQUENCY", "needs one *STATIC, *FREQ"),
        (
            PLAIN,
            "CAVITY, P, 160000\n*END STEP\n*STEP, NAME=MODES\n",
            "CAVITY, P, 160000\n*END STEP\n*STEP, NAME=MODES, PERTURBATION\n*STATIC\n",
            "needs one",
        ),
        (PLAIN, "DIRECT\n0.1, 1.0\n", "DIRECT\n0.1, 1.0\n0.1, 1.0\n", "takes one data line"),
        (PLAIN, STEP, f"*BOUNDARY\nNOWHERE, 1\n{STEP}", "node set NOWHERE is not defined"),
        (PLAIN, STEP, f"*BOUNDARY\n77, 1\n{STEP}", "node set 77 is not defined"),
        (PLAIN, STEP, f"*BOUNDARY\nCROWN, 2, 2, 0.1\n{STEP}", "only zero displacements"),
        (PLAIN, STEP, f"*BOUNDARY\nCROWN, 4, 6\n{STEP}", "freedom 4 to 6 of a set cannot"),
        (PLAIN, STEP, f"*BOUNDARY\nCROWN, 1\n{STEP}", "freedom 1 to 1 of a set cannot"),
        (PLAIN, "TIE NSET=RIM\n*STEP", "TIE NSET=BEAD\n*STEP", "it must be restated"),
        (
            PLAIN,
            "REF NODE=900001, TIE NSET=RIM\n*SOLID",
            "REF NODE=5, TIE NSET=RIM\n*SOLID",
            "node 5 or node set RIM is not defined",
        ),
        (
            PLAIN,
            "*END STEP\n*STEP, NAME=MODES\n*FREQUENCY",
            "*END STEP\n*STEP, NAME=MODES\n*COMPLEX FREQUENCY",
            "not honoured",
        ),
        (PLAIN, FREQUENCY, "*COMPLEX FREQUENCY\n20\n", "no ROTDYNF"),
        (TURNING, "CENTRIF, 25", "CENTRIF, 26", "must be one for all elements"),
        (TURNING, "ROTDYNF, 5,", "ROTDYNF, 6,", "must be one for all elements"),
        (TURNING, "SOLID_1, CENTRIF, 25, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0\n", "", "is left out of"),
        (TURNING, "PLY, CENTRIF", "PLIES, CENTRIF", "element set PLIES of the step's *DLOAD"),
        (TURNING, "PLY, CENTRIF", "PLY, GRAV", "the load 'GRAV' is not"),
        (TURNING, "25, 0.0, 0.0, 0.0, 0.0, 1.0", "25, 0.0, 0.0, 0.0, 1.0, 0.0", "about its axle"),
        (WHEEL, "999000001, 900001", "999000001, 5", "node 5 is no node of the tyre"),
        (WHEEL, "*MASS, ELSET=WHEEL_MASS", "*MASS, ELSET=WHEEL_INERTIA", "no set of MASS"),
        (WHEEL, "0.18, 0.2866666666667, 0.18", "0.18, 0.28, 0.19", "body of revolution"),
        (WHEEL, RELEASED, f"{RELEASED}900001, 1\n", "are free together"),
        (WHEEL, "WELL, P, 160000\n", "", "which is free along the axle"),
        (WHEEL, "REFERENCE\n900001, 0, 0\n", "REFERENCE\n900001, 0.1, 0\n", "must be on the axle"),
        (WHEEL, STEP, f"{SPRING_ON}1\n{STEP}", "*SPRING takes two lines"),
        (WHEEL, STEP, f"{SPRING_ON}1\n1E6\n{STEP}", "degrees of freedom (1, 3) of the rim"),
        (WHEEL, STEP, f"{SPRING_ON}2\n-1E6\n{STEP}", "are not negative"),
        (WHEEL, STEP, f"{SPRING_ON}7\n1E6\n{STEP}", "degrees of freedom 1 to 6"),
        (MASS, "ELSET=POINT_MASS\n0.1", "ELSET=POINT_MASS\n-0.1", "*MASS must be positive"),
        (MASS, "ELSET=POINT_MASS\n0.1", "ELSET=POINT_MASS\n0.1\n0.1", "*MASS takes 1 data line"),
    ],
)
def test_a_pair_that_means_something_else_is_refused(
    effects: tuple[tuple[str, float], ...], old: str, new: str, words: str
) -> None:
    with pytest.raises(DeckError) as error:
        run(effects, (old, new))
    assert words in str(error.value)


SECTION_ROWS = "*STATIC, LONG TERM, DIRECT\n0.1, 1.0\n*BOUNDARY\n900001, 1, 6\n"
LAW = "*VISCOELASTIC, FREQUENCY=TABULAR\n"


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("STEP=1, INC=10", "STEP=2, INC=10", "ends with STEP=1, INC=10"),
        ("STEP=1, INC=10", "STEP=1, INC=9", "ends with STEP=1, INC=10"),
        ("DIRECT\n0.1, 1.0", "DIRECT\n0.3, 1.0", "ends with STEP=1, INC=4"),
        ("DIRECT\n0.1, 1.0", "DIRECT\n0.1, 1.05", "ends with STEP=1, INC=11"),
        ("LONG TERM, DIRECT", "LONG TERM", "must be fixed (DIRECT)"),
        ("360.0, 60", "359.9, 60", "revolved by 360 degrees"),
        ("360.0, 60", "180.0, 30, 1.0, G\n180.1, 30", "revolved by 360 degrees"),
        ("0.0, 0.0, 0.0, 0.0, 1.0, 0.0", "0.1, 0.0, 0.0, 0.0, 1.0, 0.0", "about the second axis"),
        ("0.0, 0.0, 0.0, 0.0, 1.0, 0.0", "0.0, 0.0, 0.0, 0.1, 1.0, 0.0", "about the second axis"),
        ("0.0, 0.0, 0.0, 0.0, 1.0, 0.0", "0.0, 0.0, 0.0, 0.0, 1.0, 0.1", "about the second axis"),
        ("0.0, 0.0, 0.0, 0.0, 1.0, 0.0", "0.0, 0.0, 0.0, 0.0, 0.0, 0.0", "about the second axis"),
        ("0.0, 0.0, 0.0, 0.0, 1.0, 0.0", "0.0, 0.0, 0.0, 0.0, -1.0, 0.0", "about the second axis"),
        (SECTION_ROWS, f"*FREQUENCY\n3\n{SECTION_ROWS[41:]}".replace("0.1, 1.0\n", ""), "one step"),
        ("INFLATE, NLGEOM=YES", "INFLATE", "needs NLGEOM=YES"),
        ("INFLATE, NLGEOM=YES", "INFLATE, NLGEOM=YES, PERTURBATION", "no linear PERTURBATION"),
        ("CAVITY, P, 160000\n*END STEP\n*STEP", "CAVITY, HP, 160000\n*END STEP\n*STEP", "only P"),
        (
            "900001, 1, 6\n*DSLOAD\nCAVITY, P, 160000\n*END STEP\n*STEP",
            "900001, 1, 5\n*DSLOAD\nCAVITY, P, 160000\n*END STEP\n*STEP",
            "must be held in 1, 6",
        ),
        ("*VISCOELASTIC, TIME=PRONY\n0.3, 0, 0.1\n", f"{LAW}0., 0.3, 0., 0., 10.\n", "two rows"),
        (
            "*VISCOELASTIC, TIME=PRONY\n0.3, 0, 0.1\n",
            f"{LAW}0., 0.3, 0., 0., 10.\n0., 0.2, 0., 0., 10.\n",
            "their frequencies rise",
        ),
        (
            "*VISCOELASTIC, TIME=PRONY\n0.3, 0, 0.1\n",
            f"{LAW}0., 0.3, 0., 0., 0.\n0., 0.2, 0., 0., 10.\n",
            "their frequencies rise",
        ),
        (
            "*VISCOELASTIC, TIME=PRONY\n0.3, 0, 0.1\n",
            f"{LAW}0., 1.0, 0., 0., 1.\n0., 0.2, 0., 0., 10.\n",
            "are positive",
        ),
        (
            "*VISCOELASTIC, TIME=PRONY\n0.3, 0, 0.1\n",
            f"{LAW}0., 0.3, 0., 0.1, 1.\n0., 0.2, 0., 0., 10.\n",
            "the bulk modulus stays",
        ),
        ("0.3, 0, 0.1\n", "0.3, 0, 0.1, 0.2\n", "data '0.2' is not honoured"),
    ],
)
def test_what_a_transfer_or_a_table_may_not_be(old: str, new: str, words: str) -> None:
    """Read alone, without a solution: what stands there would mean another state."""
    with pytest.raises(DeckError, match=re.escape(words)):
        run(PLAIN, (old, new))


def test_a_revolve_job_alone_is_refused() -> None:
    pair = dict(texts(PLAIN))
    with pytest.raises(DeckError, match="name that with --oldjob"):
        Deck({"modes": pair["modes"]}, "modes", None)
