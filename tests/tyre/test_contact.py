"""A rim that is a rigid surface: the lines that a refusal prints hold the bead, and it passes."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tyrecal.cli.main import main
from tyrecal.simulate.deck.own import asked_by_abaqus
from tyrecal.tyre.own_deck.own_deck import read_own_deck
from tyrecal.tyre.own_deck.summary import contents, words
from tyrecal.tyre.own_deck.text import OwnDeckError

from . import own_decks
from .own_decks import COLUMNS, ROWS, Tyre, block, number, plain

HEEL = number(ROWS, COLUMNS), number(0, COLUMNS)  # ends of the section at +z, outer and inner
PAIRS = """*CONTACT PAIR, INTERACTION=GRIP, HCRIT=1.0e-3
BEAD_L, RIM_L
BEAD_R, RIM_R
*SURFACE INTERACTION, NAME=GRIP
*SURFACE BEHAVIOR, AUGMENTED LAGRANGE
 , 0.0, 1.0
*FRICTION
 0.015
"""
MOUNT = """*AMPLITUDE, NAME=SLOW
0., 0., 1., 1.
*STEP, NAME=MOUNT, NLGEOM=YES
*STATIC, STABILIZE
*BOUNDARY, AMPLITUDE=SLOW
 LEFT, 2, 2, -0.1
 RIGHT, 2, 2, 0.1
*BOUNDARY
 LEFT, 1
 RIGHT, 1
 LEFT, 5, 6
 RIGHT, 5, 6
*END STEP
"""
EMPTY = "*SURFACE, NAME=NONE, TYPE=NODE\n"
STEP = own_decks.STEP.replace("*BOUNDARY\n900001, 1, 6\n", "*CONTACT CONTROLS, STABILIZE\n")


def flange(side: int, shift: float, name: str) -> str:
    """A rim's half as a surface of segments: an arc, then a line along the end of the section."""
    tyre = Tyre()
    (r_out, z_out), (r_in, z_in) = (tyre.nodes[n] for n in HEEL)
    far = 2 * r_out - r_in, 2 * z_out - z_in  # further along the line, where the arc ends
    arc = ("CIRCL", *far, far[0] + 0.01, far[1])
    near = 2 * r_in - r_out, 2 * z_in - z_out
    points = [("START", far[0] + 0.01, far[1] + 0.01), arc, ("LINE", *near)]
    rows: list[own_decks.Row] = []
    for kind, *numbers in points:
        pairs = zip(numbers[::2], numbers[1::2], strict=True)
        rows.append((kind, *(f"{x:.9f}" for r, z in pairs for x in (r, side * (z + shift)))))
    if side < 0:  # the tyre on the left there, too
        ends = [row[1:3] for row in rows]
        rows = [("START", *ends[2]), ("LINE", *ends[1]), ("CIRCL", *ends[0], *rows[1][3:])]
    return block(f"*SURFACE, TYPE=SEGMENT, NAME={name}", rows)


def rims() -> str:
    """Both halves 0.1 away from where they are mounted, the surfaces that touch them, the pairs."""
    tyre = Tyre()
    sides = {s: [n for n in tyre.rim if s * tyre.nodes[n][1] > 0] for s in (1, -1)}
    text = "*NODE, NSET=LEFT\n800001, 0., 0.\n*NODE, NSET=RIGHT\n800002, 0., 0.\n"
    for side, letter, name in ((1, "L", "LEFT"), (-1, "R", "RIGHT")):
        text += block(f"*NSET, NSET=BEAD_{letter}", [(n,) for n in sides[side]])
        text += f"*SURFACE, TYPE=NODE, NAME=BEAD_{letter}\nBEAD_{letter}\n"
        text += flange(side, 0.1, f"RIM_{letter}")
        text += f"*RIGID BODY, ANALYTICAL SURFACE=RIM_{letter}, REF NODE={name}\n"
    return text


def bare_mesh() -> str:
    return Tyre().mesh().replace("*RIGID BODY, REF NODE=900001, TIE NSET=RIM\n", "")


def in_contact(pairs: str = PAIRS, more: str = "", step: str = STEP) -> str:
    return plain(bare_mesh() + rims() + more + pairs, step=MOUNT + step)


