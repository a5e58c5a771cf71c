"""All that the table admits of the bundled solver's jobs changes the answer, is refused, or is
listed as quiet or as output.

For each keyword and option that is honoured: in some pair of jobs that has it, without it, or with
another of its words, the answer is another one or the job is refused. The answer of a pair is
frequencies, mass and inflated shape; of a pair with a road it is what the contact is computed with.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cache
from typing import Any

import pytest
from tyrecal_solvers.bundled.deck.request import CavityRequest, Request
from tyrecal_solvers.bundled.deck.steps import Deck
from tyrecal_solvers.bundled.job import Job
from tyrecal_solvers.errors import Refused, RunFailed
from tyrecal_solvers.language.laws import LAW_CONSTANTS
from tyrecal_solvers.language.model_rules import MODEL_RULES
from tyrecal_solvers.language.rule import PLACES as PLACES_OF_BLOCKS
from tyrecal_solvers.language.rule import QUIET
from tyrecal_solvers.language.step_rules import STEP_RULES
from tyrecal_solvers.language.table import OTHER_KEYWORDS, RULES
from tyrecal_solvers.language.text import Block

PLACES = ("section", "revolve", "step")
NOTES = {
    "output",
    "contact",
    "not judged",
    *(f"once a {each}" for each in ("job", "step", "parent")),
}
Pair = dict[str, Sequence[Block]]
SECTION = """*NODE, NSET=ALL
1, 0.2, -0.06
2, 0.2, -0.02
3, 0.2, 0.02
4, 0.2, 0.06
5, 0.3, -0.06
6, 0.3, -0.02
7, 0.3, 0.02
8, 0.3, 0.06
*NODE, NSET=HUB
900, 0., 0.
*ELEMENT, TYPE=CGAX4R, ELSET=SOLID
1, 1, 5, 6, 2
2, 2, 6, 7, 3
3, 3, 7, 8, 4
*ELEMENT, TYPE=SFMGAX1, ELSET=PLY
11, 5, 6
12, 6, 7
13, 7, 8
*NSET, NSET=RIM
1, 4
*NSET, NSET=ENDS, GENERATE
5, 8, 3
*ELSET, ELSET=OUTER, GENERATE
1, 3
*SURFACE, NAME=CAVITY, TYPE=ELEMENT
OUTER, S4
*SURFACE, NAME=TREAD, TYPE=ELEMENT
OUTER, S2
*RIGID BODY, REF NODE=900, TIE NSET=RIM
*SOLID SECTION, ELSET=SOLID, MATERIAL=RUBBER
*SURFACE SECTION, ELSET=PLY
*REBAR LAYER
PLY, 1e-7, 1e-3, 0., CORD, 20.
*MATERIAL, NAME=RUBBER
*HYPERELASTIC, MOONEY-RIVLIN, MODULI=LONG TERM
1e6, 2e5, 5e-8
*VISCOELASTIC, TIME=PRONY
0.3, 0.1, 0.01
*DENSITY
1100.
*MATERIAL, NAME=CORD
*ELASTIC
1e8, 0.3
*DENSITY
1500.
*STEP, NAME=INFLATE, NLGEOM=YES, INC=100
*STATIC, LONG TERM, DIRECT
0.5, 1.
*BOUNDARY
HUB, 1, 6
*DSLOAD, OP=MOD
CAVITY, P, 2e4
*END STEP
"""
REVOLVE = """*SYMMETRIC MODEL GENERATION, REVOLVE
0., 0., 0., 0., 1., 0.
1., 0., 0.
360., 60, 1., G
*SYMMETRIC RESULTS TRANSFER, STEP=1, INC=2
*NODE, NSET=HUB
900, 0., 0., 0.
*RIGID BODY, REF NODE=900, TIE NSET=RIM
*STEP, NAME=EQUILIBRIUM, NLGEOM=YES, INC=100
*STATIC, LONG TERM
1., 1.
*BOUNDARY
900, 1, 6
*DSLOAD, OP=MOD
CAVITY, P, 2e4
*END STEP
*STEP, NAME=MODES, PERTURBATION
*FREQUENCY, EIGENSOLVER=LANCZOS, NORMALIZATION=MASS, PROPERTY EVALUATION=20., SIM=NO
8
*BOUNDARY, OP=NEW
900, 1, 6
*END STEP
"""
TABLE = """*VISCOELASTIC, FREQUENCY=TABULAR
0.01, -0.2, 0., 0., 1.
0.01, -0.8, 0., 0., 1000.
"""
WHEEL = """*ELEMENT, TYPE=MASS, ELSET=WHEEL
901, 900
*MASS, ELSET=WHEEL
5.
*ELEMENT, TYPE=ROTARYI, ELSET=INERTIA
902, 900
*ROTARY INERTIA, ELSET=INERTIA
0.1, 0.2, 0.1
*ELEMENT, TYPE=SPRING1, ELSET=UP
903, 900
*SPRING, ELSET=UP
1
1e5
*ELEMENT, TYPE=SPRING1, ELSET=ALONG
904, 900
*SPRING, ELSET=ALONG
3
1e5
"""
TURNING = """*DLOAD, OP=MOD
SOLID, CENTRIF, 25.{axis}
PLY, CENTRIF, 25.{axis}
"""
WAVES = """*STEP, NAME=WAVES
*COMPLEX FREQUENCY, PROPERTY EVALUATION=20.
8
*DLOAD, OP=MOD
SOLID, ROTDYNF, 5., 0., 0., 0., 0., 1., 0.
PLY, ROTDYNF, 5., 0., 0., 0., 0., 1., 0.
*END STEP
"""
ROAD = """*NODE
950, 0.35, 0., 0.
*SURFACE, NAME=ROAD, TYPE=CYLINDER
0.35, 0., 0., 0.35, 1., 0.
0.35, 0., -1.
START, -1., 0.
LINE, 1., 0.
*RIGID BODY, REF NODE=950, ANALYTICAL SURFACE=ROAD
*SURFACE INTERACTION, NAME=GRIP
*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR
1e9
*FRICTION, ELASTIC SLIP=1e-4
0.5
*CONTACT PAIR, INTERACTION=GRIP, TYPE=SURFACE TO SURFACE
TREAD, ROAD
"""
PRESSED = """*STEP, NAME=LOAD, NLGEOM=YES
*STATIC, LONG TERM
1., 1.
*CONTACT CONTROLS, SLAVE=TREAD, MASTER=ROAD, STABILIZE
*BOUNDARY, OP=NEW
900, 1, 6
950, 2, 6
*CLOAD, OP=MOD
950, 1, -100.
*END STEP
"""
LAWS = {
    "NEO HOOKE": "1e6, 5e-8",
    "YEOH": "1e6, 1e4, 1e4, 5e-8",
    "REDUCED POLYNOMIAL, N=2": "1e6, 1e4, 5e-8, 5e-8",
    "POLYNOMIAL, N=2": "1e6, 2e5, 1e4, 1e4, 1e4, 5e-8",
    "ARRUDA-BOYCE": "2e6, 3., 5e-8",
    "OGDEN, N=2": "2e6, 2., 1e5, -2., 5e-8",
}


def section(*edits: tuple[str, str]) -> str:
    """The section job, edited."""
    return edited(SECTION, *edits)


def edited(text: str, *edits: tuple[str, str]) -> str:
    """A text with (old, new) edits of what is in it."""
    for old, new in edits:
        assert old in text, old
        text = text.replace(old, new, 1)
    return text


def pairs() -> Iterator[tuple[str, str, Request]]:
    """Texts of both jobs, and what is requested with them."""
    plain = Request(harmonics=[2], modes_per_harmonic=1)
    yield SECTION, REVOLVE, plain
    for law, data in LAWS.items():
        hyperelastic = ("MOONEY-RIVLIN, MODULI=LONG TERM\n1e6, 2e5, 5e-8", f"{law}\n{data}")
        yield section(hyperelastic), REVOLVE, plain
    yield (
        section(
            ("MATERIAL=RUBBER\n", "MATERIAL=RUBBER, CONTROLS=HARD\n*HOURGLASS STIFFNESS\n3e4\n"),
            ("*MATERIAL, NAME=RUBBER", "*SECTION CONTROLS, NAME=HARD, HOURGLASS=STIFFNESS\n{0}"),
            ("{0}", "*MATERIAL, NAME=RUBBER"),
            ("*REBAR LAYER\nPLY, 1e-7, 1e-3", "*REBAR LAYER, GEOMETRY=ANGULAR\nPLY, 1e-7, 0.3"),
            ("*VISCOELASTIC, TIME=PRONY\n0.3, 0.1, 0.01\n", TABLE),
            ("*ELASTIC\n1e8, 0.3\n", "*ELASTIC, TYPE=ISOTROPIC, MODULI=LONG TERM\n1e8, 0.3\n{0}"),
            ("{0}", "*NO COMPRESSION\n"),
            ("CORD, 20.", "CORD, 90."),
            ("HUB, 1, 6\n", "HUB, 1, 6\nENDS, 2\n"),
            ("CAVITY, P", "TREAD, P"),
        ),
        edited(
            REVOLVE,
            ("CAVITY, P", "TREAD, P"),
            ("6\n*DSLOAD", "6\nENDS, 2\n*DSLOAD"),
            ("NEW\n", "NEW\nENDS, 2\n"),
        ),
        plain,
    )
    yield (
        section(
            ("SFMGAX1", "MGAX1"),
            (
                "*SURFACE SECTION, ELSET=PLY\n",
                "*MEMBRANE SECTION, ELSET=PLY, MATERIAL=FILM\n1e-3\n",
            ),
            ("*STEP", "*MATERIAL, NAME=FILM\n*ELASTIC\n1e8, 0.3\n*DENSITY\n1e3\n*BOUNDARY\n{0}"),
            ("{0}", "HUB, 1, 6\n*STEP"),
            ("*BOUNDARY\nHUB, 1, 6\n*DSLOAD", "*DSLOAD"),
        ),
        REVOLVE,
        plain,
    )
    embedded = "*EMBEDDED ELEMENT, HOST ELSET=SOLID, ROUNDOFF TOLERANCE=1e-6, EXTERIOR TOLERANCE=0."
    yield (
        section(
            ("*NODE, NSET=HUB", "21, 0.29, -0.06\n22, 0.29, 0.\n23, 0.29, 0.06\n*NODE, NSET=HUB"),
            ("11, 5, 6\n12, 6, 7\n13, 7, 8", "11, 21, 22\n12, 22, 23"),
            ("*RIGID", f"{embedded}, ABSOLUTE EXTERIOR TOLERANCE=1e-4\nPLY\n*RIGID"),
        ),
        REVOLVE,
        plain,
    )
    turning = TURNING.format(axis=", 0., 0., 0., 0., 1., 0.")
    closed = (
        (
            "*RIGID",
            "*ELEMENT, TYPE=SFMGAX1, ELSET=WELL\n21, 4, 1\n*SURFACE SECTION, ELSET=WELL\n{0}",
        ),
        ("{0}", "*SURFACE, NAME=WELL, TYPE=ELEMENT\nWELL, SPOS\n*RIGID"),
        ("*STEP", "*MATERIAL, NAME=GAS\n*ACOUSTIC MEDIUM, BULK MODULUS\n4e5\n*DENSITY\n3.\n*STEP"),
    )
    free = edited(
        REVOLVE,
        ("*STEP", "*BOUNDARY\n900, 1, 6\n" + WHEEL + "*STEP"),
        ("*BOUNDARY\n900, 1, 6\n*DSLOAD", "*DSLOAD"),
        ("OP=NEW\n900, 1, 6", "OP=NEW\n900, 2\n900, 5"),
        ("SIM=NO\n8", "SIM=NO\n8, 1., , -100."),
    )
    pressed = ("CAVITY, P, 2e4\n", "CAVITY, P, 2e4\nWELL, P, 2e4\n")
    yield (
        section(*closed, pressed),
        edited(free, pressed),
        replace(plain, harmonics=[1], modes_per_harmonic=4),
    )
    yield (
        section(*closed),
        REVOLVE,
        replace(plain, cavity=CavityRequest("GAS", ["CAVITY", "WELL"])),
    )
    waves = edited(
        REVOLVE, ("CAVITY, P, 2e4\n", "CAVITY, P, 2e4\n" + turning), (", PERTURBATION", "")
    )
    inflated = section(("CAVITY, P, 2e4\n", "CAVITY, P, 2e4\n" + TURNING.format(axis="")))
    yield (
        section(),
        edited(
            REVOLVE, ("*STEP", ROAD + "*STEP"), ("*STEP, NAME=MODES", PRESSED + "*STEP, NAME=MODES")
        ),
        plain,
    )
    yield inflated, waves + WAVES, plain  # the slowest last


@cache
def decks() -> list[tuple[str, Pair, Request]]:
    """All pairs of jobs as blocks, each with its answer."""
    result = []
    for inflate, modes, request in pairs():
        deck = Deck({"inflate": inflate, "modes": modes}, "modes", "inflate")
        blocks: Pair = dict(deck._keywords)
        result.append((answer(blocks, request), blocks, request))
        assert not result[-1][0].startswith("refused"), result[-1][0]
    return result


def answer(blocks: Pair, request: Request) -> str:
    """Results of a pair in digits, or that it is refused."""
    deck = Deck({"inflate": "", "modes": ""}, "modes", "inflate")
    deck._keywords = {name: list(each) for name, each in blocks.items()}
    try:
        job = Job(deck, request)
        if job.road:
            steps = [(s.forces, s.held, s.long_term, s.procedure.rows) for s in job.steps]
            lines = [[row.line for row in each] for s in steps for each in s if each not in (0, 1)]
            return f"{job.road} {lines}"
        results = job.run()
    except (Refused, RunFailed) as error:
        return f"refused: {error}"
    return "\n".join(map(described, results))


def described(result: Any) -> str:
    """Mass, inflated shape and squares of frequencies, in digits."""
    squares = [f"{x:.9g}" for modes in result.modes for x in modes.eigenvalues]
    return f"{result.mass_kg:.9g} {[f'{u:.6g}' for u in result.U.ravel()]} {squares}"


def others(block: Block, option: str) -> Iterator[dict[str, str]]:
    """The parameters of a block without an option, then with its other words and values."""
    yield {key: value for key, value in block.parameters.items() if key != option}
    words = RULES[block.name].parameters[option]
    if option in LAW_CONSTANTS:  # a law's other words are other laws
        for law in LAW_CONSTANTS:
            yield {law if key == option else key: text for key, text in block.parameters.items()}
    for value in ["7", "ELSEWHERE"] if words.islower() else words.split("|"):
        if value != block.parameters[option]:
            yield {**block.parameters, option: value}


def admitted() -> list[tuple[str, str, str]]:
    """Place, keyword and option ("" for the keyword itself) of all that the solver honours, except
    what is listed as quiet and keywords for output."""
    honoured = []
    for name, rule in RULES.items():
        for places, options in rule.honoured.items() if not rule.is_output else ():
            names = [option.partition("=")[0] for option in options.split("; ") if option]
            loud = [option for option in names if option[0] != QUIET]
            for place in places.split("|") if loud or not names else ():
                honoured += [(place, name, each) for each in ("", *loud) if place in PLACES]
    return honoured


def places_of(blocks: Pair) -> Iterator[tuple[str, int, str]]:
    """Job, number and place of each block of a pair."""
    for job, own in blocks.items():
        inside = False
        for k, block in enumerate(own):
            inside = block.name == "STEP" or (inside and own[k - 1].name != "END STEP")
            yield job, k, "step" if inside else "revolve" if job == "modes" else "section"


@pytest.mark.parametrize(("place", "name", "option"), sorted(set(admitted())))
def test_what_is_admitted_changes_the_answer_or_is_refused(
    place: str, name: str, option: str
) -> None:
    seen = False
    for whole, blocks, request in decks():
        for job, k, here in places_of(blocks):
            block = blocks[job][k]
            if (block.name, here) != (name, place) or (option and option not in block.parameters):
                continue
            seen = True
            edits: list[list[Block]] = [[]]
            if option:
                edits = [[replace(block, parameters=each)] for each in others(block, option)]
            for new in edits:
                own = [*blocks[job][:k], *new, *blocks[job][k + 1 :]]
                if answer({**blocks, job: own}, request) != whole:
                    return
    assert seen, "no pair here has it"
    raise AssertionError("the answer is the same without it, and with all its other words")


def test_every_line_of_the_tables_begins_with_a_word_that_is_read() -> None:
    words = r"lines \d([-+]\d?)?|(if|names)( .+)?|needs|alone|instead"
    places = "|".join(PLACES_OF_BLOCKS)
    known = re.compile(rf"\*.+ \(.+\)|  ({words}|({places})(\|({places}))*):")
    text = re.sub(r"\n {4,}", " ", (MODEL_RULES + STEP_RULES + OTHER_KEYWORDS).strip())
    for line in re.split(r"\n+", text):
        assert known.match(line), line
    notes = {
        note for head in re.findall(r"^\*.+? \((.+?)\)", text, re.M) for note in head.split(", ")
    }
    others = [
        note for note in notes - NOTES if not re.match("(under|after|within|in CalculiX) ", note)
    ]
    levels = {word for note in others for word in note.split()}
    assert levels == {"model", "part", "step"}
