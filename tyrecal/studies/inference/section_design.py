"""The design of a case whose section may be a little off: fields are numbers in addition to its
own."""

from __future__ import annotations

from collections.abc import Mapping

from ...simulate.deck.tyre_design import TyreDesign
from ...tyre.case import LoadedCase
from .section_fields import SectionField, moved

FIELD_STEP = 0.01  # standard deviations to either side, to see how nodes move with a field


class SectionDesign(TyreDesign):
    """A case at values of its numbers and, each 0, of fields of its meridian and its gauges by
    name: they are asked for slopes alone, which are those of the nodes that they move."""

    def __init__(
        self,
        case: LoadedCase,
        fields: Mapping[str, SectionField],
        values: Mapping[str, float] | None = None,
        plain: LoadedCase | None = None,
    ):
        given = dict(values or {})
        super().__init__(case, {k: v for k, v in given.items() if k not in fields}, plain)
        self.fields, self.values = fields, given

    def at(self, values: Mapping[str, float]) -> SectionDesign:
        """The case with these values. Raises ValueError."""
        return SectionDesign(self.case, self.fields, values, self.plain)

    def neighbour(self, name: str, side: int) -> tuple[TyreDesign, float]:
        """Neighbour of the design, as of a number of the case."""
        if name not in self.fields:
            return super().neighbour(name, side)
        amount = side * FIELD_STEP
        return TyreDesign(moved(self.case, self.fields[name], amount), {}, self.plain), amount
