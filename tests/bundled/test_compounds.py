"""Several materials, of several laws, in one section: masses, states, modes and slopes."""

from __future__ import annotations

import numpy as np
import pytest
from tyrecal_solvers.bundled import job as jobs
from tyrecal_solvers.bundled.deck.request import Request
from tyrecal_solvers.bundled.deck.steps import Deck, Tangent
from tyrecal_solvers.bundled.job import Job
from tyrecal_solvers.bundled.modes import lanczos
from tyrecal_solvers.bundled.results import StepResult

from ..effects.support import CASE, decks

Array = np.ndarray
COMPOUNDS = {  # name: law, constants, density
    "SIDEWALL": ("*HYPERELASTIC, YEOH", "400000., -50000., 20000., 1.E-7, 2.E-7", 1120.0),
    "SKIM": ("*HYPERELASTIC, NEO HOOKE", "1200000., 5.E-8", 1130.0),
    "TREAD": ("*HYPERELASTIC, ARRUDA-BOYCE", "1100000., 3., 8.E-8", 1150.0),
    "APEX": ("*HYPERELASTIC, OGDEN, N=2", "3.E6, 2., -2.E5, -2., 3.E-8", 1200.0),
    "WIRE": ("*ELASTIC", "5.E9, 0.3", 4000.0),
}
STEP = 1e-2  # in ln of a number
PLACES = {
    "SIDEWALL": "REGION_LOWER_SIDEWALL",
    "SKIM": "REGION_UPPER_SIDEWALL",
    "TREAD": "REGION_CROWN",
    "APEX": "FILLER",
    "WIRE": "CORE",
}


def compounded() -> dict[str, str]:
    """The coarse tyre's decks, each region of another stuff and half of the bead of wire."""
    written = decks(CASE)
    text = written["inflate.inp"]
    one = "*SOLID SECTION, ELSET=SOLID_1, MATERIAL=RUBBER\n"
    beads = "*ELSET, ELSET=CORE\n1002, 1003, 20002, 20003\n"
    beads += "*ELSET, ELSET=FILLER\n1001, 1004, 20001, 20004\n"
    sections = [f"*SOLID SECTION, ELSET={e}, MATERIAL={m}\n" for m, e in PLACES.items()]
    materials = [
        f"*MATERIAL, NAME={name}\n{law}\n{numbers}\n*DENSITY\n{density}\n"
        for name, (law, numbers, density) in COMPOUNDS.items()
    ]
    assert text.count(one) == 1
    inflate = text.replace(one, beads + "".join([*sections, *materials]))
    return {"inflate": inflate, "modes": written["modes.inp"]}


def run(pair: dict[str, str], **request: object) -> StepResult:
    whole_request = Request(harmonics=[0, 1, 2], modes_per_harmonic=2, **request)  # type: ignore[arg-type]
    return Job(Deck(pair, "modes", "inflate"), whole_request).run()[-1]


def test_each_element_has_its_own_stuff() -> None:
    """A part for each law; each region's mass is its volume times its own density."""
    job = Job(Deck(compounded(), "modes", "inflate"), Request())
    plain = Job(
        Deck({**compounded(), "inflate": decks(CASE)["inflate.inp"]}, "modes", "inflate"), Request()
    )
    solids, before = job.model.parts[:-1], plain.model.parts[0]
    assert [type(part.law).__name__ for part in solids] == [
        "ReducedPolynomial",
        "MooneyRivlin",
        "ArrudaBoyce",
        "Ogden",
        "LinearElastic",
    ]
    assert sum(len(part.connectivity) for part in solids) == len(before.connectivity)
    mass = {tuple(row): m.sum() for row, m in zip(before.connectivity, before.mass, strict=True)}
    for part, (_, _, density) in zip(solids, COMPOUNDS.values(), strict=True):
        for row, own in zip(part.connectivity, part.mass, strict=True):
            assert own.sum() == pytest.approx(mass[tuple(row)] * density / 1100.0, rel=1e-12)


def test_half_the_section_is_the_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    half = run(compounded())
    monkeypatch.setattr(jobs, "keeps_half_turn", lambda *_: False)
    whole = run(compounded())
    np.testing.assert_allclose(half.U, whole.U, atol=1e-11 * abs(whole.U).max())
    for mine, its in zip(half.modes, whole.modes, strict=True):
        np.testing.assert_allclose(mine.eigenvalues, its.eigenvalues, rtol=1e-9)


@pytest.mark.slow
def test_slopes_by_numbers_of_each_law(monkeypatch: pytest.MonkeyPatch) -> None:
    """d lambda / d ln of a constant of each against differences of fourth order, whose round-off is
    1e-10 of lambda over their step."""
    monkeypatch.setattr(lanczos, "INVERSE_RTOL", 1e-12)  # slopes are as good as shapes
    pair = compounded()
    lines = pair["inflate"].splitlines()
    places = {name: lines.index(numbers) for name, (_, numbers, _) in COMPOUNDS.items()}
    fields = dict.fromkeys(COMPOUNDS, 0) | {"TREAD": 1, "APEX": 1}
    values = {name: float(lines[places[name]].split(",")[fields[name]]) for name in COMPOUNDS}
    tangents: dict[str, list[Tangent]] = {
        name: [("inflate", places[name] + 1, fields[name], values[name])] for name in COMPOUNDS
    }
    result = run(pair, sensitivities=tangents)
    highest = max(each.eigenvalues.max() for each in result.modes)
    for name in COMPOUNDS:
        eigenvalues = []
        for step in (-2, -1, 1, 2):
            own, numbers = list(lines), lines[places[name]].split(",")
            numbers[fields[name]] = repr(values[name] * (1 + step * STEP))
            own[places[name]] = ",".join(numbers)
            moved = run({**pair, "inflate": "\n".join(own) + "\n"})
            eigenvalues.append(np.concatenate([each.eigenvalues for each in moved.modes]))
        wanted = (eigenvalues[0] - 8 * eigenvalues[1] + 8 * eigenvalues[2] - eigenvalues[3]) / (
            12 * STEP
        )
        got = np.concatenate(result.rates[name])
        noise = 1e-10 * highest / STEP
        np.testing.assert_allclose(got, wanted, atol=1e-6 * abs(wanted).max() + noise)
