"""The design of a case whose section may be a little off: fields are numbers in addition to its
own."""

from __future__ import annotations

from collections.abc import Mapping

from ...simulate.deck.tyre_design import DECK_STEP, TyreDesign
from ...tyre.case import LoadedCase
from .section_fields import SectionField, moved

FIELD_STEP = 0.01  # standard deviations to either side, to see how nodes move with a field


class SectionDesign(TyreDesign):
    """A case at values of its numbers and of fields of its meridian and its gauges, by name, in
    standard deviations. Sensitivities by a field are those by the nodes that it moves."""

    def __init__(
        self,
        case: LoadedCase,
        fields: Mapping[str, SectionField],
        values: Mapping[str, float] | None = None,
        plain: LoadedCase | None = None,
    ):
        given = dict(values or {})
        self.amounts = {k: v for k, v in given.items() if k in fields and v}
        for name, amount in self.amounts.items():
            case = moved(case, fields[name], amount)
        super().__init__(case, {k: v for k, v in given.items() if k not in fields}, plain)
        self.fields, self.values = fields, given

    @property
    def is_nominal(self) -> bool:
        """Whether nothing is set, and no field is off."""
        return not self.amounts and super().is_nominal

    def at(self, values: Mapping[str, float]) -> SectionDesign:
        """The case with these values. Raises ValueError."""
        return SectionDesign(self.case, self.fields, values, self.plain)

    def neighbour(self, name: str, side: int) -> tuple[TyreDesign, float]:
        """Neighbour of the design, as of a number of the case, and its step: of a field in standard
        deviations."""
        if name not in self.fields:
            return super().neighbour(name, side)
        amount = side * FIELD_STEP
        return TyreDesign(moved(self.case, self.fields[name], amount), {}, self.plain), amount

    def steps(self, name: str, value: float, step: float) -> list[float]:
        """Values for differences; a field's step is `FIELD_STEP` where that of others is
        `DECK_STEP`."""
        if name not in self.fields:
            return super().steps(name, value, step)
        return [value + side * step * FIELD_STEP / DECK_STEP for side in (1, -1)]
