"""Signatures of effects: what each does to the modes, before and after a re-fit (effects.json)."""

from __future__ import annotations

import inspect
import sys
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Annotated, Any, Self

import numpy as np
from pydantic import Field, model_validator

from ..files import Json
from ..simulate.evaluate.failure import EvaluationFailed
from ..simulate.modes.label import Label
from ..tyre.case import LoadedCase
from ..tyre.effects import Effect
from ..units import in_engineers_units
from .result import (
    Column,
    CsvRow,
    Failed,
    Notify,
    PositiveNumber,
    Provenance,
    Result,
    ResultPart,
    Table,
    Wave,
    rows_csv,
    silent,
)
from .signature import Plain, Signature, rms, stated_size


class EffectMode(ResultPart):
    """Change of a mode's frequency by an effect, as it comes and after the re-fit."""

    c: Wave
    m: Wave
    kind: str | None

    @property
    def label(self) -> Label:
        """[c, m]"""
        return Label(self.c, self.m, self.kind)

    before_percent: float | None  # change of the frequency; null: the mode was lost
    after_percent: float | None  # change that a new fit leaves


class EffectRow(ResultPart):
    """An effect at one pressure."""

    pressure_kPa: PositiveNumber
    modes: list[EffectMode]  # changes of the modes


class Refitted(ResultPart):
    """A variable before and after the re-fit, in its own unit."""

    before: float  # value before
    after: float  # value after

    @property
    def display(self) -> str:
        """How far it moves."""
        if not self.before:
            return f"{self.after - self.before:+.3g}"
        return f"{100 * (self.after / self.before - 1):+z.1f} %"


class CatalogueEntry(ResultPart):
    """An effect of the catalogue."""

    provenance: Provenance | None = None  # origin: see provenance below
    id: str  # name of the effect in files
    title: str  # name of the effect in words
    symbol: str  # symbol of the parameter
    unit: str  # unit of the parameter
    low: float  # lower end of the parameter's range
    high: float  # upper end of the parameter's range
    about: list[str]  # explanation, in paragraphs
    changes: list[str]  # keywords of the deck that it changes
    signature: str  # which modes move, which way and how far
    toggle: str  # the experiment that would prove it
    aliases: list[str]  # effects that frequencies alone hardly distinguish from it
    solvers: list[str]  # installed solvers that can express it

    @classmethod
    def of(
        cls, effect: Effect, solvers: Sequence[Mapping[str, Any]], case: LoadedCase | None = None
    ) -> CatalogueEntry:
        """``solvers``: those installed, as `solver.installed` says; case: of whose tyre the range
        is, a passenger tyre's by default."""
        low, high = effect.range_on(case) if case else (effect.low, effect.high)
        return cls(
            id=effect.id,
            title=effect.title,
            symbol=effect.symbol,
            unit=effect.unit,
            low=low,
            high=high,
            about=about(effect),
            changes=list(effect.changes),
            signature=effect.signature,
            toggle=effect.toggle,
            aliases=list(effect.aliases),
            solvers=[s["name"] for s in solvers if effect.within(s["capabilities"])],
        )


class EffectResult(CatalogueEntry):
    """An entry of effects.json."""

    value: float  # size of the effect
    mass_kg: float  # change of the tyre's mass
    before_percent: float | None  # rms change of the frequencies, over modes and pressures
    after_percent: float | None  # rms change that a new fit leaves
    absorbed: float | None  # share of the change that a new fit absorbs
    refitted: dict[str, Refitted]  # variables before and after the new fit
    rows: Annotated[list[EffectRow], Field(min_length=1)]  # changes at each pressure

    @property
    def size(self) -> str:
        """Its parameter and the value of it."""
        return f"{self.symbol} = {in_engineers_units(self.value, self.unit, 4)}"

    @property
    def words(self) -> str:
        """How large it is, and how much of it calibration hides."""
        words = f"{self.title}, {self.size}"
        if self.before_percent is None:
            return f"{words}: no mode is known with it"
        words += f": {self.before_percent:.1f} % (rms)"
        if self.after_percent is not None:
            words += f", {self.after_percent:.1f} % once the variables are fitted again"
        return words


