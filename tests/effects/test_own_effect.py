"""The guide's example of an own effect, installed and used as it stands there."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from ..conftest import CASES, ROOT
from ..example import install, tyrecal

CASE = str(CASES / "p235_75r17.yaml")


@pytest.fixture
def site(tmp_path: Path) -> Path:
    """A folder of packages with the example installed in it."""
    return install((ROOT / "cases/own_effect.md").read_text(), "my_effect", tmp_path)


def modes(site: Path, *arguments: str) -> dict[str, float]:
    """Frequencies in Hz by label on the coarse mesh."""
    done = tyrecal(
        site, "modes", CASE, "--mesh", "coarse", "--json", "--output", str(site / "out"), *arguments
    )
    assert done.returncode == 0, done.stderr
    return {
        f"{m['c']},{m['m']},{m['kind']}": m["frequency_Hz"]
        for m in json.loads(done.stdout)["modes"]
    }


@pytest.mark.slow
def test_it_is_the_change_that_it_says(site: Path) -> None:
    modulus = "materials.belt_cord.youngs_modulus_Pa"
    plain, absent = modes(site), modes(site, "--set", "effects.belt_softening=0")
    softened = modes(site, "--set", "effects.belt_softening=0.25")
    by_hand = modes(site, "--set", f"{modulus}={0.75 * 172.2e9!r}")
    assert plain == absent
    assert softened == pytest.approx(by_hand, rel=1e-9)  # it starts elsewhere
    assert softened["4,0,None"] < 0.999 * plain["4,0,None"]


@pytest.mark.slow
def test_the_catalogue_has_it_and_refuses_what_cannot_be(site: Path) -> None:
    done = tyrecal(site, "effects", "belt_softening", "--json")
    (entry,) = json.loads(done.stdout)
    assert entry["title"] == "Softer belt cords" and "bundled" in entry["solvers"]
    assert entry["about"][0].startswith("The belts' cords have lost stiffness")
    done = tyrecal(
        site, "modes", CASE, "--set", "effects.belt_softening=1.5", "--output", str(site / "out")
    )
    assert done.returncode == 2 and "less than 1" in done.stderr
    assert "Traceback" not in done.stderr