def of_elements() -> str:
    """The same rims of RAX2 elements; what touches them are faces of elements."""
    text = in_contact()
    for side, letter, first in ((1, "L", 810001), (-1, "R", 820001)):
        tyre = Tyre()
        (r_out, z_out), (r_in, z_in) = (tyre.nodes[n] for n in HEEL)
        nodes = [(first, r_out, side * (z_out + 0.1)), (first + 1, r_in, side * (z_in + 0.1))]
        own = block("*NODE", [(n, repr(r), repr(z)) for n, r, z in nodes])
        own += f"*ELEMENT, TYPE=RAX2, ELSET=RING_{letter}\n{first}, {first}, {first + 1}\n"
        own += f"*SURFACE, NAME=RIM_{letter}\nRING_{letter}, {'SPOS' if side > 0 else 'SNEG'}\n"
        text = text.replace(flange(side, 0.1, f"RIM_{letter}"), own)
        text = text.replace(f"ANALYTICAL SURFACE=RIM_{letter}", f"ELSET=RING_{letter}")
        chafer = "12, 112" if side > 0 else "1, 101"
        text = text.replace(
            f"*SURFACE, TYPE=NODE, NAME=BEAD_{letter}\nBEAD_{letter}\n",
            f"*ELSET, ELSET=CHAFER_{letter}\n{chafer}\n"
            f"*SURFACE, NAME=BEAD_{letter}\nCHAFER_{letter}\n",
        )
    return text


def of_instances() -> str:
    """The tyre and both halves of the rim as ABAQUS/CAE writes them: rims have no *PART content."""
    tyre = bare_mesh().replace("*NODE\n900001, 0.0, 0.0\n", "")
    for side, letter in ((1, "L"), (-1, "R")):
        beads = [n for n in Tyre().rim if side * Tyre().nodes[n][1] > 0]
        tyre += block(f"*NSET, NSET=BEAD_{letter}", [(n,) for n in beads])
        tyre += f"*SURFACE, TYPE=NODE, NAME=BEAD_{letter}\nBEAD_{letter}\n"
    parts = f"*PART, NAME=TYRE\n{tyre}{own_decks.SECTIONS}*END PART\n"
    places = "*INSTANCE, NAME=TYRE-1, PART=TYRE\n*END INSTANCE\n"
    bodies = ""
    for side, letter, name in ((1, "L", "LEFT"), (-1, "R", "RIGHT")):
        parts += f"*PART, NAME=RIM_{letter}\n*END PART\n"
        places += f"*INSTANCE, NAME=RIM_{letter}-1, PART=RIM_{letter}\n 0., {0.1 * side}, 0.\n"
        places += f"*NODE\n 1, 0., 0., 0.\n*NSET, NSET={name}\n 1,\n"
        places += flange(side, 0.0, "PROFILE") + "*END INSTANCE\n"
        bodies += f"*NSET, NSET={name}, INSTANCE=RIM_{letter}-1\n 1,\n"
        bodies += f"*RIGID BODY, REF NODE={name}, ANALYTICAL SURFACE=RIM_{letter}-1.PROFILE\n"
    pairs = re.sub(r"BEAD_(.), RIM_.", r"TYRE-1.BEAD_\1, RIM_\1-1.PROFILE", PAIRS)
    step = STEP.replace("CAVITY", "TYRE-1.CAVITY")
    materials = own_decks.MATERIALS.format(**own_decks.SI)
    assembly = f"*ASSEMBLY, NAME=ALL\n{places}{bodies}*END ASSEMBLY\n"
    return f"*HEADING\na tyre\n{parts}{assembly}{materials}{pairs}{MOUNT}{step}"


def with_lines(text: str, error: str) -> str:
    """The deck with the lines that the refusal prints, each where it says."""
    sections = re.search(
        r"adding before (.+?):\n(.*?)(?:\nand before (.+?):\n(.*))?$", error, re.DOTALL
    )
    assert sections
    for place, lines in ((sections[1], sections[2]), (sections[3], sections[4])):
        if not place:
            continue
        keyword = re.search(r"\*[A-Z ]+", place)
        assert keyword
        parts = re.split(rf"(?im)^(?={re.escape(keyword[0].strip())})", text)
        k = len(parts) - 1 if "inflates" in place else 1
        text = "".join(parts[:k]) + lines + "\n" + "".join(parts[k:])
    return text


