"""CalculiX's pressed tyre: forces and area are read whole, or not at all."""

from __future__ import annotations

import math
import re
import sys
from pathlib import Path

import pytest
from tyrecal_solvers.errors import RunFailed

from .press_deck import Angles, press_texts
from .press_results import read_press, read_pressures, read_radius, run_press
from .test_press_deck import coarse_case

DECK = "** deflection 0.006 m\n1, -0.005\n** deflection 0.01 m\n2, -0.009\n"
DAT = """
 total force (fx,fy,fz) for set RIM and time  0.{k}000000E+01

        6.187689E+02  2.036030E+04  6.392139E-02

 total force (fx,fy,fz) for set ROAD and time  0.{k}000000E+01

       -6.236171E+02 -7.005251E+01 -1.209515E+00


 statistics for slave set TREAD, master set ROAD_FACE and time  0.{k}000000E+01

   total surface force (fx,fy,fz) and moment about the origin (mx,my,mz)

   -6.236171E+02 -7.005251E+01 -1.209515E+00  1.214473E-01  3.015647E-01 -3.639383E+01

   center of gravity and mean normal

    3.865992E-01 -1.323059E-02  2.055130E-04  1.000000E+00  0.000000E+00  2.088515E-18

   moment about the center of gravity(mx,my,mz)

    9.104800E-02 -3.787152E-02 -1.060765E+00

   area,  normal force (+ = tension) and shear force (size)

    1.413829E-03 -6.236171E+02  7.006295E+01
"""
BOTH = DAT.replace("{k}", "1") + DAT.replace("{k}", "2").replace("6.23", "6.24")


def folder_with(folder: Path, dat: str, wheel: str = "*EQUATION\n") -> Path:
    for name, text in (("press.inp", DECK), ("wheel.inp", wheel), ("press.dat", dat)):
        (folder / name).write_text(text)
    return folder


def test_a_half_counts_twice(tmp_path: Path) -> None:
    first, second = read_press(folder_with(tmp_path, BOTH))
    assert (first.deflection_m, second.deflection_m) == (0.006, 0.01)
    assert first.force_N == pytest.approx(2 * 623.6171)
    assert first.rim_N == pytest.approx(2 * 618.7689)
    assert first.area_m2 == pytest.approx(2 * 1.413829e-3)
    assert first.shear_N == pytest.approx(70.06295)
    assert second.force_N == pytest.approx(2 * 624.6171)


def test_the_whole_tyre_counts_once(tmp_path: Path) -> None:
    first, _ = read_press(folder_with(tmp_path, BOTH, "*NODE\n"))
    assert first.force_N == pytest.approx(623.6171) and math.isnan(first.shear_N)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("time  0.2000000E+01\n\n   total surface", "", "1 of 2"),
        ("area,  normal", "no area, normal", "0 of 2"),
        ("0.2000000E+01", "0.1500000E+01", "2 of 2"),
        ("1.413829E-03", "0.000000E+00", "bears 1247.23 N on 0 m2"),
        ("1.413829E-03", "         NaN", "not numbers"),
        ("-6.236171E+02 -7.005251E+01", "************* -7.005251E+01", "not numbers"),
        ("6.187689E+02", "5.187689E+02", "the rim 1037.54 N"),
        ("-6.236171E+02", " 6.236171E+02", "bears -1247.23 N"),
        ("time", "tame", "0 of 2"),
    ],
)
def test_results_that_are_not_whole(tmp_path: Path, old: str, new: str, words: str) -> None:
    assert old in BOTH
    with pytest.raises(RunFailed, match=re.escape(words)) as failure:
        read_press(folder_with(tmp_path, BOTH.replace(old, new)))
    assert failure.value.cause == "no_results"


def test_results_that_are_cut_off_or_absent(tmp_path: Path) -> None:
    folder_with(tmp_path, BOTH[:-300])
    with pytest.raises(RunFailed, match="1 of 2"):
        read_press(tmp_path)
    (tmp_path / "press.dat").unlink()
    with pytest.raises(RunFailed, match=r"no press\.dat"):
        read_press(tmp_path)


def lines(*rows: tuple[int, list[float]]) -> str:
    return "".join(f" -1{n:10d}" + "".join(f"{x:12.5E}" for x in v) + "\n" for n, v in rows)


