"""The sandbox in which deck templates run, and the one filter through which numbers pass."""

from __future__ import annotations

import math
from functools import lru_cache
from importlib.resources import files
from pathlib import Path
from typing import Any, Protocol

from jinja2 import BaseLoader, ChoiceLoader, Environment, FileSystemLoader, StrictUndefined
from jinja2.exceptions import SecurityError, TemplateSyntaxError
from jinja2.sandbox import ImmutableSandboxedEnvironment

from ..errors import InputError

TemplateNames = dict[str, Any]  # names that a template knows, and what they hold


class TemplateFailed(InputError):
    """A deck template is wrong or does what templates may not; one sentence with its place."""


def number(value: Any) -> str:
    """A finite number as text of at most 20 characters, ABAQUS's limit, good to 13 digits. Raises
    TemplateFailed."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise TemplateFailed(f"'{value}' is not a number")
    if not math.isfinite(value):
        raise TemplateFailed(f"{value} is not a finite number")
    return format(value, ".13g")


class _Inside(FileSystemLoader):
    """Templates of a folder; a link that leads out of it is refused, and any other file."""

    def get_source(self, environment: Environment, template: str) -> Any:
        if not template.endswith(".j2"):  # the tyre's hash has the text of these files only
            raise SecurityError(f"template '{template}' must have a name that ends in .j2")
        source = super().get_source(environment, template)
        root = Path(self.searchpath[0]).resolve()
        if not Path(source[1]).resolve().is_relative_to(root):
            raise SecurityError(f"template '{template}' leads out of its folder")
        return source


@lru_cache(maxsize=8)
def environment(dialect: str, own_folder: Path | None) -> Environment:
    """Templates of a dialect, the user's own in ``own_folder`` before the tool's."""
    shipped = Path(str(files("tyrecal_templates") / dialect))
    loaders: list[BaseLoader] = [_Inside(shipped)]
    if own_folder is not None:
        loaders.insert(0, _Inside(own_folder))
    made = ImmutableSandboxedEnvironment(
        loader=ChoiceLoader(loaders),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        auto_reload=own_folder is not None,
    )
    made.filters["number"] = number
    return made


class Templates(Protocol):
    """Templates that are rendered elsewhere, see `simulate.deck.template_process`."""

    def render(self, template: str, names: TemplateNames) -> str:
        """The text of a template. Raises TemplateFailed."""


def render(env: Environment | Templates, template: str, names: TemplateNames) -> str:
    """The text of a template. Raises TemplateFailed."""
    if not isinstance(env, Environment):
        return env.render(template, names)
    try:
        return env.get_template(template).render(names)
    except TemplateFailed as error:
        raise TemplateFailed(f"template '{template}': {error}") from None
    except TemplateSyntaxError as error:
        raise TemplateFailed(f"template '{error.name}', line {error.lineno}: {error}") from None
    except Exception as error:  # whatever the user's own template runs into
        raise TemplateFailed(
            f"template '{template}'{_place(error, template)}: {type(error).__name__}: {error}"
        ) from None


def _place(error: BaseException, template: str) -> str:
    """Line of the template in the traceback, which jinja2 rewrites to point there."""
    lines = []
    trace = error.__traceback__
    while trace is not None:
        if trace.tb_frame.f_code.co_filename.endswith(template):
            lines.append(trace.tb_lineno)
        trace = trace.tb_next
    return f", line {lines[-1]}" if lines else ""
