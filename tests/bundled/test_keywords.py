"""Reading decks: grammar, refusals that name their line, and what stands in the model."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tyrecal_solvers.bundled.deck import steps
from tyrecal_solvers.bundled.section import model
from tyrecal_solvers.language.text import (
    COMPLEX_STEP,
    WHOLE_DECK,
    DeckError,
    Place,
    read_deck,
    read_keywords,
    seed,
)

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
        keywords, _ = steps.check(read_keywords(text), False)
        model.build(keywords, None, True)
    return error.value


def changed(old: str, new: str) -> str:
    assert SQUARE.count(old) == 1
    return SQUARE.replace(old, new)


def test_blocks_lines_and_numbers() -> None:
    """Names and parameters ignore case and spaces, comments and blank lines vanish but count,
    D exponents and blank fields are numbers."""
    one, two = read_keywords("**x\n*node , nset = all\n\n 1, 2.5D-3 ,\n** y\n2,,1e-2\n*End  Step\n")
    assert (one.name, one.place.line, one.parameters) == ("NODE", 2, {"NSET": "all"})
    assert one.get("NSET") == "ALL"
    assert [r.place.line for r in one.rows] == [4, 6]
    assert one.rows[0].number(1) == 2.5e-3
    assert one.rows[0].number(2, 7.0) == 7.0
    assert one.rows[1].number(2) == 0.01
    assert two.name == "END STEP" and not two.rows


def test_a_refusal_names_the_file_and_the_line() -> None:
    """A refusal names file and line if they are known."""
    (node,) = read_keywords("*NODE\n1, x\n", "inflate")
    with pytest.raises(DeckError, match=r"^inflate\.inp, line 2: 'x' is not a number$"):
        node.rows[0].number(1)
    assert str(DeckError(Place("modes.inp", 0), "why")) == "modes.inp: why"
    assert str(DeckError(Place("deck", 3), "why")) == "deck, line 3: why"
    assert str(DeckError(WHOLE_DECK, "w")) == "deck: w"


def test_continuation_lines() -> None:
    """A keyword line that ends in a comma goes on in the next; its line is the first."""
    (element, _) = read_keywords("*ELEMENT, TYPE=CGAX4R,\n  ELSET=RUBBER\n1, 1\n*DENSITY\n")
    assert element.parameters == {"TYPE": "CGAX4R", "ELSET": "RUBBER"}
    assert element.place.line == 1 and element.rows[0].place.line == 3


def test_comment_inside_a_continued_keyword() -> None:
    """A comment between a keyword and its continuation is a comment still."""
    (element,) = read_keywords("*ELEMENT, TYPE=CGAX4R,\n** rubber\nELSET=RUBBER\n")
    assert element.parameters == {"TYPE": "CGAX4R", "ELSET": "RUBBER"}


def test_square_is_a_model() -> None:
    """The deck that the refusals below are made from is itself accepted: 0.5 (b^2 - a^2) L of
    volume per radian, times the density."""
    m = support.model_of(SQUARE)
    mass = 1100.0 * (0.3**2 - 0.2**2) / 2 * 0.1
    assert m.parts[0].mass.sum() == pytest.approx(mass, rel=1e-14)
    assert m.mesh.faces["CAVITY"].connectivity.tolist() == [[3, 0]]


def test_hourglass_stiffness_is_of_the_section_above_it() -> None:
    """G = 2 C10: 0.005 G where none is given, else the number under the section."""
    default = support.model_of(SQUARE).parts[1].law.stiffness
    given = changed("MATERIAL=GUM\n", "MATERIAL=GUM\n*HOURGLASS STIFFNESS\n3E4\n")
    assert default == pytest.approx([0.005 * 2e6])
    assert support.model_of(given).parts[1].law.stiffness == pytest.approx([3e4])


@pytest.mark.parametrize(
    ("old", "new", "line", "words"),
    [
        ("*DENSITY\n", "*HOURGLASS STIFFNESS\n3E4\n*DENSITY\n", 17, "directly under its *SOLID"),
        ("*DENSITY", "*CONDUCTIVITY", 17, "CONDUCTIVITY"),
        ("*NODE, NSET=ALL", "*NODE, NSET=ALL, SYSTEM=C", 4, "SYSTEM"),
        ("TYPE=CGAX4R", "TYPE=CGAX5R", 9, "CGAX5R"),
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
        ("1E6, 0., 5.085D-8", "1E6, 0., -1.", 16, "D must not be negative"),
        ("1E6, 0., 5.085D-8", "-1E6, 0., 5.085D-8", 16, "positive"),
        ("1100.", "-1100.", 17, "density"),
        ("*HEADING\n", "1, 2\n*HEADING\n", 1, "before the first keyword"),
        ("*MATERIAL, NAME=GUM", "*MATERIAL, NAME=GUM, NAME=GLUE", 14, "twice"),
        ("1100.\n", "1100.\n*STEP\n*STATIC\n", 19, "END STEP"),
        ("1100.\n", "1100.\n*NSET, NSET=A,\n", 19, "comma"),
        ("1100.\n", "1100.\n*STEP, NLGEOM=YES\n*STEP\n", 20, "inside a step"),
        ("1100.\n", "1100.\n*STEP\n*STATIC\n*END STEP\n*NSET, NSET=A\n1\n", 22, "after a step"),
        ("*SURFACE", "*NSET, NSET=A\n1, B\n*SURFACE", 12, "set B is not defined"),
        ("*SURFACE", "*NSET, NSET=A\n1, 9\n*SURFACE", 11, "member 9 of the set"),
        ("*SURFACE", "*ELSET, ELSET=A, GENERATE\n2, 9\n*SURFACE", 12, "is from 2 to 9"),
        ("RUBBER, S4", "RUBBER, SPOS", 12, "of type CGAX4R has no face SPOS"),
        ("ELSET=RUBBER, MATERIAL=GUM", "MATERIAL=GUM", 13, "*SOLID SECTION: needs ELSET="),
        ("MATERIAL=GUM\n", "MATERIAL=GUM, CONTROLS=C\n", 13, "section controls C are not"),
        ("*SOLID SECTION, ELSET=RUBBER, MATERIAL=GUM\n", "", 0, "CGAX4R elements have no *SOLID"),
        (
            "*SURFACE",
            "*ELEMENT, TYPE=SFMGAX1, ELSET=RUBBER\n2, 1, 4\n*SURFACE",
            14,
            "element 2 of type SFMGAX1 has no face S4",
        ),
        ("*SURFACE", "*ELEMENT, TYPE=CGAX4R\n2, 1, 2, 3, 4\n*SURFACE", 0, "1 CGAX4R elements have"),
        (
            "*HYPERELASTIC, MOONEY-RIVLIN\n1E6, 0., 5.085D-8\n",
            "",
            13,
            "material GUM of a solid is neither *HYPERELASTIC nor *ELASTIC",
        ),
        (
            "*HYPERELASTIC, MOONEY-RIVLIN\n1E6, 0., 5.085D-8\n",
            "*ELASTIC\n1E6, 0.3\n*NO COMPRESSION\n",
            14,
            "*NO COMPRESSION of material GUM is honoured of cords only",
        ),
        ("*MATERIAL, NAME=GUM\n", "", 14, "*HYPERELASTIC must follow a *MATERIAL"),
        ("1100.\n", "1100.\n*MATERIAL, NAME=GUM\n", 19, "material GUM is defined twice"),
        ("MOONEY-RIVLIN\n", "MOONEY-RIVLIN, MODULI=FAST\n", 15, "MODULI=FAST is not honoured"),
        ("5.085D-8\n", "5.085D-8\n1E6, 0., 1.\n", 15, "takes one data line, got 2"),
        ("1E6, 0., 5.085D-8", "1E6", 13, "incompressible"),
        ("1100.\n", "1100.\n*VISCOELASTIC, TIME=PRONY\n-0.1, 0., 0.1\n", 19, "not be negative"),
        ("1100.\n", "1100.\n*VISCOELASTIC, TIME=PRONY\n1., 0., 0.1\n", 19, "must stay below 1"),
        ("1100.\n", "1100.\n*VISCOELASTIC, TIME=PRONY\n0., 1., 0.1\n", 19, "must stay below 1"),
    ],
)
def test_refusals_name_the_line(old: str, new: str, line: int, words: str) -> None:
    """Keywords that are not honoured and texts that are no deck are refused, with the 1-based line
    and the word."""
    error = refused(changed(old, new))
    assert error.place.line == line
    assert words in str(error)
    assert f"line {line}:" in str(error) or not line


@pytest.mark.parametrize("given", ["LONG TERM", "INSTANTANEOUS"])
def test_a_static_step_has_relaxed_or_sudden_moduli(given: str) -> None:
    """1 - sum g of the shear moduli, 1 - sum k of the bulk modulus, of those that a deck gives."""
    deck = changed("MOONEY-RIVLIN\n", f"MOONEY-RIVLIN, MODULI={given}\n").replace(
        "0., 5.", "2E5, 5."
    )
    deck += "*VISCOELASTIC, TIME=PRONY\n0.3, 0.2, 0.1\n0.1, 0., 1.\n"
    for long_term in (True, False):
        gum, control = model.build(read_keywords(deck), None, long_term).parts
        law = gum.law
        share = (0.6, 0.8) if long_term and given == "INSTANTANEOUS" else (1.0, 1.0)
        share = (1 / 0.6, 1 / 0.8) if not long_term and given == "LONG TERM" else share
        assert pytest.approx(1e6 * share[0]) == law.C10 and pytest.approx(2e5 * share[0]) == law.C01
        assert law.inverse_D1 == pytest.approx(share[1] / 5.085e-8)
        assert control.law.stiffness == pytest.approx(0.005 * 2 * 1.2e6 * share[0])


def test_neo_hookes_law_is_mooney_and_rivlins_without_its_second_part() -> None:
    def law(deck: str) -> Any:
        return model.build(read_keywords(deck), None, True).parts[0].law

    whole = law(changed("MOONEY-RIVLIN\n", "MOONEY-RIVLIN\n"))
    neo = law(changed("MOONEY-RIVLIN\n", "NEO HOOKE\n").replace("0., 5.", "5."))
    assert (neo.C10, neo.C01, neo.inverse_D1) == (whole.C10, 0.0, whole.inverse_D1)


LAYER = """*ELEMENT, TYPE=SFMGAX1, ELSET=PLY
2, 1, 4
*SURFACE SECTION, ELSET=PLY
*REBAR LAYER
PLY, 4E-7, 1E-3, 0.0, CORD, 90.0
*MATERIAL, NAME=CORD
*ELASTIC
1E9, 0.3
"""


def test_a_layer_is_smeared() -> None:
    """E A / spacing along a ring of cords, N/m; without *DENSITY no mass."""
    *_, cords = support.model_of(SQUARE + LAYER).parts
    assert cords.law.stiffness == pytest.approx(1e9 * 4e-7 / 1e-3, rel=1e-14)
    assert (cords.mass == 0.0).all()


def test_cords_may_bear_no_compression() -> None:
    for more, wanted in (("", 1.0), ("*NO COMPRESSION\n", 0.0)):
        *_, cords = support.model_of(SQUARE + LAYER + more).parts
        assert (cords.law.compressed == wanted).all()


def test_a_layer_fans_out_with_the_radius() -> None:
    """GEOMETRY=ANGULAR: the spacing in degrees, a share of the circumference."""
    text = SQUARE + LAYER.replace("REBAR LAYER", "REBAR LAYER, GEOMETRY=ANGULAR")
    heavy = text.replace("1E9, 0.3\n", "1E9, 0.3\n*DENSITY\n1500.\n").replace("2, 1, 4", "2, 1, 2")
    *_, cords = support.model_of(heavy).parts
    R = 0.25 + np.array([-0.05, 0.05]) / np.sqrt(3)
    wanted = 1e9 * 4e-7 / (1e-3 * np.pi / 180 * R)
    np.testing.assert_allclose(cords.law.stiffness, wanted, rtol=1e-12)
    per_degree = 1500.0 * 4e-7 * 0.1  # kg a cord
    assert cords.mass.sum() == pytest.approx(per_degree / (1e-3 * np.pi / 180))


@pytest.mark.parametrize(
    ("old", "new", "line", "words"),
    [
        ("1E-3, 0.0", "1E-3, 0.1", 23, "position of a layer in a surface element is 0.0"),
        ("4E-7", "0.0", 23, "area and spacing of a layer must be positive"),
        ("1E-3", "-1E-3", 23, "area and spacing of a layer must be positive"),
        ("*ELASTIC", "*NO COMPRESSION\n*ELASTIC", 25, "*NO COMPRESSION must follow an *ELASTIC"),
        ("0.3\n", "0.3\n*NO COMPRESSION\n1.\n", 28, "takes no data lines"),
        ("CORD, 90.0", "GUM, 90.0", 23, "material GUM of a rebar layer is not *ELASTIC"),
        ("CORD, 90.0", "GLUE, 90.0", 22, "material GLUE is not defined"),
        ("0.3\n", "0.3\n*VISCOELASTIC, TIME=PRONY\n.1, 0., 1.\n", 23, "cords do not relax"),
        ("*SURFACE SECTION, ELSET=PLY\n", "", 21, "*REBAR LAYER must follow a *SURFACE SECTION"),
        ("SECTION, ELSET=PLY", "SECTION, ELSET=BELT", 21, "element set BELT is not defined"),
        ("SECTION, ELSET=PLY", "SECTION, ELSET=RUBBER", 21, "of type CGAX4R cannot have *SURFACE"),
        ("1E9", "-1E9", 25, "Young's modulus"),
        ("0.3\n", "0.3\n*HYPERELASTIC, NEO HOOKE\n1., .1\n", 24, "CORD has two laws"),
    ],
)
def test_layers_that_are_refused(old: str, new: str, line: int, words: str) -> None:
    assert LAYER.count(old) == 1
    error = refused(SQUARE + LAYER.replace(old, new))
    assert words in str(error)
    assert error.place.line == line


def test_sets_are_numbers_ranges_and_other_sets() -> None:
    """Blank fields say nothing; a range has its last member, and a stride."""
    sets = "*NSET, NSET=A\n1, , 3\n*NSET, NSET=B\n4, a\n*NSET, NSET=ODD, GENERATE\n1, 3, 2\n"
    sets += "*NSET, NSET=ROW, GENERATE\n2, 4\n*ELSET, ELSET=TWICE\nRUBBER, 1\n"
    mesh = support.model_of(changed("*SURFACE", sets + "*SURFACE")).mesh
    assert (mesh.node_sets["A"], mesh.node_sets["B"]) == ([1, 3], [4, 1, 3])
    assert (mesh.node_sets["ODD"], mesh.node_sets["ROW"]) == ([1, 3], [2, 3, 4])
    assert set(mesh.node_sets) == {"ALL", "A", "B", "ODD", "ROW"}
    assert set(mesh.element_sets) == {"RUBBER", "TWICE"}
    plain = support.model_of(SQUARE.replace("*NODE, NSET=ALL", "*NODE")).mesh
    assert not plain.node_sets and set(plain.element_sets) == {"RUBBER"}
    assert mesh.element_sets["TWICE"] == [1, 1] and mesh.node_sets["ALL"] == [1, 2, 3, 4]


DATA = {  # keyword: where it stands, and a line of all data that are honoured
    "DENSITY": ("section", "1100."),
    "ELASTIC": ("section", "1E9, 0.3"),
    "ACOUSTIC MEDIUM": ("section", "4.8E5"),
    "VISCOELASTIC, FREQUENCY=TABULAR": ("section", "0.1, 0.1, 0.1, 0.1, 20."),
    "VISCOELASTIC, TIME=PRONY": ("section", "0.1, 0.1, 0.1"),
    "HOURGLASS STIFFNESS": ("section", "1."),
    "REBAR LAYER": ("section", "PLY, 4E-7, 1E-3, 0., CORD, 90."),
    "SPRING": ("revolve", "1E6"),
    "MASS": ("revolve", "15."),
    "ROTARY INERTIA": ("revolve", "0.3, 0.4, 0.3"),
    "SURFACE BEHAVIOR": ("revolve", "1E9"),
    "FRICTION": ("revolve", "0.5"),
    "CONTACT PAIR": ("revolve", "TREAD, ROAD"),
    "BOUNDARY": ("step", "RIM, 1, 6, 0."),
    "DSLOAD": ("step", "CAVITY, P, 240E3"),
    "DLOAD": ("step", "ALL, CENTRIF, 1., 0., 0., 0., 0., 1., 0."),
    "CLOAD": ("step", "9, 1, -4000."),
    "STATIC": ("step", "0.1, 1., 1E-5, 1."),
    "FREQUENCY": ("step", "20, 1., 200., -10."),
    "COMPLEX FREQUENCY": ("step", "20"),
}


@pytest.mark.parametrize("name", DATA)
def test_a_datum_that_is_not_honoured_is_refused(name: str) -> None:
    """ABAQUS would heed one more on the line: temperature, amplitude, a limit. A blank is none."""
    where, data = DATA[name]

    def check(line: str) -> None:
        text = f"*{name}\n{line}\n"
        if where == "step":
            text = f"*STEP, NLGEOM=YES\n{text}*END STEP\n"
        steps.check(read_keywords(text), where != "section")

    check(data)
    check(f"{data}, ,")
    with pytest.raises(DeckError, match=r"data '7.' is not honoured"):
        check(f"{data}, 7.")


@pytest.mark.parametrize("nodes", ["1, 4, 3, 2", "1, 3, 2, 4"])
def test_clockwise_or_crossed_element(nodes: str) -> None:
    """An element whose nodes run clockwise or cross over is refused by its number."""
    error = refused(changed("1, 1, 2, 3, 4", f"1, {nodes}"))
    assert "element 1 has no positive area" in str(error)


def test_seed_turns_a_number_complex() -> None:
    """number = value + i STEP tangent at (line, field), elsewhere real; the deck is unchanged."""
    deck = read_keywords(SQUARE)
    marked = seed(deck, [(18, 0, 3.0), (5, 1, 2.0)])
    numbers = {r.place.line: r.value(0) for k in marked if k.name == "DENSITY" for r in k.rows}
    assert numbers == {18: complex(1100.0, 3.0 * COMPLEX_STEP)}
    node = next(k for k in marked if k.name == "NODE").rows
    assert node[0].value(1) == complex(0.2, 2 * COMPLEX_STEP) and isinstance(
        node[1].value(1), float
    )
    assert not any(row.tangents for k in deck for row in k.rows)
    # the other blocks are the same, with what is remembered with them
    assert [a is b for a, b in zip(deck, marked, strict=True)].count(False) == 2
    m = model.build(marked, None, True)
    assert np.iscomplexobj(m.parts[0].mass) and np.iscomplexobj(m.mesh.X)


@pytest.mark.parametrize("line", [1, 99])
def test_seed_refuses_a_line_without_data(line: int) -> None:
    """A sensitivity by a line that holds no data is refused with that line."""
    with pytest.raises(DeckError) as error:
        seed(read_keywords(SQUARE), [(line, 0, 1.0)])
    assert error.value.place.line == line


def test_a_deck_may_have_letters_of_latin_1_and_any_line_ends(tmp_path: Path) -> None:
    path = tmp_path / "inflate.inp"
    path.write_bytes("*HEADING\r\nGröße\r*NODE\n".encode("latin-1"))
    assert read_deck(path) == "*HEADING\nGröße\n*NODE\n"
