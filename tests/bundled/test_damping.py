"""Damping ratios from energy shares: closed forms, the complex eigenproblem, refusals."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import eigvals
from tyrecal_solvers.bundled.deck import steps
from tyrecal_solvers.bundled.deck.request import Request
from tyrecal_solvers.bundled.deck.steps import Deck
from tyrecal_solvers.bundled.job import Job
from tyrecal_solvers.bundled.modes import harmonics
from tyrecal_solvers.bundled.modes.damping import loss_forms
from tyrecal_solvers.bundled.section import mechanics, model
from tyrecal_solvers.bundled.section.materials import LossFactor
from tyrecal_solvers.bundled.section.model import Model
from tyrecal_solvers.bundled.section.parts.part import ModeShapes
from tyrecal_solvers.bundled.section.parts.pressure import Pressure
from tyrecal_solvers.errors import Refused
from tyrecal_solvers.language.text import read_keywords

from tyrecal.simulate.deck.decks import Decks
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.tyre.values import with_values

from ..effects.support import CASE
from . import support
from .support import Rubber

pytestmark = pytest.mark.numbers

Array = np.ndarray


def compounds(text: str, sets: dict[str, list[int]], constants: dict[str, str]) -> str:
    """The deck with its rubber in sets of elements, each a material with ``constants``."""
    head, _, rest = text.partition("*SOLID SECTION")
    _, _, gum = rest.partition("*MATERIAL, NAME=RUBBER\n")
    for name, elements in sets.items():
        head += f"*ELSET, ELSET={name}\n" + "".join(f"{e}\n" for e in elements)
        head += f"*SOLID SECTION, ELSET={name}, MATERIAL={name}\n"
    own, cords, others = gum.partition("*MATERIAL")
    sections = rest.partition("\n")[2].partition("*MATERIAL, NAME=RUBBER")[0]
    materials = "".join(f"*MATERIAL, NAME={n}\n{own}{more}" for n, more in constants.items())
    return head + sections + materials + cords + others


def solved(
    m: Model, U: Array, loads: list[Pressure], mask: Array, n: int, count: int
) -> tuple[Array, Array]:
    """Eigenvalues and damping ratios of a harmonic."""
    vibration = harmonics.Vibration(m, U, loads, support.numbering(m, mask), 0.0)
    modes = vibration.modes(n, count)
    fields = ModeShapes(np.full(count, n), modes.shapes)
    return modes.eigenvalues, loss_forms(m, U, fields, modes.eigenvalues) / modes.eigenvalues / 2


@pytest.fixture(scope="module")
def tyre() -> tuple[Model, Array, list[Pressure], Array]:
    """An inflated tyre, its outer rubber with a loss factor of 0.3, the inner with 0.1."""
    made = support.tyre((3, 2, 2, 1), quadratic=False)
    elements = list(range(1, 1 + len(support.model_of(made.deck).parts[0].connectivity)))
    sets = {"INNER": elements[::2], "OUTER": elements[1::2]}
    losses = {"INNER": "*DAMPING, STRUCTURAL=0.1\n", "OUTER": "*DAMPING, STRUCTURAL=0.3\n"}
    m = support.model_of(compounds(made.deck, sets, losses))
    mask, loads = support.held(m, made.rim), support.cavity(m, 240e3)
    return m, support.inflate(m, mask, loads), loads, mask


@pytest.mark.parametrize("n", [0, 1, 3])
def test_energy_shares_against_the_complex_eigenproblem(
    tyre: tuple[Model, Array, list[Pressure], Array], n: int
) -> None:
    """zeta = Im sqrt(lambda) / |sqrt(lambda)| of (K + i sum eta K_k - lambda M) within 1 %."""
    m, U, loads, mask = tyre
    eigenvalues, ratios = solved(m, U, loads, mask, n, 4)
    free = ~mask.ravel()
    K = _stiffness(m, U, loads, n)[np.ix_(free, free)]
    for compound, eta in enumerate((0.1, 0.3)):
        for modulus in (0, 1):
            part = replace(m, parts=m.material_parts(compound, modulus))
            K = K + 1j * eta * _stiffness(part, U, [], n)[np.ix_(free, free)]
    M = np.kron(support.full(mechanics.mass(m)), np.eye(3))[np.ix_(free, free)]
    roots = np.sqrt(eigvals(np.linalg.solve(M, K)))
    roots = roots[np.argsort(roots.real)][:4]
    np.testing.assert_allclose(roots.real, np.sqrt(eigenvalues), rtol=0.01)
    np.testing.assert_allclose(ratios, roots.imag / abs(roots), rtol=0.01)
    assert (ratios > 0.002).all() and (ratios < 0.15).all()


def _stiffness(m: Model, U: Array, loads: list[Pressure], n: int) -> Array:
    """K(n) over all components. It is Hermitian, so the i of losses may be that of exp(i n Theta):
    the other sign has the conjugate eigenvalues."""
    K0, K1, K2 = support.matrices(m, U, loads)
    return np.asarray(K0 + 1j * n * K1 + n * n * K2)


def test_a_share_is_the_slope_of_the_frequency_at_the_fixed_state(
    tyre: tuple[Model, Array, list[Pressure], Array],
) -> None:
    """S = d ln lambda / d ln (moduli), by central differences of the vibration's modulus alone."""
    m, U, loads, mask = tyre
    (rubber, *_) = m.parts
    squares = []
    for step in (1e-4, -1e-4):
        of_outer = 1 + step * (rubber.law.compound == 1)
        law = replace(rubber.law, shear_ratio=of_outer, bulk_ratio=of_outer)
        moved = replace(m, parts=[replace(rubber, law=law), *m.parts[1:]])
        squares.append(support.eigenvalues(moved, U, loads, mask, 2, 3, shift=0.0))
    slopes = np.log(squares[0] / squares[1]) / 2e-4
    outer = replace(
        m, lossy=[replace(k, loss=LossFactor(eta)) for k, eta in zip(m.lossy, (0, 1), strict=True)]
    )
    np.testing.assert_allclose(2 * solved(outer, U, loads, mask, 2, 3)[1], slopes, rtol=1e-6)


