"""Places that ABAQUS' manual requires for keywords: kept by decks of every kind, and by the bundled
solver, which refuses them elsewhere.

Keywords of our decks against ABAQUS' manual, and mutants of them.
"""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from tyrecal_solvers.abaqus.check import findings
from tyrecal_solvers.bundled.job import run
from tyrecal_solvers.language.table import RULES
from tyrecal_solvers.language.text import Block, DeckError, read_keywords

from tyrecal.simulate.deck.decks import Decks
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.tyre.load import load_case
from tyrecal.tyre.values import with_values

from ..conftest import CASES, ROOT
from ..effects.support import CASE as COARSE
from ..effects.support import frequencies
from . import abaqus_decks, abaqus_mutants

CASE = load_case(CASES / "p235_75r17.yaml")
FOUR_NODES = replace(  # of a kind that needs hourglass control
    CASE,
    case=CASE.case.model_copy(
        update={"mesh": CASE.case.mesh.model_copy(update={"element": "CGAX4R"})}
    ),
)
HOURGLASS = {"mesh.hourglass_stiffness_Pa": 3e4}
VALUES: dict[str, dict[str, float]] = {
    "plain": {},
    "at a frequency": {"analysis.vibration_frequency_Hz": 60.0},
    "turning": {"effects.rotation": 12.0},
    "turning, at a frequency": {"effects.rotation": 12.0, "analysis.vibration_frequency_Hz": 60.0},
    "hourglass control": HOURGLASS,
    "splice, hourglass control": {"effects.stiffness_splice": 0.2, **HOURGLASS},
    "rim on springs, mass on the tread": {
        "effects.spindle_lateral": 1e-7,
        "effects.point_mass": 0.02,
    },
}
LOADS: dict[str, dict[str, Any]] = {
    "modes": {},
    "a load": {"loads_N": (500.0,)},
    "loads": {"loads_N": (500.0, 1000.0, 1500.0)},
    "loads with modes": {"loads_N": (500.0, 1000.0), "loaded_modes": 12, "rim_stiffness": True},
}


def jobs(values: str, loads: str) -> dict[str, list[Block]]:
    case = FOUR_NODES if "hourglass" in values else CASE
    texts = Decks(TyreDesign(with_values(case, VALUES[values])), **LOADS[loads]).texts("abaqus")
    return {name: read_keywords(text, name) for name, text in texts.items()}


@pytest.mark.parametrize(  # a tyre with a splice cannot be pressed
    ("values", "loads"),
    [(v, loads) for v in VALUES for loads in LOADS if "splice" not in v or loads == "modes"],
)
def test_keywords_stand_where_the_manual_wants_them(values: str, loads: str) -> None:
    """`*FILE FORMAT` once in a job and before all that is written; the same PROPERTY EVALUATION in
    every step of modes; `*HOURGLASS STIFFNESS` right under each section that it is of."""
    for name, keywords in jobs(values, loads).items():
        names = [k.name for k in keywords]
        written = [i for i, n in enumerate(names) if n.endswith(" FILE")]
        formats = [i for i, n in enumerate(names) if n == "FILE FORMAT"]
        assert len(formats) == (1 if written else 0), name
        assert not written or formats[0] < written[0]
        modes = [k for k in keywords if k.name in ("FREQUENCY", "COMPLEX FREQUENCY")]
        wanted = "60" if "frequency" in values else ""
        assert {k.get("PROPERTY EVALUATION") for k in modes} <= {wanted}
        sections = [i for i, n in enumerate(names) if n == "SOLID SECTION"]
        below = [i + 1 for i in sections] if "hourglass" in values else []
        assert [i for i, n in enumerate(names) if n == "HOURGLASS STIFFNESS"] == below


@pytest.mark.slow
def test_a_turning_tyre_is_as_stiff_as_the_frequency_says() -> None:
    """A tyre at almost no speed has the frequencies of the tyre at rest, with rubber at the same
    frequency and not at its static modulus."""
    stiff = with_values(COARSE, {"analysis.vibration_frequency_Hz": 60.0})
    rest, slow = frequencies(stiff), frequencies(stiff, rotation=1e-3)
    assert rest.keys() == slow.keys()
    for label, hertz in rest.items():
        assert slow[label] == pytest.approx(hertz, rel=1e-4)
    assert max(rest[k] / f for k, f in frequencies(COARSE).items()) > 1.02  # the modulus matters


@pytest.mark.parametrize(
    ("job", "old", "new", "words"),
    [
        (
            "modes",
            "*MODAL FILE\n",
            "*FILE FORMAT, ASCII\n*MODAL FILE\n",
            r"modes.inp, line \d+: \*FILE FORMAT: may be given once in a job",
        ),
        (
            "inflate",
            "HOURGLASS=STIFFNESS\n",
            "HOURGLASS=STIFFNESS\n*HOURGLASS STIFFNESS\n3e4\n",
            r"inflate.inp, line \d+: \*HOURGLASS STIFFNESS must be directly under its \*SOLID SEC",
        ),
    ],
)
def test_the_bundled_solver_refuses_them_elsewhere(
    tmp_path: Path, job: str, old: str, new: str, words: str
) -> None:
    for name, text in Decks(TyreDesign(FOUR_NODES)).texts("abaqus").items():
        if name == f"{job}.inp":
            assert text.count(old) == 1
            text = text.replace(old, new)
        (tmp_path / name).write_text(text)
    with pytest.raises(DeckError, match=words):
        run(tmp_path, "modes", "inflate")


def said(keywords: list[Block], before: list[Block]) -> list[str]:
    """Findings in words."""
    return [f"*{finding.block.name} {finding.words}" for finding in findings(keywords, before)]


@pytest.mark.slow
def test_every_deck_of_every_combination_of_options() -> None:
    """The grammar accepts each section deck, and the jobs that continue one with all the names
    they use."""
    count = 0
    for text in abaqus_decks.inflations():
        assert not said(read_keywords(text), []), text
        count += 1
    first = read_keywords(text)
    for text in (*abaqus_decks.modes(), *abaqus_decks.presses()):
        assert not said(read_keywords(text), first), text
        count += 1
    assert count == 384 + 192 + 32


def test_the_grammar_has_every_keyword_and_option_of_the_templates() -> None:
    """Keywords and options are taken from the templates' texts, whatever their conditions."""
    for path in (ROOT / "templates" / "abaqus").glob("*.j2"):
        text = re.sub(r"\{%.*?%\}", "", path.read_text(encoding="utf-8"), flags=re.DOTALL)
        for name, rest in re.findall(r"^\*([A-Z][A-Z ]+)(.*)$", text, re.MULTILINE):
            assert name in RULES, path
            for option in re.findall(r", ([A-Z][A-Z\- ]*)", rest):
                assert option in RULES[name].parameters, f"{path}: *{name}, {option}"


def test_what_the_grammar_does_not_know_is_a_doubt() -> None:
    """An unknown keyword and the options after it are not refused, because ABAQUS has more
    keywords."""
    text = next(abaqus_decks.inflations())
    for old, new in (("*DENSITY", "*PLASTIC\n1.0E6, 0.0\n*DENSITY"), ("*STATIC", "*DYNAMITE")):
        faults = findings(read_keywords(text.replace(old, new, 1)))
        assert faults and not any(each.sure for each in faults)


def test_mutants_of_our_decks_are_caught(request: pytest.FixtureRequest) -> None:
    """The grammar catches all of them."""
    mutants = abaqus_mutants.draw(60, request.config.getoption("--seed"))
    assert not [(kind, lines) for kind, caught, lines in mutants if not caught]
