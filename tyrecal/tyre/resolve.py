"""The tyre of a case, resolved once: its effects written in, its section meshed."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

from .case import Case, LoadedCase
from .case.kinds.stations import mesh_at_level, with_gauges_of
from .case.parts import Rubber
from .effects import EffectRefused, catalogue
from .own_deck.solver_deck import SolverDeck
from .plugins import IDS
from .section.mesh import SectionMesh
from .section.section import Section

# What parts of a tyre ask of a solver: the capability, and what it is for, in words.
CAPABILITIES = {
    "spindle": "a rim that moves",
    "frequency_modulus": "rubber with its modulus at each mode's frequency",
    "cavity": "the gas in the cavity",
    "coupled": "a mass, a spring or a splice that couples harmonics",
    "rotation": "a tyre that turns",
    "own_deck": "your own deck",
}


@dataclass(frozen=True, eq=False)
class Tyre:
    """A tyre as it is modelled: of all its effects none is left to apply."""

    written: LoadedCase
    """The case with its effects written into its other numbers."""

    @property
    def case(self) -> Case:
        """The numbers of the tyre."""
        return self.written.case

    @property
    def section(self) -> Section:
        """The section as drawn, before its gauges."""
        return self.written.section

    @cached_property
    def flat(self) -> SolverDeck:
        """The user's deck of the tyre's section. Raises InputError for a tyre without one."""
        return self.written.kind.flat(self.case)

    @cached_property
    def gauged(self) -> Section:
        """The section with its gauges applied."""
        return with_gauges_of(self.case, self.section)

    @cached_property
    def mesh(self) -> SectionMesh:
        """The mesh of the section at the chosen level, the same one for tyres that share it."""
        self.section  # noqa: B018  a tyre without one is refused
        return self.written.kind.mesh(self)

    @cached_property
    def needs(self) -> dict[str, str]:
        """Capabilities that a solver must have for this tyre, and what for, in words."""
        c = self.case
        rubbers = [m for m in c.materials.values() if isinstance(m, Rubber)]
        needed = {
            "spindle": c.rim.moves,
            "frequency_modulus": any(m.frequency_exponent for m in rubbers),
            "cavity": bool(c.cavity.share),
            "coupled": bool(c.point_mass.mass_kg or c.splice.share or c.road_spring.stiffnesses),
            "rotation": bool(c.spin_rad_per_s),
            **dict.fromkeys(self.written.kind.needs, True),
        }
        return {need: CAPABILITIES[need] for need, there in needed.items() if there}


def resolved(case: LoadedCase) -> Tyre:
    """The tyre of a case, its effects applied in the order of the catalogue. Raises EffectRefused
    for a parameter that cannot be."""
    present = {id: value for id, value in case.case.effects.items() if value}
    if present:
        case = replace(case, case=case.case.model_copy(update={"effects": dict.fromkeys(IDS, 0.0)}))
    for id in sorted(present, key=IDS.index):
        try:
            before, case = case, catalogue()[id].of(case)(case, present[id])
            if (case.section, case.case.section) != (before.section, before.case.section):
                gauged = with_gauges_of(case.case, case.section)
                mesh_at_level(case.case, gauged)  # refuses what folds over
        except ValueError as error:
            raise EffectRefused(id, str(error), present[id]) from None
    return Tyre(case)
