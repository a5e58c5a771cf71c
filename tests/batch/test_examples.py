"""The workflow and the settings that are shipped: linted, read, their commands run."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from ruamel.yaml import YAML

from tyrecal.simulate.evaluate.cluster import jobs_of, read_settings
from tyrecal.version import BUILD_SITE

from ..conftest import CASES, ROOT

WORKFLOW = CASES / "ci/tyres.yml"
OWN = ROOT / ".github/workflows/checks.yml"
BIN = Path(sys.executable).parent
RULES = (
    "{extends: default, rules: {document-start: disable, line-length: {max: 120},"
    " comments: {min-spaces-from-content: 1}}}"
)


def steps() -> list[dict]:
    return YAML(typ="safe").load(WORKFLOW.read_text())["jobs"]["batch"]["steps"]


@pytest.mark.parametrize(
    "command",
    [
        ["yamllint", "--strict", "-d", RULES, str(CASES / "ci"), str(CASES / "cluster")],
        ["yamllint", "--strict", "-d", RULES, str(OWN)],
        [
            "check-jsonschema",
            "--builtin-schema",
            "vendor.github-workflows",
            *map(str, (WORKFLOW, OWN)),
        ],
    ],
)
def test_linted(command: list[str]) -> None:
    done = subprocess.run([BIN / command[0], *command[1:]], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr


def test_own_workflow_runs_what_ci_runs() -> None:
    commands = [
        step["run"]
        for job in YAML(typ="safe").load(OWN.read_text())["jobs"].values()
        for step in job["steps"]
        if "run" in step
    ]
    assert "bash .ci/run" in commands
    assert BUILD_SITE.replace(" -c", " -W --keep-going -c") in commands


@pytest.mark.slow
def test_the_workflows_commands_pass_on_the_shipped_cases(tmp_path: Path) -> None:
    shutil.copytree(CASES, tmp_path / "cases")
    environment = {**os.environ, "PATH": f"{BIN}:{os.environ['PATH']}"}
    commands = [step["run"] for step in steps() if "run" in step]
    install, *rest = commands
    assert install.startswith("pip install .") and len(rest) == 2
    for command in rest:
        done = subprocess.run(
            ["bash", "-e", "-c", command],
            cwd=tmp_path,
            env=environment,
            capture_output=True,
            text=True,
        )
        assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
    assert " 0 of " in f" {done.stdout}" and "new" not in done.stdout
    kept = next(step for step in steps() if "upload-artifact" in step.get("uses", ""))
    for pattern in kept["with"]["path"].split():
        assert list(tmp_path.glob(pattern)), pattern


@pytest.mark.parametrize("name", ["slurm", "pbs", "here"])
def test_settings_are_read_and_make_jobs(name: str) -> None:
    settings = read_settings(CASES / f"cluster/{name}.yaml")
    settings.interface = None  # this machine has no ib0
    with jobs_of(settings) as cluster:
        assert settings.python in cluster.job_script()


def test_the_gitlab_example_is_yaml_with_a_command_that_exists() -> None:
    (block,) = (ROOT / "cases/batch.md").read_text().split("```yaml\n")[1:]
    script = YAML(typ="safe").load(block.partition("```")[0])["tyres"]["script"]
    options = [word for word in script[-1].split() if word.startswith("--")]
    completed = subprocess.run([BIN / "tyrecal", "batch", "--help"], capture_output=True, text=True)
    assert options and all(f"{option} " in completed.stdout for option in options)
