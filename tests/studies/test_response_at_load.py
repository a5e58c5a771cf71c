"""Response functions and reduced matrices of the tyre on the road, for the command and Python."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tyrecal.simulate.deck import tyre_design
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator
from tyrecal.simulate.evaluate.store import Store
from tyrecal.studies import matrices as exported
from tyrecal.studies.matrices import matrix_files
from tyrecal.studies.response import FrfResult, default_points, read_points
from tyrecal.studies.result import StudyInput
from tyrecal.tyre.case import LoadedCase, start_values
from tyrecal.tyre.effects.edit import with_part
from tyrecal.tyre.values import with_values

from ..bundled.contact import coarse_case
from ..cli.test_cli import run
from ..conftest import CASES
from .test_matrices import read_matrix_market

pytestmark = [pytest.mark.numbers, pytest.mark.slow]
Array = np.ndarray
LOAD_N, TO_HZ, PATCH_MM = 3000.0, 110.0, 60.0
POINTS = "tread:90deg:radial,tread:180deg:lateral"


@pytest.fixture(scope="module")
def case() -> LoadedCase:
    """A very coarse tyre with losses; its wheel would be free under a load."""
    case = with_values(coarse_case(), {"materials.rubber.loss_factor": 0.1})
    road = with_part(case.case.road, wheel="free_along_load")
    return replace(case, case=case.case.model_copy(update={"road": road}))


@pytest.fixture(scope="module")
def few_waves() -> object:
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(tyre_design, "WAVES_OF_RESPONSE", 5)
        patched.setattr(exported, "MATRIX_BAND_Hz", TO_HZ)
        patched.setattr(exported, "MATRIX_PATCH_mm", PATCH_MM)
        yield


def test_matrices_give_the_response_functions(
    case: LoadedCase, few_waves: object, tmp_path_factory: pytest.TempPathFactory
) -> None:
    """Hub forces and moments within 0.5 dB where they are above a thousandth of the largest, the
    hub held although the case has a free wheel; a record gives the same bytes."""
    evaluator = Evaluator(TyreDesign(case), store=Store(tmp_path_factory.mktemp("store")))
    given = StudyInput(case, evaluator, {"initial": start_values(case)})
    hub = "hub:fx,hub:fy,hub:fz,hub:mx,hub:my,hub:mz"
    options = {"excite": POINTS, "respond": f"{hub},{POINTS}", "to_Hz": TO_HZ, "step_Hz": 2.0}
    first, again = (
        FrfResult.run(given, **options, patch_mm=PATCH_MM, load_N=LOAD_N) for _ in range(2)
    )
    assert first.texts() == again.texts() and evaluator.counts.recorded == 1
    assert first.load_N == first.provenance.state.load_N == LOAD_N  # type: ignore[union-attr]
    files = matrix_files(case, points=POINTS, load_N=LOAD_N, modes=80)
    assert b"3000 N on a flat road" in files["README.txt"]
    read = {name[:-4]: read_matrix_market(files[name]) for name in files if name.endswith(".mtx")}
    assert len(read["mass"]) <= 86
    assert read["stiffness"][2, 2] == pytest.approx(2.5e5, rel=0.3)  # N/m, the vertical one
    omega = 2 * np.pi * np.array(first.frequency_Hz)[:, None, None]
    Z = read["stiffness"] + 1j * read["loss"] - omega**2 * read["mass"]
    q = np.linalg.solve(Z[:, 6:, 6:], read["tread"][None, :, 6:].swapaxes(1, 2))
    on_hub = read["tread"][:, :6].T - Z[:, :6, 6:] @ q
    for k, point in enumerate(hub.split(",")):
        own = [each for each in first.functions if each.respond == point]
        full = np.array([each.values for each in own]).T
        large = np.abs(full) > 1e-3 * np.abs(full).max()
        assert large.any()
        decibels = 20 * np.log10(np.abs(on_hub[:, k][large] / full[large]))
        assert np.abs(decibels).max() < 0.5


def test_loads_are_refused_as_by_other_commands(capsys: pytest.CaptureFixture[str]) -> None:
    case = str(CASES / "p235_75r17.yaml")
    assert run("frf", case, "--load-N", "-3") == 2
    assert "must be a load above 0" in capsys.readouterr().err
    assert run("frf", case, "--load-N", "3e6") == 2
    assert run("export", case, "--format", "matrices", "--load-N", "3e6") == 2


def test_the_default_force_is_away_from_the_patch() -> None:
    """Unloaded it is below the hub; the road would hold that point."""
    for load, angle in ((0.0, 0.0), (LOAD_N, 180.0)):
        points = default_points(load, moves=False)
        (force,), (hub, seen) = (
            read_points(points["excite"], hub=False),
            read_points(points["respond"]),
        )
        assert force == seen and force.angle_deg == angle and hub.angle_deg is None
    (hub, _) = read_points(default_points(0.0, moves=True)["respond"], moves=True)
    assert hub.channel == "z"
