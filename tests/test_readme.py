"""Every command of the README and the guides runs, on what the commands above it have made.

One ```sh block is one test. The README's run as they stand; the other guides' on the coarse mesh of
their cases, in a fifth of the time. Lines of a ```text block right below are lines of the output.
"""

from __future__ import annotations

import io
import json
import os
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Callable
from contextlib import chdir, redirect_stdout
from pathlib import Path

import pytest

from tyrecal.tyre.effects import catalogue
from tyrecal.version import BUILD_SITE

from .cli.test_cli import run
from .solved import solved_once as solved_once
from .studies.page_steps import of_fit
from .studies.pages import differences, recorded

ROOT = Path(__file__).parents[1]
GUIDES = [
    "README.md",
    "cases/README.md",
    "cases/glossary.md",
    "cases/own_tyre.md",
    "cases/own_deck.md",
    "cases/sampling.md",
    "cases/diagnosis.md",
    "cases/blind.md",
    "cases/own_effect.md",
    "cases/own_solver.md",
    "cases/own_template.md",
    "cases/python.md",
    "cases/theory.md",
    "cases/batch.md",
    "cases/cluster.md",
    "cases/measured_data.md",
    "cases/paper.md",
    "cases/real_data.md",
    "cases/site/tutorial.md",
    "solvers/README.md",
]
PACKAGED = ("ccx", "chromedriver", "fish")  # by Debian: CI installs them, tests do without
OWN_SETUP = "python3 -m venv"  # the two commands that set themselves up; CI runs the second
MAKERS = {  # first words of blocks whose files those below them read
    "README.md": ["tyrecal fit cases/p235_75r17.yaml\n"],
    "cases/own_template.md": ["mkdir -p cases/my_templates"],
    "cases/measured_data.md": ["tyrecal measured import "],
    "cases/site/tutorial.md": ["tyrecal ", "for "],
}
QUICK = [  # first words of blocks of the README that the quick set runs; they need no block above
    "tyrecal init"
]


def examples(guide: str) -> dict[str, str]:
    """The guide's ```sh blocks without their set-up, each with the output that the guide shows.

    The command that runs the tests is left out.
    """
    text = (ROOT / guide).read_text()
    pairs = re.findall(r"```sh\n(.*?)```\n(?:```text\n(.*?)```)?", text, re.S)
    plain = {re.sub(rf"{OWN_SETUP}.*&& .venv/bin/", "", block): output for block, output in pairs}
    return {block: output for block, output in plain.items() if OWN_SETUP not in block}


def blocks(guide: str) -> list[str]:
    return list(examples(guide))


def makes(guide: str, block: str) -> bool:
    return block.startswith(tuple(MAKERS.get(guide, ())))


def marks(guide: str, block: str) -> list[pytest.MarkDecorator]:
    needs = {"calculix": pytest.mark.ccx, "--scheduler cases": pytest.mark.cluster}
    chosen = [mark for word, mark in needs.items() if word in block]
    quick = guide == "README.md" and block.startswith(tuple(QUICK))
    return [*chosen, *([] if quick else [pytest.mark.guide])]


def parameters() -> list[object]:
    return [
        pytest.param(
            guide, number, marks=marks(guide, block), id=f"{guide}-{number}-{block.split()[1]}"
        )
        for guide in GUIDES
        for number, block in enumerate(blocks(guide))
    ]


def execute(block: str, folder: Path) -> str:
    """The output of the block in a shell that stops at the first command that fails.

    Commands of tyrecal alone run in this process: to start another takes a second.
    """
    lines = block.replace("\\\n", " ").splitlines()
    if all(re.fullmatch(r"tyrecal [^|<>$;&*`]+", line) for line in lines):
        with chdir(folder), redirect_stdout(io.StringIO()) as printed:
            for line in lines:
                assert run(*shlex.split(line, comments=True)[1:]) == 0, line
        return printed.getvalue()
    environment = {**os.environ, "PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}"}
    done = subprocess.run(
        ["sh", "-e", "-c", block], cwd=folder, capture_output=True, text=True, env=environment
    )
    assert done.returncode == 0, f"{block}\n{done.stdout[-1500:]}{done.stderr[-1500:]}"
    return done.stdout


def single_blanks(text: str) -> list[str]:
    """The lines of a text, blanks in a row as one."""
    return [" ".join(line.split()) for line in text.splitlines()]


Clone = Callable[[str, int], tuple[Path, str]]


@pytest.fixture(scope="module")
def clone(tmp_path_factory: pytest.TempPathFactory) -> Clone:
    """The folder as the makers among a guide's first ``count`` blocks leave it, each run once, and
    the output of the last one.

    It is always the same one, since results know the path of their case.
    """
    top = tmp_path_factory.mktemp("guide")
    folder = top / "clone"
    kept: dict[tuple[str, ...], tuple[Path, str]] = {}

    def fresh(guide: str) -> Path:
        path = top / Path(guide).parent.name / Path(guide).stem
        shutil.copytree(ROOT / "cases", path / "cases")
        if guide != "README.md":
            for case in path.glob("cases/*.yaml"):
                case.write_text(re.sub(r"( level:) default\b", r"\1 coarse", case.read_text()))
        return path

    def after(guide: str, blocks: list[str]) -> tuple[Path, str]:
        name = (guide, *blocks)
        if name not in kept and blocks:
            output = execute(blocks[-1], after(guide, blocks[:-1])[0])
            kept[name] = shutil.copytree(folder, top / f"after {len(kept)} blocks"), output
        elif name not in kept:
            kept[name] = fresh(guide), ""
        made, output = kept[name]
        shutil.rmtree(folder, ignore_errors=True)
        return shutil.copytree(made, folder), output

    return lambda guide, count: after(
        guide, [block for block in blocks(guide)[:count] if makes(guide, block)]
    )


