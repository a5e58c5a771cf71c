"""Contents of the package: every package of the tree and all its files; size and licences of its
requirements."""

from __future__ import annotations

import fnmatch
import re
import tomllib
from importlib import metadata
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from ruamel.yaml import YAML

import tyrecal

from . import versions
from .conftest import ROOT

# tyrecal is on no package index: one that has the name would install a stranger's project
BY_NAME = re.compile(r"""pip3? install(?: +-\S+)* +["']?tyrecal|["']tyrecal\[""")
TEXTS = {".py", ".md", ".j2", ".yaml", ".yml", ".toml", ".sh", ".ipynb"}
PYPROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())
PROJECT, SETUP = PYPROJECT["project"], PYPROJECT["tool"]["setuptools"]
ASIDE = {"__pycache__", ".mypy_cache", ".ruff_cache"}
FOLDERS = {name: ROOT / folder for name, folder in SETUP["package-dir"].items()}


def name_of(folder: Path) -> str:
    """The package that a folder of the tree ships as."""
    for package, top in FOLDERS.items():
        if folder.is_relative_to(top):
            return ".".join([package, *folder.relative_to(top).parts])
    raise AssertionError(folder)


def files() -> list[Path]:
    return [
        path
        for top in FOLDERS.values()
        for path in top.rglob("*")
        if path.is_file() and not ASIDE & set(path.parts)
    ]


def test_every_package_of_the_tree_ships() -> None:
    tree = {name_of(path.parent) for path in files() if path.suffix == ".py"}
    assert sorted(tree) == sorted(SETUP["packages"])


def test_every_file_of_a_package_ships() -> None:
    data = SETUP["package-data"]
    for path in files():
        if path.suffix not in (".py", ".md"):
            package = next(each for each in path.parents if (each / "__init__.py").exists())
            patterns, inside = data.get(name_of(package), []), path.relative_to(package)
            assert any(fnmatch.fnmatch(str(inside), p) for p in patterns), path


def core() -> list[metadata.Distribution]:
    """The packages that `pip install .` installs: tyrecal, all it needs, all that those need."""
    return list(closure(["tyrecal"]).values())


def closure(requirements: list[str]) -> dict[str, metadata.Distribution]:
    """Installed packages by name: those required, and all that they need in turn."""
    needed: dict[str, metadata.Distribution] = {}
    waiting = [*map(Requirement, requirements)]
    while waiting:
        requirement = waiting.pop()
        name = requirement.name.lower().replace("_", "-")
        if name in needed or (
            requirement.marker and not requirement.marker.evaluate({"extra": ""})
        ):
            continue
        needed[name] = metadata.distribution(requirement.name)
        waiting += map(Requirement, needed[name].requires or [])
    return needed


def licence(distribution: metadata.Distribution) -> str:
    """Licence as the package states it: an expression, else classifiers, else the first line of
    a text."""
    fields = distribution.metadata
    classifiers = [c for c in fields.get_all("Classifier") or [] if c.startswith("License ::")]
    text = (fields["License"] or "").strip().partition("\n")[0]
    return fields["License-Expression"] or "; ".join(classifiers) or text


@pytest.mark.parametrize("distribution", core(), ids=lambda d: str(d.name))
def test_no_part_of_the_core_is_under_the_gpl(distribution: metadata.Distribution) -> None:
    words = licence(distribution)
    assert words, distribution.name
    assert not re.search(r"\bA?GPL|(?<!Lesser )General Public License", words), words


def families(words: str) -> set[str]:
    """Families of licences that a text names."""
    names = {"Python Software Foundation": "PSF", "Mozilla": "MPL", "GNU": "GPL", "Public D": "CC0"}
    for name, short in names.items():
        words = words.replace(name, short)
    return set(re.findall("BSD|MIT|Apache|PSF|MPL|GPL|Zlib|CC0", words))