def test_half_and_whole_sections_damp_alike(monkeypatch: pytest.MonkeyPatch) -> None:
    case = with_values(CASE, {})
    rubber = case.case.materials["rubber"].model_copy(update={"loss_factor": 0.2})
    materials = {**case.case.materials, "rubber": rubber}
    case = replace(case, case=case.case.model_copy(update={"materials": materials}))
    texts = Decks(TyreDesign(case)).texts("abaqus")
    deck = Deck({name.removesuffix(".inp"): t for name, t in texts.items()}, "modes", "inflate")
    ratios = []
    for keeps in (True, False):
        if not keeps:
            monkeypatch.setattr("tyrecal_solvers.bundled.job.keeps_half_turn", lambda *of: False)
        (step,) = Job(deck, Request([0, 1, 2])).run()
        ratios.append(np.concatenate(step.damping))
    np.testing.assert_allclose(ratios[0], ratios[1], rtol=1e-6)
    assert (ratios[0] > 0.005).all()


def test_shares_add_up(tyre: tuple[Model, Array, list[Pressure], Array]) -> None:
    """Those of two compounds are that of all rubber, less than 1: pressure and cords have some."""
    m, U, loads, mask = tyre
    shares = []
    for pair in ((1, 0), (0, 1), (1, 1)):
        lossy = [replace(k, loss=LossFactor(x)) for k, x in zip(m.lossy, pair, strict=True)]
        shares.append(2 * solved(replace(m, lossy=lossy), U, loads, mask, 1, 3)[1])
    inner, outer, both = shares
    np.testing.assert_allclose(inner + outer, both, rtol=1e-12)
    assert (both < 1).all() and (inner > 0).all() and (outer > 0).all()


def ring(damping: str, layers: int = 3) -> Model:
    """Rubber from a held hub at 0.1 m to 0.3 m."""
    b = support.block((0.1, 0.3, layers), (0.0, 0.05, 1), True)
    text = support.deck(b.X, b.solids, Rubber(C10=2e5))
    return support.model_of(text.replace("*DENSITY", f"{damping}*DENSITY"))