def seated(folder: Path, text: str) -> tuple[str, str]:
    """The flat deck once the printed lines are in, and what is said to be left out."""
    path = folder / "tyre.inp"
    path.write_text(text)
    assert not asked_by_abaqus(read_own_deck(path).blocks)["refuses"]
    with pytest.raises(OwnDeckError, match=r"^tyre.inp, line \d+: \*CONTACT") as error:
        read_own_deck(path).flat({})
    path.write_text(with_lines(text, str(error.value)))
    deck = read_own_deck(path)
    assert not asked_by_abaqus(deck.blocks)["refuses"]
    flat = deck.flat({})
    (left_out,) = [s for s in words(contents(deck, flat), 9.0) if s.startswith("left out: ")]
    return flat.text, left_out


GENERAL = "*CONTACT\n*CONTACT INCLUSIONS, ALL EXTERIOR\n*CONTACT PROPERTY ASSIGNMENT\n , , GRIP\n"
ROAD = """*NODE, NSET=HUB
 800003, 0., 0.
*SURFACE, TYPE=SEGMENTS, NAME=ROAD
START, {0}, 0.2
LINE, {0}, -0.2
*RIGID BODY, ANALYTICAL SURFACE=ROAD, REF NODE=HUB
*SURFACE, NAME=TREAD, TYPE=NODE
ALL
"""
ON_ROAD = PAIRS.replace("BEAD_R, RIM_R", "BEAD_R, RIM_R\nTREAD, ROAD")
AGAIN = MOUNT[MOUNT.index("*BOUNDARY") : MOUNT.index("*END STEP")].replace(", AMPLITUDE=SLOW", "")
RELEASED = STEP.replace("*DSLOAD", AGAIN.replace("*BOUNDARY", "*BOUNDARY, OP=NEW") + "*DSLOAD")
STYLES = {
    "segments": in_contact(),
    "pushed_5_mm": in_contact()
    .replace("-0.1\n", "-0.095\n")
    .replace("2, 2, 0.1\n", "2, 2, 0.095\n"),
    "elements": of_elements(),
    "instances": of_instances(),
    "general": in_contact(GENERAL + PAIRS[PAIRS.index("*SURFACE I") :]),
    "released": in_contact(step=RELEASED),
    "road": in_contact(ON_ROAD, ROAD.format(0.4)),
    "set_of_the_name": in_contact(more="*NSET, NSET=SEATED\n1005\n"),
}


@pytest.fixture(scope="module")
def held(tmp_path_factory: pytest.TempPathFactory) -> str:
    """The flat deck of the same tyre whose two ends are held, and nothing to touch."""
    path = tmp_path_factory.mktemp("held") / "tyre.inp"
    ends = [(n,) for n in Tyre().nodes if n % 1000 in (1, COLUMNS + 1)]
    text = block("*NSET, NSET=ENDS", ends) + "*BOUNDARY\nENDS, ENCASTRE\n"
    step = STEP.replace("*CONTACT CONTROLS, STABILIZE\n", "")
    path.write_text(plain(bare_mesh() + text, step=step))
    return read_own_deck(path).flat({}).text


@pytest.mark.parametrize("style", STYLES)
def test_with_the_lines_that_are_printed_it_passes(style: str, held: str, tmp_path: Path) -> None:
    """And is the tyre that is held there."""
    text, left_out = seated(tmp_path, STYLES[style])
    left_out = left_out.replace("TYRE-1.", "").replace("-1.PROFILE", "")
    assert text == held
    assert left_out.count("of its nodes are held") == 2
    assert ("BEAD_L and RIM_L" in left_out) != (style == "general")
    assert ("up to 0 off the rim" in left_out) == (style != "pushed_5_mm")
    assert ("TREAD and ROAD, which do not touch" in left_out) == (style == "road")


