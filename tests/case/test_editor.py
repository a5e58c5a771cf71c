"""The schema by which editors check a case accepts shipped cases, and sees slips of keys."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import jsonschema
import pytest
from ruamel.yaml import YAML

from tyrecal.tyre.case.editor import EDITOR_LINE, SCHEMA_FILE, case_schema, with_editor_line

from ..cli.test_cli import run
from ..conftest import CASES

VALIDATOR = jsonschema.Draft202012Validator(json.loads(case_schema()))


def content(path: Path) -> dict[str, Any]:
    """A case as an editor reads it."""
    return YAML(typ="safe").load(path.read_text(encoding="utf-8"))


@pytest.mark.parametrize("path", [*CASES.glob("*.yaml"), CASES / "ring_3d/ring.yaml"])
def test_shipped_cases_are_accepted(path: Path) -> None:
    VALIDATOR.validate(content(path))


@pytest.mark.parametrize(
    "slip",
    [
        {"presure_kPa": 240.0},
        {"pressure_kPa": "240"},
        {"pressure_kPa": 2000.0},
        {"road": {"wheel": "hold"}},
        {"analysis": {"highest_harmonic": 21}},
        {"road": {"elastic_slip_m": 0.0}},
        {"materials": {"rubber": {"kind": "rubber", "C10_Pa": 1e6}}},
    ],
)
def test_slips_are_seen(slip: dict[str, Any]) -> None:
    assert not VALIDATOR.is_valid(content(CASES / "p235_75r17.yaml") | slip)


def test_every_key_is_explained() -> None:
    schema = json.loads(case_schema())
    parts = [schema, *schema["$defs"].values()]
    keys = [entry for part in parts for entry in part["properties"].values()]
    assert len(keys) > 120 and all(entry["description"] for entry in keys)
    assert "title" not in schema


def test_a_written_case_names_the_schema_next_to_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run("init", "205/60R15", "--no-pictures", "--quiet") == 0
    assert run("diagnose", "205_60r15.yaml", "--add", "cap_ply=1e6", "--quiet") == 0
    for name in ("205_60r15.yaml", "205_60r15_cap_ply.yaml"):
        assert (tmp_path / name).read_text(encoding="utf-8").count(EDITOR_LINE) == 1
        VALIDATOR.validate(content(tmp_path / name))
    assert (tmp_path / SCHEMA_FILE).read_text(encoding="utf-8") == case_schema()


def test_the_line_comes_once() -> None:
    assert with_editor_line(with_editor_line("format: 1\n")) == EDITOR_LINE + "format: 1\n"
    dos = (EDITOR_LINE + "format: 1\n").replace("\n", "\r\n")
    assert with_editor_line(dos) == dos