@pytest.mark.parametrize("n", [0, 2])
def test_half_the_loss_factor_where_rubber_is_all_stiffness(n: int) -> None:
    m = ring("*DAMPING, STRUCTURAL=0.2\n")
    mask = np.repeat(abs(m.mesh.X[:, :1] - 0.1) < 1e-9, 3, 1)
    _, ratios = solved(m, 0.0 * mask, [], mask, n, 3)
    np.testing.assert_allclose(ratios, 0.1, rtol=1e-9)


def test_a_table_has_the_loss_factor_of_each_mode() -> None:
    """Linear in ln f, with loss over storage modulus: the table's storage is 0.8 of the static."""
    rows = ((1.0, 0.1), (100.0, 0.3))
    lines = [f"{0.8 * eta!r}, 0.2, {eta!r}, 0.0, {f!r}\n" for f, eta in rows]
    m = ring("*VISCOELASTIC, FREQUENCY=TABULAR\n" + "".join(lines))
    mask = np.repeat(abs(m.mesh.X[:, :1] - 0.1) < 1e-9, 3, 1)
    eigenvalues, ratios = solved(m, 0.0 * mask, [], mask, 1, 4)
    hertz = support.hertz(eigenvalues)
    exact = (0.1 + 0.2 * np.log(hertz) / np.log(100)) / 2
    assert 1 < hertz[0] < hertz[-1] < 100
    np.testing.assert_allclose(ratios, exact, rtol=1e-9)


def test_layers_in_series_in_closed_form() -> None:
    """A heavy stiff ring on two soft layers of rubber that turns about the axle: the compliance of
    a layer is (1/a^2 - 1/b^2) / G, and its share of the energy that of the compliance."""
    b = support.block((0.1, 0.3, 4), (0.0, 0.05, 1), True)
    text = support.deck(b.X, b.solids, Rubber(C10=2e5, density=1e-3))
    sets = {"FIRST": [1, 2], "SECOND": [3], "RING": [4]}
    losses = {"FIRST": "*DAMPING, STRUCTURAL=0.2\n", "SECOND": "", "RING": ""}
    text = compounds(text, sets, losses)
    law = "\n*HYPERELASTIC, MOONEY-RIVLIN\n200000.0"
    text = text.replace(f"SECOND{law}", f"SECOND{law.replace('2', '4')}")
    head, name, own = text.rpartition("*MATERIAL, NAME=RING")
    own = own.replace("200000.0", "2e10").replace("0.001", "1e4")
    m = support.model_of(head + name + own)
    mask = np.ones((len(m.mesh.X), 3), bool)
    mask[:, 1] = abs(m.mesh.X[:, 0] - 0.1) < 1e-9
    _, ratios = solved(m, 0.0 * mask, [], mask, 0, 1)
    soft, stiff = (0.1**-2 - 0.2**-2) / 4e5, (0.2**-2 - 0.25**-2) / 8e5
    assert ratios[0] == pytest.approx(0.1 * soft / (soft + stiff), rel=1e-3)


@pytest.mark.parametrize(
    ("damping", "words"),
    [
        ("*DAMPING, STRUCTURAL=-0.1\n", "a loss factor of 0 or more"),
        ("*DAMPING, ALPHA=1.0\n", "the parameter ALPHA is not honoured"),
        ("*DAMPING, STRUCTURAL=0.1\n1.0\n", "takes no data lines"),
        ("*VISCOELASTIC, FREQUENCY=TABULAR\n-0.1, 0., 0., 0., 1.\n0., 0., 0., 0., 2.\n", "losses"),
    ],
)
def test_damping_that_is_refused(damping: str, words: str) -> None:
    with pytest.raises(Refused, match=words):
        ring(damping)


def test_damping_of_cords_is_refused() -> None:
    text = support.tyre((3, 2, 2, 1)).deck.replace(
        "*ELASTIC", "*DAMPING, STRUCTURAL=0.1\n*ELASTIC", 1
    )
    with pytest.raises(Refused, match="the damping of material CORD1, of cords, is not honoured"):
        model.build(steps.check(read_keywords(text), False)[0], None, True)
