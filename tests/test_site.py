"""The documentation site has every guide, and its reference every key, effect and keyword.

`.ci/run` builds it; these tests compare without building.
"""

from __future__ import annotations

import re
import sys
from typing import Any

import pytest
from pydantic import BaseModel
from tyrecal_solvers.language.table import RULES

from tyrecal import api
from tyrecal.studies import result_types
from tyrecal.studies.effects import EffectResult
from tyrecal.studies.result import Provenance
from tyrecal.tyre.case.schema import Case
from tyrecal.tyre.effects import catalogue

from .cli.test_conventions import commands
from .conftest import CASES, ROOT

SITE = CASES / "site"
sys.path.insert(0, str(SITE))
import notebook  # noqa: E402  they are where Sphinx looks for them
import reference  # noqa: E402


def properties(model: type[BaseModel]) -> set[str]:
    """The keys of a file with this content, those of its parts too, by its JSON schema."""
    schema = model.model_json_schema()
    parts = [schema, *schema.get("$defs", {}).values()]
    return {key for part in parts for key in part.get("properties", {})}


def last(path: str) -> str:
    """The last key of a path."""
    return re.sub(r"^.*\.(?!\d)|\[\]", "", path)


def test_every_page_is_in_the_contents() -> None:
    """And every entry of the contents is a page."""
    contents = (SITE / "index.md").read_text(encoding="utf-8")
    blocks = re.findall(r"```{toctree}\n(.*?)```", contents, re.S)
    lines = [line for block in blocks for line in block.splitlines() if line[:1] not in ":"]
    names = [re.sub(r".*<(.*)>", r"\1", line) for line in lines]
    folders = (".", ".github", "cases", "cases/site", "solvers", "tests", "tests/benchmarks")
    pages = {path for folder in folders for path in (ROOT / folder).glob("*.md")}
    pages |= {*SITE.glob("*.rst")}
    assert {(SITE / name).resolve() for name in names} == {
        path.with_suffix("") for path in pages if path != SITE / "index.md"
    }


def test_the_page_of_keys_is_the_codes() -> None:
    """`python cases/site/reference.py` writes it."""
    assert reference.CASE_KEYS.read_text(encoding="utf-8") == reference.case_keys()


def test_every_key_of_a_case_has_its_entry() -> None:
    keys = reference.case_entries()
    assert {last(path) for path in keys} == properties(Case)
    assert not [path for path, key in keys.items() if not key.meaning]
    groups = {"keys", "list", "true or false"}
    rows = map(reference.case_row, keys.values())
    assert not [row for row in rows if not row[-1] and row[2] not in groups]


def test_usual_ranges_are_those_that_refusals_state() -> None:
    density, angle = "materials.NAME.density_kg_per_m3", "rebar_layers.NAME.angle_deg"
    assert reference.usual_range("targets.modes[].weight") == "0, or 0.0001 to 10000"
    assert reference.usual_range(density) == "500 to 9000, rubber 700 to 2500"
    assert reference.usual_range(angle) == "carcass -30 to 30, belt 25 to 155"
    assert not reference.usual_range("name")


@pytest.mark.parametrize("study", [*result_types(), "an effect"])
def test_every_key_of_a_result_has_its_entry(study: str) -> None:
    model = {**result_types(), "an effect": EffectResult}[study]
    keys = [*reference.entries(model), *reference.entries(Provenance)]
    assert properties(model) <= {last(key.path) for key in keys}
    assert not [key.path for key in keys if not key.meaning]


def test_every_effect_has_its_picture() -> None:
    shown = reference.effects()
    assert shown.count("<svg ") == len(catalogue())
    assert all(f"({id})=" in shown for id in catalogue())


def test_every_keyword_that_is_honoured_has_its_entry() -> None:
    shown = reference.keywords()
    honoured = [name for name, rule in RULES.items() if rule.options_at or rule.is_output]
    assert not [name for name in honoured if f"`*{name}`" not in shown]


def test_every_public_function_has_an_example() -> None:
    functions = [name for name in api.__all__ if name.islower()]
    assert len(functions) > 10
    assert not [name for name in functions if ">>>" not in (getattr(api, name).__doc__ or "")]


def test_no_option_is_hidden() -> None:
    """The page of commands has all others."""
    options = [each for command in commands().values() for each in command.params]
    assert len(options) > 100
    assert not [each.name for each in options if getattr(each, "hidden", False)]


def test_every_table_is_on_a_page() -> None:
    texts = "".join(path.read_text(encoding="utf-8") for path in SITE.glob("*.md"))
    assert {*re.findall(r"\[\[(.*)\]\]", texts)} == {*reference.TABLES}


def numbers_in(outputs: list[dict[str, Any]]) -> list[float]:
    """Numbers that outputs of a cell show; pictures have none."""
    data = [each.get("data", {"text/plain": each.get("text", "")}) for each in outputs]
    text = "\n".join(each.get("text/html") or each["text/plain"] for each in data)
    text = re.sub(r"<style.*?</style>|<Picture.*?>|tyre \w+, ", "", text, flags=re.S)
    return [float(x) for x in re.findall(r"-?\d+\.?\d*(?:e[-+]\d+)?", text)]


@pytest.mark.slow
def test_the_notebook_shows_the_numbers_of_a_new_run(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its cells run in order; a last digit that is shown may differ by one."""
    pytest.importorskip("pandas")
    monkeypatch.chdir(ROOT)
    stored, names = notebook.read(), dict[str, Any]()
    assert notebook.NOTEBOOK.stat().st_size < 150_000
    for count, cell in enumerate(notebook.code_cells(stored), start=1):
        anew = notebook.run(cell["source"], names, count)
        kinds = [sorted(each.get("data", ["text"])) for each in cell["outputs"]]
        assert [sorted(each.get("data", ["text"])) for each in anew] == kinds
        old, new = numbers_in(cell["outputs"]), numbers_in(anew)
        assert new == pytest.approx(old, rel=2e-3, abs=0.011)
    assert count > 4
