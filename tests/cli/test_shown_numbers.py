"""Numbers, units and verdict sentences on the screens of commands; other wording is not pinned."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest

from tyrecal.measured.tables import read_measurements
from tyrecal.report import figure as figure_module

from ..tyre import own_decks
from .test_cli import run


def test_a_check_of_a_deck_prints_what_it_holds(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The numbers are those that the deck of `own_decks` states."""
    path = tmp_path / "tyre.inp"
    path.write_text(own_decks.plain())
    assert run("deck", "--check", str(path)) == 0
    text = capsys.readouterr().out
    assert run("deck", "--check", str(path), "--json") == 0
    content = json.loads(capsys.readouterr().out)
    rim, crown, cavity = content["rim"], content["crown"], content["cavity"]
    for words in (
        "units m, kg, s, Pa; " + f"{content['mass_kg']:.2f} kg",
        f"{content['nodes']} nodes",
        f"holds {rim['nodes']} nodes, up to r = {1e3 * rim['radius_m']:.1f} mm",
        f"surface {cavity['surface']}, {cavity['faces']} faces, {content['pressure_kPa']:g} kPa",
        f"{2e3 * crown['half_width_m']:.1f} mm wide, radius {1e3 * crown['radius_m']:.1f} mm",
        "it has no rebar",
    ):
        assert words in text, words
    for ply in content["plies"]:
        spacing = f"{1e3 * ply['spacing_m']:.4g} mm" if "spacing_m" in ply else "degrees"
        area = f"{1e6 * ply['area_m2']:.4g} mm²"
        pattern = rf"ply {ply['name']} on {ply['set']}.*{area}.*{spacing}, {ply['angle_deg']:g} deg"
        assert re.search(pattern, text), pattern
    for section in content["sections"]:
        assert f"section {section['set']}: {section['material']} (" in text
    for name, value in content["numbers"].items():
        assert f"  {name} = {value:g}\n" in text


def test_a_picture_of_init_is_the_section_of_the_case(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Both sides of it, from bead to crown, in mm, under its name; of a deck likewise."""
    drawn: list[tuple[Any, Path]] = []
    monkeypatch.setattr(figure_module, "save", lambda figure, path: drawn.append((figure, path)))
    monkeypatch.chdir(tmp_path)
    assert run("init", "205/60R15") == 0
    Path("tyre.inp").write_text(own_decks.plain())
    assert run("init", "--deck", "tyre.inp", "--figure-format", "svg") == 0
    assert run("init", "225/45R17", "--no-pictures") == 0
    assert [path.name for _, path in drawn] == ["205_60r15.png", "tyre.svg"]
    text = capsys.readouterr().out
    assert "section drawn in 205_60r15.png" in text and "section drawn in tyre.svg" in text
    axes = drawn[0][0].axes[0]
    assert drawn[0][0].get_suptitle().startswith("205/60R15")
    assert "outer diameter 627.0 mm, section width 208.6 mm" in axes.get_title()
    points = [p.vertices for c in axes.collections for p in c.get_paths() if len(p.vertices)]
    lowest = min(each.min(0)[0] for each in points), min(each.min(0)[1] for each in points)
    highest = max(each.max(0)[0] for each in points), max(each.max(0)[1] for each in points)
    assert highest == pytest.approx((104.3, 313.5), abs=0.1)
    assert lowest == pytest.approx((-104.3, 191.7), abs=0.5)


@pytest.mark.parametrize(
    ("option", "value", "sigma"),
    [
        (["--sigma-percent", "0.5"], 66.0, 0.33),
        (["--sigma-percent", "0.5", "--floor-percent", "2"], 66.0, 1.32),
    ],
)
def test_options_of_import_reach_the_numbers(
    option: list[str], value: float, sigma: float, tmp_path: Path
) -> None:
    """The one mode of the table is [2,1] at 66 Hz, without a sigma."""
    table, out = tmp_path / "t.csv", tmp_path / "m.csv"
    table.write_text('mode,frequency_Hz\n"[2,1]",66.0\n')
    given = ["--pressure-kPa", "200", *option, "--output", str(out), "--no-pictures"]
    assert run("measured", "import", str(table), *given) == 0
    (row,) = read_measurements(out)
    assert (row.value, row.pressure_kPa) == (value, 200.0)
    assert row.sigma == pytest.approx(sigma)
