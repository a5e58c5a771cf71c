"""Reading decks: grammar, refusals that name their line, and what stands in the model."""

from __future__ import annotations

import numpy as np
import pytest
from tyrecal_solvers.bundled import grammar, model
from tyrecal_solvers.bundled.keywords import STEP, DeckError, read_keywords, seed

from . import support

SQUARE = """*HEADING
two elements side by side
** a comment
*NODE, NSET=ALL
1, 0.2, 0.0
2, 0.3, 0.0
3, 0.3, 0.1
4, 0.2, 0.1
*ELEMENT, TYPE=CGAX4R, ELSET=RUBBER
1, 1, 2, 3, 4
*SURFACE, NAME=CAVITY
RUBBER, S4
*SOLID SECTION, ELSET=RUBBER, MATERIAL=GUM
*MATERIAL, NAME=GUM
*HYPERELASTIC, MOONEY-RIVLIN
1E6, 0., 5.085D-8
*DENSITY
1100.
"""


def refused(text: str) -> DeckError:
    with pytest.raises(DeckError) as error:
        keywords, _ = grammar.check(read_keywords(text), False)
        model.build(keywords, None, True)
    return error.value


def changed(old: str, new: str) -> str:
    assert SQUARE.count(old) == 1
    return SQUARE.replace(old, new)


def test_blocks_lines_and_numbers() -> None:
    """Names and parameters ignore case and spaces, comments and blank lines vanish but count,
    D exponents and blank fields are numbers."""
    one, two = read_keywords("**x\n*node , nset = all\n\n 1, 2.5D-3 ,\n** y\n2,,1e-2\n*End  Step\n")
    assert (one.name, one.line, one.parameters) == ("NODE", 2, {"NSET": "all"})
    assert one.get("NSET") == "ALL"
    assert [r.line for r in one.rows] == [4, 6]
    assert one.rows[0].number(1) == 2.5e-3
    assert one.rows[0].number(2, 7.0) == 7.0
    assert one.rows[1].number(2) == 0.01
    assert two.name == "END STEP" and two.rows == []


def test_continuation_lines() -> None:
    """A keyword line that ends in a comma goes on in the next; its line is the first."""
    (element, _) = read_keywords("*ELEMENT, TYPE=CGAX4R,\n  ELSET=RUBBER\n1, 1\n*DENSITY\n")
    assert element.parameters == {"TYPE": "CGAX4R", "ELSET": "RUBBER"}
    assert element.line == 1 and element.rows[0].line == 3


def test_comment_inside_a_continued_keyword() -> None:
    """A comment between a keyword and its continuation is a comment still."""
    (element,) = read_keywords("*ELEMENT, TYPE=CGAX4R,\n** rubber\nELSET=RUBBER\n")
    assert element.parameters == {"TYPE": "CGAX4R", "ELSET": "RUBBER"}


def test_square_is_a_model() -> None:
    """The deck that the refusals below are made from is itself accepted: 0.5 (b^2 - a^2) L of
    volume per radian, times the density."""
    m = support.model_of(SQUARE)
    mass = 1100.0 * (0.3**2 - 0.2**2) / 2 * 0.1
    r = m.rubbers[0]
    assert (r.solids.mass_weights.sum(1) * r.density).sum() == pytest.approx(mass, rel=1e-14)
    assert m.mesh.faces["CAVITY"].connectivity.tolist() == [[3, 0]]


@pytest.mark.parametrize(
    ("old", "new", "line", "words"),
    [
        ("*DENSITY", "*DAMPING", 17, "DAMPING"),
        ("*NODE, NSET=ALL", "*NODE, NSET=ALL, SYSTEM=C", 4, "SYSTEM"),
        ("TYPE=CGAX4R", "TYPE=CGAX4H", 9, "CGAX4H"),
        ("4, 0.2, 0.1", "3, 0.2, 0.1", 8, "node 3 is defined twice"),
        ("3, 0.3, 0.1", "3, nan, 0.1", 7, "finite"),
        ("3, 0.3, 0.1", "3, inf, 0.1", 7, "finite"),
        ("3, 0.3, 0.1", "3, 0.3x, 0.1", 7, "0.3x"),
        ("3, 0.3, 0.1", "3.5, 0.3, 0.1", 7, "whole"),
        ("1, 1, 2, 3, 4", "1, 1, 2, 3, 9", 10, "node 9"),
        ("1, 1, 2, 3, 4", "1, 1, 2, 3", 10, ""),
        ("1, 1, 2, 3, 4", "1, 1, 2, 3, 4, 4", 10, "4 nodes"),
        ("1, 1, 2, 3, 4", "1, 1, 2, 3, 4\n1, 1, 2, 3, 4", 11, "element 1 is defined twice"),
        ("RUBBER, S4", "RUBBER, S5", 12, "S5"),
        ("RUBBER, S4", "CARCASS, S4", 12, "CARCASS"),
        ("MATERIAL=GUM", "MATERIAL=GLUE", 13, "GLUE"),
        ("1E6, 0., 5.085D-8", "1E6, 0., 0.", 16, "D1"),
        ("1E6, 0., 5.085D-8", "-1E6, 0., 5.085D-8", 16, "positive"),
        ("1100.", "-1100.", 17, "density"),
        ("*HEADING\n", "1, 2\n*HEADING\n", 1, "before the first keyword"),
        ("*MATERIAL, NAME=GUM", "*MATERIAL, NAME=GUM, NAME=GLUE", 14, "twice"),
        ("1100.\n", "1100.\n*STEP\n*STATIC\n", 19, "END STEP"),
        ("1100.\n", "1100.\n*NSET, NSET=A,\n", 19, "comma"),
    ],
)
def test_refusals_name_the_line(old: str, new: str, line: int, words: str) -> None:
    """What is not honoured or not a deck is refused, with its 1-based line and the word."""
    error = refused(changed(old, new))
    assert error.line == line
    assert words in str(error)
    assert f"line {line}" in str(error)


@pytest.mark.parametrize("nodes", ["1, 4, 3, 2", "1, 3, 2, 4"])
def test_clockwise_or_crossed_element(nodes: str) -> None:
    """An element whose nodes run clockwise or cross over is refused by its number."""
    error = refused(changed("1, 1, 2, 3, 4", f"1, {nodes}"))
    assert "element 1 has no positive area" in str(error)


def test_seed_turns_a_number_complex() -> None:
    """number = value + i STEP tangent at (line, field), elsewhere real; the deck is unchanged."""
    deck = read_keywords(SQUARE)
    marked = seed(deck, [(18, 0, 3.0), (5, 1, 2.0)])
    numbers = {r.line: r.number(0) for k in marked if k.name == "DENSITY" for r in k.rows}
    assert numbers == {18: complex(1100.0, 3.0 * STEP)}
    node = next(k for k in marked if k.name == "NODE").rows
    assert node[0].number(1) == complex(0.2, 2 * STEP) and isinstance(node[1].number(1), float)
    assert all(not k.tangents for k in deck)
    m = model.build(marked, None, True)
    assert np.iscomplexobj(m.rubbers[0].density) and np.iscomplexobj(m.mesh.X)


@pytest.mark.parametrize("line", [1, 99])
def test_seed_refuses_a_line_without_data(line: int) -> None:
    """A sensitivity by a line that holds no data is refused with that line."""
    with pytest.raises(DeckError) as error:
        seed(read_keywords(SQUARE), [(line, 0, 1.0)])
    assert error.value.line == line