@pytest.fixture(scope="module")
def record(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One evaluation store for all guides, whose commands evaluate the same tyres again."""
    return tmp_path_factory.mktemp("record")


@pytest.mark.parametrize(("guide", "number"), parameters())
def test_commands_of(
    guide: str, number: int, clone: Clone, record: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if "tyrecal store" not in (ROOT / guide).read_text():  # which looks for the folder's own
        monkeypatch.setenv("TYRECAL_STORE", str(record))
    block = blocks(guide)[number]
    is_kept = makes(guide, block)
    output = clone(guide, number + 1)[1] if is_kept else execute(block, clone(guide, number)[0])
    lines = single_blanks(output)
    assert not set(single_blanks(examples(guide)[block])) - set(lines), lines


@pytest.mark.parametrize("guide", MAKERS)
def test_what_makes_files_for_others_is_in_the_guide(guide: str) -> None:
    for words in MAKERS[guide]:
        assert any(block.startswith(words) for block in blocks(guide)[:-1]), words


def test_the_quick_blocks_are_in_the_readme() -> None:
    for words in QUICK:
        assert any(block.startswith(words) for block in blocks("README.md")), words


def test_the_tutorial_names_the_planted_effect_and_predicts_better() -> None:
    """By its printed lines, which the tests of its blocks compare with the commands'."""
    text = (ROOT / "cases/site/tutorial.md").read_text()
    (planted,) = set(re.findall(r"--set effects\.(\w+=\S+)", text))
    id, value = planted.split("=")
    (title,) = re.findall(r"## Named: (.*)", text)
    assert title == catalogue()[id].title
    (size,) = re.findall(rf"\| {title} \| \S+ \| \S+ \((\S+) to (\S+)\) mm/kN", text)
    assert float(size[0]) < 1e6 * float(value) < float(size[1])
    before, after = re.findall(r"within 2 % of their targets \(rms (\S+) %\)", text)[-2:]
    assert float(after) < float(before) / 10


@pytest.mark.guide
def test_the_results_table_is_what_the_fit_gives(clone: Clone) -> None:
    """And every other figure of a document that this fit gives."""
    content = json.loads((clone("README.md", 1)[0] / "p235_75r17/fit.json").read_text("utf-8"))
    assert not list(differences({**recorded(), "fit": of_fit(content)}))


def test_the_error_in_the_reference_is_the_commands(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for path in (ROOT / "cases").glob("p235_75r17.*"):
        shutil.copy(path, tmp_path / path.name)
    case = (tmp_path / "p235_75r17.yaml").read_text(encoding="utf-8")
    (tmp_path / "my.yaml").write_text(case.replace("kPa: 240.0", "kPa: 2.4"), encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    assert run("validate", "my.yaml") == 2
    (shown,) = re.findall(r"^error: my.yaml.*", (ROOT / "cases/README.md").read_text(), re.M)
    assert shown in " ".join(capsys.readouterr().err.split())


@pytest.mark.guide
@pytest.mark.parametrize("guide", ["README.md", "cases/python.md", "cases/sampling.md"])
def test_python_of(guide: str, clone: Clone) -> None:
    (program,) = re.findall(r"```python\n(.*?)```", (ROOT / guide).read_text(), re.S)
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=clone(guide, 0)[0], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr[-1500:]
    assert len(done.stdout.splitlines()) >= 6


def test_ci_runs_the_readmes_test_command_then_what_it_leaves_out() -> None:
    lines = (ROOT / "README.md").read_text().splitlines()
    (test_command,) = [line for line in lines if OWN_SETUP in line and "pytest" in line]
    script = (ROOT / ".ci/run").read_text().splitlines()
    debians = tuple(f"  command -v {program} >/dev/null ||" for program in PACKAGED)
    asked_for = '  [ -z "${FENICS-}" ] ||'
    settings = "export PYTEST_ADDOPTS=--durations=25", "unset PYTHONDONTWRITEBYTECODE"
    aside = ("#", "  #", "set ", "cd ", *settings, *debians, asked_for)
    assert [line for line in script if line and not line.startswith(aside)] == [
        "(",
        ") & programs=$!",
        f"{test_command} || failed=1",
        ".venv-test/bin/pip install -q -e '.[docs]' || failed=1",
        f".venv-test/bin/{BUILD_SITE.replace(' -c', ' -W --keep-going -q -c')} & site=$!",
        ".venv-test/bin/python -m tests.versions & versions=$!",
        ".venv-test/bin/python -m tests.kernels || failed=1",
        "wait $versions || failed=1",
        "wait $site || failed=1",
        "wait $programs",
        '.venv-test/bin/pytest -n 4 -m "not quick" || failed=1',
        "exit ${failed:-0}",
    ]


def test_files_named_in_the_guides_exist() -> None:
    for guide in GUIDES:
        folder = (ROOT / guide).parent
        for link in re.findall(r"\]\(([^)#]+)\)", (ROOT / guide).read_text()):
            if not link.startswith("http"):
                assert (folder / link).exists(), f"{guide}: {link}"