class Effects(Result):
    """effects.json, which is a list; empty where no effect had an answer."""

    study, stem, heading = "effects", "effects", "Effects"
    figures = "tyrecal.report.signature:figures"

    rows: list[EffectResult]  # effects, each an entry of the list
    failed: list[Failed] = Field(default=[])  # effects without a solution

    @model_validator(mode="before")
    @classmethod
    def _of_list(cls, content: Any) -> Any:
        if not isinstance(content, list):
            return content
        first = content[0] if content and isinstance(content[0], dict) else {}
        return {"format": 1, "provenance": first.get("provenance"), "rows": content}

    def content(self) -> Any:
        return [each.model_dump(exclude_unset=True) for each in self.rows]

    def stamped(self, provenance: Json) -> Self:
        of = Provenance.model_validate(provenance)
        rows = [each.model_copy(update={"provenance": of}) for each in self.rows]
        return self.model_copy(update={"provenance": of, "rows": rows})

    def csv(self) -> str:
        keys = ["id", "value", "unit", "mass_kg", "before_percent", "after_percent", "absorbed"]
        return rows_csv([each.model_dump(include={*keys, "refitted"}) for each in self.rows])

    def csv_rows(self) -> dict[str, list[CsvRow]]:
        """The change of every mode."""
        modes: list[CsvRow] = [
            {"id": each.id, "pressure_kPa": row.pressure_kPa, **mode.model_dump()}
            for each in self.rows
            for row in each.rows
            for mode in row.modes
        ]
        return {"modes": modes}

    def summary(self) -> list[str]:
        return [each.words for each in self.rows]

    def tables(self) -> list[Table]:
        """How far each effect moves the modes, and the variables that follow it."""
        if not self.rows:
            return []
        percent, absorbed = Column("before %"), Column("absorbed %", ".1f", 100.0)
        mass = Column("kg", "+z.2f")
        rows = [
            [
                each.id,
                in_engineers_units(each.value, each.unit, 4),
                mass.cell(each.mass_kg),
                *map(percent.cell, (each.before_percent, each.after_percent)),
                absorbed.cell(each.absorbed),
                *(moved.display for moved in each.refitted.values()),
            ]
            for each in self.rows
        ]
        caption = (
            "rms change of all modes, before and after the best linear re-fit of the variables,"
            " and the change of the variables"
        )
        names = [Column(name) for name in self.rows[0].refitted]
        words = [Column("effect", ""), Column("size"), mass]
        return [Table([*words, percent, Column("after %"), absorbed, *names], rows, "", caption)]

    def numbers(self) -> list[Table]:
        """One row an effect, at the pressure in the middle."""
        first = self.rows[0].rows
        middle = first[len(first) // 2].pressure_kPa
        labels = dict.fromkeys(m.label for e in self.rows for row in e.rows for m in row.modes)
        change, share = Column("left", "+z.1f"), Column("absorbed, %", ".0f", 100.0)
        heads = [each for x in labels for each in (Column(x.display), change)]
        rows = []
        for each in self.rows:
            modes = {m.label: m for r in each.rows if r.pressure_kPa == middle for m in r.modes}
            cells = []
            for label in labels:
                mode = modes.get(label)
                cells.append(change.cell(mode and mode.before_percent))
                cells.append(change.cell(mode and mode.after_percent))
            rows.append([each.title, each.size, *cells, share.cell(each.absorbed)])
        caption = (
            f"Change of frequency, %, at {middle:g} kPa: before and after a re-fit of the"
            " variables. Absorbed: share of the change, over all pressures, that calibration"
            " hides."
        )
        return [
            Table([Column("effect", ""), Column("", ""), *heads, share], rows, "", caption, "modes")
        ]


def run(
    plain: Plain,
    entries: Sequence[CatalogueEntry],
    size: float | None = None,
    jobs: int = 1,
    notify: Notify = silent,
) -> tuple[Effects, list[Signature]]:
    """Each effect on the ``plain`` tyre: the result, and what it is made of.

    size: of all, None: each at the end of its range (`stated_size`).
    """
    sizes = {
        each.id: stated_size(each.id, plain.case) if size is None else size for each in entries
    }
    rows, failed, signatures = [], [], []
    for entry, signature in zip(entries, plain.signatures(sizes, jobs), strict=True):
        if isinstance(signature, EvaluationFailed):
            failed.append(Failed(design=entry.id, cause=signature.cause, words=signature.words))
            notify(entry.id, signature)
            continue
        rows.append(_effect_result(entry, signature, plain.values))
        signatures.append(signature)
        notify(entry.id, None)
    return Effects(rows=rows, failed=failed), signatures


def _effect_result(
    entry: CatalogueEntry, signature: Signature, values: Mapping[str, float]
) -> EffectResult:
    """``values``: of the variables before the re-fit."""
    change = lambda percent: float(percent) if np.isfinite(percent) else None
    return EffectResult(
        **entry.model_dump(exclude_unset=True),
        value=signature.value,
        mass_kg=signature.mass_kg,
        before_percent=rms(signature.before),
        after_percent=rms(signature.after),
        absorbed=signature.absorbed,
        refitted={
            name: Refitted(before=values[name], after=value)
            for name, value in signature.refitted.items()
        },
        rows=[
            EffectRow(
                pressure_kPa=pressure,
                modes=[
                    EffectMode(
                        **asdict(label), before_percent=change(before), after_percent=change(after)
                    )
                    for label, before, after in zip(signature.labels, *percents, strict=True)
                ],
            )
            for pressure, *percents in zip(
                signature.pressures_kPa, signature.before, signature.after, strict=True
            )
        ],
    )


def about(effect: Effect) -> list[str]:
    """Words of the effect's own file: what it is, and what it does to the case."""
    module = inspect.getdoc(sys.modules[effect.add.__module__]) or ""
    return [part for part in (module, inspect.getdoc(effect.add) or "") if part]
