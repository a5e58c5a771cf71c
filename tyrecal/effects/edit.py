"""Ways in which effects change a case."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from pydantic import BaseModel

from ..case import Case, LoadedCase
from ..case.schema import Rubber


def changed(loaded: LoadedCase, **parts: Any) -> LoadedCase:
    """The case with whole parts of it (``materials=...``) replaced."""
    case = Case.model_validate({**loaded.case.__dict__, **parts})
    raw = {**loaded.raw, **{key: _plain(value) for key, value in parts.items()}}
    return replace(loaded, case=case, raw=raw)


def with_part(part: Any, **values: Any) -> Any:
    """A part of the case with some of its values replaced, and judged."""
    return type(part).model_validate({**part.__dict__, **values})


def scaled_rubbers(loaded: LoadedCase, factor: float) -> LoadedCase:
    """All rubbers' C10 and C01 times ``factor``; the bulk modulus 2 / D1 stays."""
    materials = {
        name: with_part(m, C10_Pa=factor * m.C10_Pa, C01_Pa=factor * m.C01_Pa)
        if isinstance(m, Rubber)
        else m
        for name, m in loaded.case.materials.items()
    }
    return changed(loaded, materials=materials)


def _plain(value: Any) -> Any:
    if isinstance(value, BaseModel):
        return value.model_dump(exclude_none=True)
    if isinstance(value, dict):
        return {key: _plain(entry) for key, entry in value.items()}
    return [_plain(entry) for entry in value] if isinstance(value, list) else value
