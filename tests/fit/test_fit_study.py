"""A fit as all callers make it: targets stay in the state that they were measured in."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from tyrecal.errors import InputError
from tyrecal.measured.targets import in_set_state
from tyrecal.studies.fit.study import FitStudy
from tyrecal.studies.fit.targets import read_targets
from tyrecal.tyre.case import LoadedCase
from tyrecal.tyre.case.schema import TargetFootprint, TargetMode, Variable
from tyrecal.tyre.state import TyreState
from tyrecal.tyre.values import overridden

from .tyre_in_states import CASE, TRUTH, TyreInStates, case_with, measured

OWN, SOFT, FREE = TyreState(), TyreState(160.0), TyreState(None, 0.0, "free")
AREA = TargetFootprint(load_N=4000, contact_area_m2=0.016, sigma_m2=1e-4)


class Tyre(TyreInStates):
    """Toy tyre with an evaluator's way to other designs of the same tyre."""

    def of(self, design: Any) -> Tyre:
        return self


def study(case: LoadedCase, **given: Any) -> FitStudy:
    tyre: Any = Tyre()
    return FitStudy(case, tyre, **given)


def states(case: LoadedCase) -> set[TyreState]:
    return {target.state for target in read_targets(case)}


def with_pressure_variable(modes: list[TargetMode], start: float = 240.0) -> LoadedCase:
    case = case_with(modes)
    P = Variable(sets=["pressure_kPa"], start=start, lower=100.0, upper=400.0)
    variables = {**case.case.variables, "P": P}
    return replace(case, case=case.case.model_copy(update={"variables": variables}))


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"pressure_kPa": 200}, "at 200 kPa, only at 240 kPa: set pressure_kPa=240, or give meas"),
        (
            {"rim.free": True},
            "at 240 kPa with the rim free, only at 240 kPa with the rim fixed: set rim.free=false",
        ),
        ({"effects.wheel_free": 0.05}, "at 240 kPa with the rim free, only at 240 kPa with the"),
        (
            {"rim.free": True, "pressure_kPa": 160},
            "set pressure_kPa=240 and rim.free=false, or give measurements at 160 kPa with the rim",
        ),
    ],
)
def test_a_fit_in_a_state_without_targets_is_refused(
    values: Mapping[str, float], words: str
) -> None:
    """The refusal states which states have targets, and what to do. No design is evaluated."""
    case = overridden(case_with(measured([OWN])), values)
    with pytest.raises(InputError) as refused:
        study(case)
    assert words in str(refused.value) and "\n" not in str(refused.value)
    assert "p235_75r17.yaml: no target was measured" in str(refused.value)


@pytest.mark.parametrize(
    ("values", "kept"),
    [
        ({"pressure_kPa": 160}, SOFT),
        ({"pressure_kPa": 240}, OWN),
        ({"rim.free": True}, FREE),
        ({"rim.free": False}, OWN),
    ],
)
def test_a_state_that_is_set_chooses_the_targets_measured_there(
    values: Mapping[str, float], kept: TyreState
) -> None:
    case = case_with(measured([OWN, FREE if "rim.free" in values else SOFT]))
    fit = study(overridden(case, values))
    assert states(fit.case) == {OWN} and len(fit.case.case.targets.modes) == 9
    hertz = [mode.frequency_Hz for mode in measured([kept])]
    assert [mode.frequency_Hz for mode in fit.case.case.targets.modes] == hertz
    (left_out,) = fit.left_out
    assert left_out.startswith("9 values at ") and study(case).left_out == []


def test_the_fit_that_remains_finds_the_tyre() -> None:
    """The fit starts from a start that its user set, and the result records it."""
    case = overridden(case_with(measured([OWN, SOFT])), {"pressure_kPa": 240, "C10": 2e6})
    fit = study(case).run()
    assert fit.initial.values["C10"] == 2e6 and fit.result["pressure_kPa"] == 240
    assert fit.result["provenance"]["overrides"] == {"pressure_kPa": 240, "C10": 2e6}
    for name, truth in TRUTH.items():
        assert fit.result["variables"][name]["value"] == pytest.approx(truth, rel=1e-3)


def test_other_numbers_leave_the_states_alone() -> None:
    """Effects, a spindle's compliance, and numbers that are set back to those of the file."""
    case = case_with(measured([OWN, SOFT]))
    for values in ({"effects.bead_filler": 1.5}, {"rim.spindle.lateral_m_per_N": 1e-7}):
        assert overridden(case, values).case.targets == case.case.targets
    back = overridden(overridden(case, {"pressure_kPa": 200}), {"pressure_kPa": 240})
    assert back.case == case.case


def test_areas_stay_at_their_pressure_and_on_a_held_rim() -> None:
    case = case_with(measured([OWN, FREE]))
    targets = case.case.targets.model_copy(update={"footprint": [AREA]})
    case = replace(case, case=case.case.model_copy(update={"targets": targets}))
    softer = overridden(case, {"pressure_kPa": 160})
    assert softer.case.targets.footprint[0].pressure_kPa == 240
    chosen, left_out = in_set_state(overridden(case, {"rim.free": True}))
    assert chosen.case.targets.footprint == [] and len(chosen.case.targets.modes) == 9
    assert left_out == ["10 values at 240 kPa with the rim fixed"]


def test_targets_whose_pressure_is_a_variable_follow_it_unless_it_is_held() -> None:
    """The pressure's start is where its search begins; held elsewhere, it moves the targets."""
    case = with_pressure_variable(measured([OWN]))
    assert states(study(overridden(case, {"P": 200})).case) == {OWN}
    assert states(study(case, fixed={"P": 240.0}).case) == {OWN}
    for held in (study, lambda case, fixed: study(overridden(case, fixed), fixed=fixed)):
        with pytest.raises(InputError, match="at 200 kPa, only at 240 kPa: set P=240, or give"):
            held(case, fixed={"P": 200.0})


def test_measured_files_choose_by_the_state_that_is_set(tmp_path: Path) -> None:
    path = tmp_path / "m.csv"
    head = "label,frequency_Hz,sigma_Hz,pressure_kPa,rim\n"
    rows = [f'"[{c},0]",{60 + 10 * c},0.4,240,{rim}\n' for c in (1, 2, 3) for rim in ("", "free")]
    path.write_text(head + "".join(rows))
    assert states(study(CASE, measured=path).case) == {OWN, FREE}
    free = study(overridden(CASE, {"rim.free": True}), measured=path)
    assert free.left_out == ["3 values at 240 kPa with the rim fixed"]
    assert states(free.case) == {OWN}
    without = [row.replace(",\n", "\n") for row in rows[::2]]  # on the rim that the case has
    path.write_text(head.replace(",rim", "") + "".join(without))
    assert states(study(overridden(CASE, {"rim.free": True}), measured=path).case) == {OWN}
