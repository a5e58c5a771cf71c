"""effects.json read back: what effects do to the modes, before and after a re-fit."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import Field, model_validator

from ..simulate.modes.label import Label
from .result import Column, PositiveNumber, Provenance, Result, ResultPart, Table, Wave


class EffectMode(ResultPart):
    """Change of a mode's frequency by an effect, as it comes and after the re-fit."""

    c: Wave
    m: Wave
    kind: str | None

    @property
    def label(self) -> Label:
        """[c, m]"""
        return Label(self.c, self.m, self.kind)

    before_percent: float | None
    after_percent: float | None


class EffectRow(ResultPart):
    """An effect at one pressure."""

    pressure_kPa: PositiveNumber
    modes: list[EffectMode]


class EffectResult(ResultPart):
    """An entry of effects.json."""

    title: str
    symbol: str
    unit: str
    value: float
    before_percent: float | None
    after_percent: float | None
    absorbed: float | None
    rows: Annotated[list[EffectRow], Field(min_length=1)]
    provenance: Provenance | None = None


class Effects(Result):
    """effects.json, which is a list; empty where no effect had an answer."""

    study, stem, heading = "effects", "effects", "Effects"

    entries: list[EffectResult]

    @model_validator(mode="before")
    @classmethod
    def _of_list(cls, content: Any) -> Any:
        first = content[0] if content and isinstance(content, list) else {}
        of = first.get("provenance") if isinstance(first, dict) else None
        return {"format": 1, "provenance": of, "entries": content}

    def tables(self) -> list[Table]:
        """One row an effect, at the pressure in the middle."""
        first = self.entries[0].rows
        middle = first[len(first) // 2].pressure_kPa
        labels = dict.fromkeys(m.label for e in self.entries for row in e.rows for m in row.modes)
        change, share = Column("left", "+.1f"), Column("absorbed, %", ".0f", 100.0)
        heads = [each for x in labels for each in (Column(x.said), change)]
        rows = []
        for each in self.entries:
            size = f"{each.symbol} = {each.value:.4g} {each.unit}".rstrip()
            modes = {m.label: m for r in each.rows if r.pressure_kPa == middle for m in r.modes}
            cells = []
            for label in labels:
                mode = modes.get(label)
                cells.append(change.cell(mode and mode.before_percent))
                cells.append(change.cell(mode and mode.after_percent))
            rows.append([each.title, size, *cells, share.cell(each.absorbed)])
        caption = (
            f"Change of frequency, %, at {middle:g} kPa: as the effect comes, and what is left once"
            " the variables are fitted again. Absorbed: the share of it, over all pressures, that"
            " calibration hides."
        )
        return [Table([Column("effect", ""), Column("", ""), *heads, share], rows, caption)]