def test_the_command_line_prints_the_lines_as_they_go_into_the_deck(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """For the deck itself, and for a case that names it."""
    (tmp_path / "tyre.inp").write_text(in_contact())
    (tmp_path / "tyre.yaml").write_text("format: 1\ndeck: {file: tyre.inp}\n")
    for command in (["init", "--deck", "tyre.inp"], ["validate", "tyre.yaml"]):
        with pytest.raises(SystemExit) as ended:
            main([*command[:-1], str(tmp_path / command[-1])])
        assert ended.value.code == 2
        first, *lines = capsys.readouterr().err.splitlines()
        assert first.startswith("error: ") and first.endswith("before the first *STEP:")
        assert lines[0] == "*NSET, NSET=SEATED" and lines[-2:] == ["*BOUNDARY", "SEATED, ENCASTRE"]


def test_a_held_bead_makes_contact_superfluous(tmp_path: Path) -> None:
    """However it is held: the rim's rigid body is that of the nodes, others only touch."""
    path = tmp_path / "tyre.inp"
    path.write_text(plain())
    whole = read_own_deck(path).flat({})
    path.write_text(plain(Tyre().mesh() + rims() + PAIRS, step=MOUNT + own_decks.STEP))
    flat = read_own_deck(path).flat({})
    assert flat.text == whole.text and flat.model.reference == whole.model.reference
    for pairs in ("", "*CONTACT PAIR, INTERACTION=GRIP\nTREAD, ROAD\n"):
        path.write_text(plain(Tyre().mesh() + ROAD.format(0.4) + pairs))
        assert read_own_deck(path).flat({}).text == whole.text
    assert [words.rpartition(", as ")[2] for words in flat.model.left_out] == [
        "5 of its nodes are held, up to 0 off the rim"
    ] * 2


def test_one_held_bead_holds_not_the_other(tmp_path: Path) -> None:
    """Though one surface of both touches the rim."""
    both = PAIRS.replace("BEAD_L, RIM_L", "BEADS, RIM_L").replace("BEAD_R, RIM_R", "BEADS, RIM_R")
    beads = "*SURFACE, NAME=BEADS, TYPE=NODE\nBEAD_L\nBEAD_R\n"
    held = beads + "*BOUNDARY\nBEAD_L, ENCASTRE\n"
    path = tmp_path / "tyre.inp"
    path.write_text(in_contact(both, held))
    with pytest.raises(OwnDeckError, match="contact of BEADS and RIM_R is not honoured"):
        read_own_deck(path).flat({})
    path.write_text(in_contact(both, held + "BEAD_R, ENCASTRE\n"))
    assert len(read_own_deck(path).flat({}).model.left_out) == 2


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (in_contact(ON_ROAD, ROAD.format(0.337)), "TREAD and ROAD is not honoured, only that of a"),
        (in_contact(PAIRS.replace("RIM_R", "CAVITY")), "CAVITY is no rigid surface"),
        (in_contact(PAIRS.replace(", RIM_R", ",")), "BEAD_R is no rigid surface"),
        (in_contact().replace("2, 2, -0.1", "2, 2, -0.05"), "none of the nodes touches the rim"),
        (in_contact().replace(" RIGHT, 1\n", ""), "the place of the rim is not known"),
        (in_contact().replace("2, 2, 0.1", "6, 6, 0.1"), "may move in 1 and 2, it does not turn"),
        (in_contact().replace("1., 1.\n", "1., 0.5\n", 1), "SLOW ends at 0.5, it must end at 1"),
        (in_contact().replace("CIRCL", "SPLINE"), "SPLINE is no LINE, CIRCL or PARAB"),
        (in_contact().replace("START", "LINE", 1), "begins with START"),
        (in_contact().replace("SURFACE=RIM_L", "SURFACE=BEAD_L"), "is no surface of TYPE=SEGMENTS"),
        (plain(bare_mesh() + GENERAL), "contact of the rubber with itself"),
        (in_contact(PAIRS.replace("BEAD_L", "NONE"), EMPTY), "the surface NONE has no nodes"),
        (plain(Tyre().mesh() + EMPTY + "*TIE, NAME=T\nCAVITY, NONE\n"), "NONE has no nodes"),
        (
            own_decks.embedded()
            .replace("*EMBED", "*ELSET, ELSET=SOLID_0\n*EMBED")
            .replace("HOST ELSET=SOLID", "HOST ELSET=SOLID_0"),
            "SOLID_0 is empty",
        ),
    ],
)
def test_contact_that_is_refused(text: str, words: str, tmp_path: Path) -> None:
    path = tmp_path / "tyre.inp"
    path.write_text(text)
    with pytest.raises(OwnDeckError, match=r"^tyre.inp, line \d+: .*" + words):
        read_own_deck(path).flat({})
