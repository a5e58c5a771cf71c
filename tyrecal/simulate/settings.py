"""Settings that belong to the user and not to a case: the programs of solvers, and defaults of
options.

A case may come from anybody, so it names no program. These do, the first that is there: the option
``--solver-command``, the environment variable of COMMAND, ``commands`` of the settings file.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

from ..errors import InputError
from .program import resolve_program, split_command

if TYPE_CHECKING:
    from pydantic import BaseModel

SETTINGS_VARIABLE = "TYRECAL_SETTINGS"  # variable that names another settings file; empty: none
COMMAND = "TYRECAL_SOLVER_COMMAND"  # variable with the command of the solver that is used
SettingsModel = TypeVar("SettingsModel", bound="BaseModel")


def place() -> Path | None:
    """The settings file, whether it is there or not; None where there shall be none."""
    if SETTINGS_VARIABLE in os.environ:
        return Path(os.environ[SETTINGS_VARIABLE]) if os.environ[SETTINGS_VARIABLE] else None
    from platformdirs import user_config_path

    return user_config_path("tyrecal", appauthor=False) / "settings.yaml"


def typed(path: Path, kind: type[SettingsModel]) -> SettingsModel:
    """A YAML file as a model of pydantic. Raises InputError: a sentence a mistake, its line."""
    from pydantic import ValidationError

    from ..tyre.case.document import read_document
    from ..tyre.case.shape import explain

    document = read_document(path)
    if document.data is None or document.mistakes:
        raise InputError("\n".join(str(each) for each in document.mistakes))
    try:
        return kind.model_validate(document.data)
    except ValidationError as error:
        for keys, message in explain(error, known=kind.model_fields):
            document.add(keys, message)
        raise InputError("\n".join(str(each) for each in document.mistakes)) from None


def settings() -> Any:
    """The user's settings: ``commands`` {solver: words}; ``jobs``, ``solver``, ``output``, None
    where they are not set; ``mode_names`` {a laboratory's name: label}. Raises InputError."""
    path = place()
    if path is None or (SETTINGS_VARIABLE not in os.environ and not path.exists()):
        return _read(None, 0.0)
    return _read(path, path.stat().st_mtime if path.exists() else 0.0)


@lru_cache(maxsize=1)
def _read(path: Path | None, changed: float) -> Any:
    """The settings of a file, checked; ``changed``, its time, only makes another key of the cache.
    Raises InputError."""
    from pydantic import BaseModel, ConfigDict, Field

    from ..tyre.case.parts import Name

    class Settings(BaseModel):
        model_config = ConfigDict(extra="forbid", strict=True)

        commands: dict[Name, str | list[str]] = Field(default_factory=dict)
        jobs: Annotated[int, Field(ge=1, le=256)] | None = None
        solver: Name | None = None
        output: str | None = None
        mode_names: dict[str, str] = Field(default_factory=dict)

    content = typed(path, Settings) if path else Settings()
    for solver, command in content.commands.items():
        words(command, f"{path}: commands.{solver}", here=False)
    if content.output is not None and not Path(content.output).expanduser().is_absolute():
        raise InputError(
            f"{path}: output is {content.output}: must be a whole path or begin with ~"
        )
    return content


def root() -> Path:
    """The folder in which folders of results are made: the present one, unless the user has set
    another. Raises InputError."""
    folder = settings().output
    return Path(folder).expanduser() if folder else Path()


def words(command: str | Sequence[str], origin: str, here: bool = True) -> list[str]:
    """A command's words, its program as a whole path (`resolve_program`). ``here``: a relative path
    starts in the present folder, else it is refused. Raises InputError."""
    try:
        parts = split_command(command) if isinstance(command, str) else list(command)
    except ValueError:
        parts = []
    if not parts or not all(isinstance(word, str) and word for word in parts):
        raise InputError(f"{origin} is {command!r}: must be a command, or a list of its words")
    program = os.path.expanduser(parts[0])  # noqa: PTH111  Path raises where nobody is named so
    if not here and os.path.dirname(program) and not os.path.isabs(program):  # noqa: PTH117, PTH120
        raise InputError(f"{origin} is {command!r}: must be a name or a whole path")
    return resolve_program(parts)


def command_of(solver: str) -> tuple[list[str], str]:
    """The command that the user has set for ``solver``, and where; empty where nowhere.

    Raises InputError."""
    if given := os.environ.get(COMMAND):
        return words(given, COMMAND), COMMAND
    if solver in (commands := settings().commands):
        return words(commands[solver], f"{place()}: commands.{solver}", here=False), str(place())
    return [], ""