@pytest.mark.parametrize(
    "group", ["", *(each for each in PROJECT["optional-dependencies"] if each != "dev")]
)
def test_the_page_of_licences_is_what_the_packages_state(group: str) -> None:
    """Every package that a user installs, those of an extra if it is installed."""
    page = (ROOT / "cases/site/licences.md").read_text(encoding="utf-8")
    rows = dict(re.findall(r"^\| ([\w.-]+) \| .* \| (.*) \|$", page, re.M))
    required = PROJECT["optional-dependencies"][group] if group else PROJECT["dependencies"]
    names = {Requirement(each).name for each in required}
    assert names <= rows.keys()
    try:
        installed = closure(required)
    except metadata.PackageNotFoundError:
        pytest.skip(f"the extra '{group}' is not installed")
    stated = {name: licence(distribution) for name, distribution in installed.items()}
    assert not {n: words for n, words in stated.items() if families(words) != families(rows[n])}


def test_no_text_installs_tyrecal_by_its_name() -> None:
    assert BY_NAME.search("pip install -q tyrecal") and BY_NAME.search("'tyrecal[sample]'")
    texts = [ROOT / "README.md", ROOT / "pyproject.toml", ROOT / "CHANGELOG.md", ROOT / ".ci/run"]
    for folder in ("tyrecal", "solvers", "templates", "cases", "tests", ".github"):
        texts += [p for p in (ROOT / folder).rglob("*") if p.suffix in TEXTS]
    for path in texts:
        if path != Path(__file__):
            assert not BY_NAME.search(path.read_text(encoding="utf-8")), path


def test_every_requirement_states_its_lowest_version() -> None:
    """`python -m tests.versions` installs and runs these."""
    extras = PROJECT["optional-dependencies"]
    for each in map(Requirement, sum(extras.values(), PROJECT["dependencies"])):
        assert any(spec.operator in (">=", "==") for spec in each.specifier), each.name
    assert all((ROOT / path).is_file() for path in versions.TESTS)


def test_developers_have_every_extra_but_docs() -> None:
    extras = PROJECT["optional-dependencies"]
    assert {"cluster", "sample", "excel", "notebook", "docs", "dev"} == set(extras)
    tested = [packages for name, packages in extras.items() if name != "docs"]
    assert all(set(packages) <= set(extras["dev"]) for packages in tested)


def test_the_core_takes_at_most_350_megabytes() -> None:
    """The sum has all files of the core, compiled ones too; pip and setuptools belong to the
    environment."""
    size = sum(
        path.stat().st_size
        for distribution in core()
        for file in distribution.files or []
        if (path := Path(str(distribution.locate_file(file)))).is_file()
    )
    assert 1e8 < size < 350e6, size / 1e6


def test_heavy_packages_of_the_tests_are_not_in_the_core() -> None:
    names = {str(distribution.name).lower() for distribution in core()}
    assert not names & {"pytest", "mypy", "ruff", "hypothesis", "setuptools"}


def test_the_citation_is_one() -> None:
    """The fields that CFF 1.2.0 requires, and the facts of pyproject.toml."""
    citation = YAML(typ="safe").load((ROOT / "CITATION.cff").read_text())
    assert (
        citation["cff-version"] == "1.2.0"
        and citation["message"]
        and citation["type"] == "software"
    )
    assert citation["title"].startswith(PROJECT["name"] + ":")
    assert citation["version"] == PROJECT["version"] == tyrecal.__version__
    assert citation["license"] == "MIT" == PROJECT["license"]["text"]
    assert (ROOT / "LICENSE").read_text().startswith("MIT License\n")
    assert citation["abstract"] and citation["keywords"]
    for work in [citation, *citation["references"]]:
        assert work["title"] and work["authors"]
        assert all(
            set(a) in ({"name"}, {"family-names"}, {"family-names", "given-names"})
            for a in work["authors"]
        )
    for work in citation["references"]:
        assert work["type"] in ("article", "conference-paper") and 1990 < work["year"] < 2100


def test_changes_name_the_version() -> None:
    assert f"## {tyrecal.__version__}" in (ROOT / "CHANGELOG.md").read_text()