def test_pressures_stand_where_their_nodes_have_moved(tmp_path: Path) -> None:
    heads = [
        f" -5  {name:8s}    1\n" for name in ("COPEN", "CSLIP1", "CSLIP2", "CPRESS", "CSHEAR1")
    ]
    text = (
        "    1C\n    2C\n"
        + lines((1, [0.3, -0.1, -0.2]), (2, [0.3, 0.0, 0.1]))
        + " -3\n"
        + " -4  DISP        4    1\n"
        + lines((1, [0, 0.01, 0.0]), (2, [0, 0, 0.02]))
        + " -3\n"
        + " -4  CONTACT     6    1\n"
        + "".join(heads)
        + lines((1, [-1e-5, -0.1, -0.2, 3e5, -1e5]), (2, [0.0, 0, 0, 0, 0]))
        + " -3\n 9999\n"
    )
    (tmp_path / "press.frd").write_text(text)
    (patch,) = read_pressures(tmp_path)
    assert patch.tolist() == [[pytest.approx(-0.09), pytest.approx(-0.2), 3e5]]
    apart = text.replace(lines((2, [0.0, 0, 0, 0, 0])), "")  # what touches nothing may be missing
    (tmp_path / "press.frd").write_text(apart)
    assert apart != text and read_pressures(tmp_path)[0].tolist() == patch.tolist()
    (tmp_path / "press.frd").write_text(text.replace("CONTACT", "STRESS "))
    with pytest.raises(RunFailed, match="0 patches"):
        read_pressures(tmp_path)


@pytest.mark.parametrize(("share", "whole"), [(0.019, True), (0.021, False)])
@pytest.mark.parametrize("side", [1, -1])
def test_how_well_road_and_rim_must_balance(
    tmp_path: Path, share: float, whole: bool, side: int
) -> None:
    """Within 2 % of the road's force."""
    text = BOTH.replace("6.187689E+02", f"{623.6171 * (1 + side * share):.6E}")
    text = text.replace("6.247689E+02", f"{623.6171 * (1 + side * share):.6E}")
    folder_with(tmp_path, text.replace("6.246171", "6.236171"))
    if whole:
        assert len(read_press(tmp_path)) == 2
    else:
        with pytest.raises(RunFailed, match="the road bears"):
            read_press(tmp_path)


def test_the_job_runs_with_its_wheel(tmp_path: Path) -> None:
    """Wherever ccx has to run, and what it left is read."""
    left = tmp_path / "left.py"
    left.write_text(
        "import sys; from pathlib import Path\n"
        "assert Path('wheel.inp').read_text() and sys.argv[1:] == ['press']\n"
        f"Path('press.dat').write_text({BOTH!r})\n"
        "print('Job finished')\n"
    )
    for place in ("plain", "with blanks"):
        (tmp_path / place).mkdir()
        folder = folder_with(tmp_path / place, "an older run's")
        run_press(folder, [sys.executable, str(left)], 30.0)
        assert len(read_press(folder)) == 2


def test_the_radius_is_the_last_states(tmp_path: Path) -> None:
    points = lines((1, [0.3, -0.1, -0.2]), (2, [0.31, 0.0, 0.1]))
    state = lambda moved: f" -4  DISP        4    1\n{moved} -3\n"
    first = state(lines((1, [0.05, 0, 0]), (2, [0.05, 0, 0])))
    last = state(lines((1, [0.02, 0, 0]), (2, [0.005, 0, 0])))
    text = f"    1C\n    2C\n{points} -3\n{first}{last} 9999\n"
    (tmp_path / "press.frd").write_text(text)
    assert read_radius(tmp_path) == pytest.approx(0.32)


@pytest.mark.ccx
def test_road_and_rim_balance(tmp_path: Path) -> None:
    """The tyre has no pressure, which CalculiX would count in part as the rim's reaction."""
    case = coarse_case("C3D8")
    angles = Angles(8.0, 16.0, 32.0, 2.0)
    texts = press_texts(case, [0.004], angles, 0.39215)
    pressureless = re.sub(r"^(CAVITY, P6, ).*$", r"\g<1>0.0", texts["press.inp"], flags=re.M)
    (tmp_path / "wheel.inp").write_text(texts["wheel.inp"])
    (tmp_path / "press.inp").write_text(pressureless)
    run_press(tmp_path, ["ccx"], 120)
    (pressed,) = read_press(tmp_path)
    assert pressed.force_N > 50
    assert pressed.rim_N == pytest.approx(pressed.force_N, rel=1e-4)
    assert 1e-4 < pressed.area_m2 < 0.01
    assert 0 < pressed.shear_N <= 0.5 * pressed.force_N / 2
    (patch,) = read_pressures(tmp_path)
    assert (patch[:, 0] < 1e-4).all() and (abs(patch[:, 1]) < 0.1).all()
    assert 0.2 < patch[:, 2].mean() * pressed.area_m2 / pressed.force_N < 5
    assert read_radius(tmp_path) == pytest.approx(0.39215 - 0.004, abs=5e-4)
