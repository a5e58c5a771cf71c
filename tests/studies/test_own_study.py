"""A study from outside is four files: its result, its figures, its command, and their names."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from ..test_from_outside import tyrecal
from .hertz import coarse_case

FILES = {
    "own_study-1.0.dist-info/entry_points.txt": """\
[tyrecal.studies]
weigh = own_study:Weights
[tyrecal.commands]
weigh = own_command:command
""",
    "own_study.py": '''\
from typing import Annotated

from tyrecal.simulate.evaluate.evaluator import Question
from tyrecal.studies.result import Column, Result, ResultPart, Table, csv_text


class Weight(ResultPart):
    """A design on the scales."""

    design: Annotated[str, Column("design", "")]
    mass_kg: Annotated[float, Column("mass kg")]


class Weights(Result):
    """weigh.json"""

    study, stem, heading = "weigh", "weigh", "Masses"
    figures = "own_figures:figures"

    rows: list[Weight]

    @classmethod
    def run(cls, given):
        """Every design on the scales."""
        ask = lambda values: given.evaluator.evaluate(Question(values)).mass_kg
        rows = [Weight(design=name, mass_kg=ask(each)) for name, each in given.designs.items()]
        return given.stamped(cls(format=1, rows=rows))

    def quantities(self):
        return {f"mass_kg {row.design}": row.mass_kg for row in self.rows}

    def csv(self):
        return csv_text(list(Weight.model_fields), (row.model_dump() for row in self.rows))

    def tables(self):
        return [Table(list(Weight.columns().values()), [row.cells() for row in self.rows])]

    def sentences(self):
        return [f"the {row.design} tyre weighs {row.mass_kg:.1f} kg" for row in self.rows]
''',
    "own_figures.py": """\
from tyrecal.report.figure import in_house_style, new_figure


@in_house_style
def figures(found):
    figure = new_figure(4, 3)
    axes = figure.add_subplot(ylabel="mass, kg")
    axes.bar([row.design for row in found.rows], [row.mass_kg for row in found.rows])
    return {"weigh": figure}
""",
    "own_command.py": '''\
import click

from own_figures import figures
from own_study import Weights
from tyrecal.cli import options
from tyrecal.studies.result import StudyInput


@click.command()
@options.case_argument
@options.study
def command(case, study):
    """Weigh the tyre of CASE."""
    loaded, values = study.load(case)
    evaluator = study.evaluator(loaded)
    output = study.run(loaded, "weigh", evaluator)
    result = Weights.run(StudyInput(loaded, evaluator, {"initial": values}))
    return study.present(output, result, figures(result))
''',
}


@pytest.mark.slow
def test_it_has_files_tables_figures_and_a_chapter(tmp_path: Path) -> None:
    site, out = tmp_path / "site", tmp_path / "out"
    for name, text in FILES.items():
        (site / name).parent.mkdir(parents=True, exist_ok=True)
        (site / name).write_text(text)
    (site / "own_study-1.0.dist-info/METADATA").write_text("Name: own-study\nVersion: 1.0\n")
    case = str(coarse_case(tmp_path))
    assert "Weigh the tyre of CASE" in tyrecal(site, "--help").stdout
    for _ in range(2):  # the second run takes the place of the first
        done = tyrecal(site, "weigh", case, "--output", str(out), "--report")
        assert done.returncode == 0, done.stderr
    assert "mass kg" in done.stdout and "the initial tyre weighs 12.8 kg" in done.stdout
    assert {"weigh.json", "weigh.csv", "weigh.png"} <= {path.name for path in out.iterdir()}
    result = json.loads((out / "weigh.json").read_text())
    assert result["provenance"]["solver"] == "bundled" and result["rows"][0]["mass_kg"] > 12
    assert (out / "weigh.csv").read_text().startswith("design,mass_kg\ninitial,12.79")
    page = (out / "report.html").read_text()
    assert "<h2>Masses</h2>" in page and ">mass, kg</text>" in page and ">12.80</td>" in page
    assert "The initial tyre weighs 12.8 kg." in page
    batch = tyrecal(
        site, "batch", case, "--studies", "modes,weigh", "--output", str(tmp_path / "b")
    )
    assert batch.returncode == 0, batch.stderr
    (entry,) = json.loads((tmp_path / "b/batch.json").read_text())["cases"]
    assert entry["studies"]["weigh"]["quantities"] == {
        "mass_kg initial": result["rows"][0]["mass_kg"]
    }
