"""Answers of each kind of tyre, and refusals in the user's words of what it cannot answer."""

from __future__ import annotations

from pathlib import Path

import pytest

from tyrecal.errors import InputError
from tyrecal.tyre.case import LoadedCase
from tyrecal.tyre.case.kinds.section_deck import SectionDeck
from tyrecal.tyre.case.kinds.stations import Stations
from tyrecal.tyre.case.kinds.user_decks import DecksIn3D
from tyrecal.tyre.load import load_case
from tyrecal.tyre.resolve import resolved

from ..conftest import CASES
from ..solvers.test_decks_3d import case_of
from ..tyre import own_decks


@pytest.fixture(scope="module")
def cases(tmp_path_factory: pytest.TempPathFactory) -> dict[type, LoadedCase]:
    """A case of each kind."""
    folder = tmp_path_factory.mktemp("kinds")
    (folder / "tyre.inp").write_text(own_decks.plain())
    (folder / "tyre.yaml").write_text("format: 1\ndeck: {file: tyre.inp}\n")
    return {
        Stations: load_case(CASES / "p235_75r17.yaml"),
        SectionDeck: load_case(folder / "tyre.yaml"),
        DecksIn3D: load_case(case_of(folder)),
    }


@pytest.mark.parametrize(
    ("kind", "question", "words"),
    [
        (Stations, "deck", "not given by a section deck"),
        (Stations, "decks", "not given by decks in three dimensions"),
        (SectionDeck, "decks", "not given by decks in three dimensions"),
        (DecksIn3D, "deck", "not given by a section deck"),
    ],
)
def test_another_kinds_question_is_refused(
    cases: dict[type, LoadedCase], kind: type, question: str, words: str
) -> None:
    case = cases[kind]
    assert type(case.kind) is kind
    with pytest.raises(InputError, match=words):
        getattr(case.kind, question)


def test_a_tyre_without_a_section_says_so(cases: dict[type, LoadedCase]) -> None:
    """For the section as drawn and for its mesh; the others have both."""
    for kind in (Stations, SectionDeck):
        assert cases[kind].section.points.size and resolved(cases[kind]).mesh.nodes
    for attempt in (lambda case: case.section, lambda case: resolved(case).mesh):
        with pytest.raises(InputError, match=r"ring\.yaml' has no section, which this"):
            attempt(cases[DecksIn3D])


def test_files_of_each_kind(cases: dict[type, LoadedCase]) -> None:
    """All whose change makes another tyre, in the folder of the case."""
    names = {
        kind: [path.name for path in case.kind.files(case.case, case.folder)]
        for kind, case in cases.items()
    }
    assert names[SectionDeck] == ["tyre.inp"]
    assert {*names[DecksIn3D]} == {"inflate.inp", "mesh.inp", "modes.inp"}
    assert [Path(name).suffix for name in names[Stations]] == [".csv"]
