"""FEniCSx, where Debian's Python has it, finds the bundled solver's modes on a coarse mesh."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

from tyrecal.tyre.case import with_level
from tyrecal.tyre.load import load_case

from .calculix import ROOT
from .fenics import on_common
from .judge import PYTHON


def installed() -> bool:
    """Debian's Python can import FEniCSx."""
    try:
        return not subprocess.run([PYTHON, "-c", "import dolfinx"], capture_output=True).returncode
    except FileNotFoundError:
        return False


@pytest.mark.slow
def test_the_same_modes(tmp_path: Path) -> None:
    """Nine modes to 1e-8, the mass to 1e-11, the inflated states to a nanometre."""
    if not installed():
        pytest.skip("FEniCSx is not installed here (apt-get install python3-dolfinx)")
    case = with_level(load_case(ROOT / "cases" / "p235_75r17.yaml"), "coarse")
    solved = on_common(case, tmp_path)
    assert len(solved.ours) == 9
    for label, mode in solved.ours.items():
        assert mode.frequency_Hz == pytest.approx(solved.theirs[label].frequency_Hz, rel=1e-8)
        assert solved.mac(label) > 1 - 1e-6
    assert solved.apart_m < 1e-9
    assert solved.mass_kg[0] == pytest.approx(solved.mass_kg[1], rel=1e-11)
