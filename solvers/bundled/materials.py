"""Materials of a deck: hyperelastic rubber with its Prony terms, elastic cords."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from .keywords import DeckError, Keyword

Number = complex | float


@dataclass
class Material:
    """Constants as the deck gives them; Pa, kg/m3, s.

    ``instantaneous``: the moduli are those of sudden loading. ``prony``: rows (g, k, tau).
    """

    name: str
    line: int
    density: Number = 0.0
    youngs_modulus: Number | None = None
    C10: Number | None = None
    C01: Number = 0.0
    inverse_D1: Number = 0.0
    instantaneous: bool = False
    prony: list[tuple[Number, Number, Number]] = field(default_factory=list)

    def _relaxed(self) -> tuple[Number, Number]:
        """Long-term over instantaneous modulus, shear and bulk: 1 - sum g, 1 - sum k."""
        return 1 - sum(g for g, _, _ in self.prony), 1 - sum(k for _, k, _ in self.prony)

    def static_scale(self, long_term: bool) -> tuple[Number, Number]:
        """Factors on the given shear and bulk moduli in a static step."""
        shear, bulk = self._relaxed()
        if self.instantaneous == (not long_term):
            return 1.0, 1.0
        return (shear, bulk) if long_term else (1 / shear, 1 / bulk)

    def dynamic_ratio(self, frequency_Hz: float | None, long_term: bool) -> tuple[Number, Number]:
        """Storage modulus at a frequency over the static step's, shear and bulk.

        G'(w)/G0 = 1 - sum g + sum g w^2 tau^2 / (1 + w^2 tau^2) (Ferry, ch. 3).
        """
        if frequency_Hz is None:
            return 1.0, 1.0
        ratios: list[Number] = []
        for kind, relaxed in enumerate(self._relaxed()):
            storage = relaxed
            for term in self.prony:
                x2 = (2 * np.pi * frequency_Hz * term[2]) ** 2
                storage = storage + term[kind] * x2 / (1 + x2)
            ratios.append(storage / (relaxed if long_term else 1.0))
        return ratios[0], ratios[1]


def read_materials(keywords: list[Keyword]) -> dict[str, Material]:
    """All materials by upper-case name. Raises DeckError."""
    materials: dict[str, Material] = {}
    current: Material | None = None
    for k in keywords:
        if k.name == "MATERIAL":
            name = k.need("NAME")
            if name in materials:
                raise DeckError(k.line, f"material {name} is defined twice")
            current = materials[name] = Material(name, k.line)
        elif k.name in ("DENSITY", "ELASTIC", "HYPERELASTIC", "VISCOELASTIC"):
            if current is None:
                raise DeckError(k.line, f"*{k.name} must follow a *MATERIAL")
            _READERS[k.name](current, k)
    return materials


def _density(m: Material, k: Keyword) -> None:
    m.density = _positive(k, 0, "density")


def _elastic(m: Material, k: Keyword) -> None:
    m.youngs_modulus = _positive(k, 0, "Young's modulus")


def _hyperelastic(m: Material, k: Keyword) -> None:
    row = k.only_row()
    m.C10 = row.number(0)
    neo = "NEO HOOKE" in k.parameters
    m.C01 = 0.0 if neo else row.number(1)
    D1 = row.number(1 if neo else 2)
    if np.real(D1) <= 0:
        raise DeckError(row.line, "D1 must be positive: fully incompressible rubber would lock")
    if np.real(m.C10 + m.C01) <= 0:
        raise DeckError(row.line, "C10 + C01, half the shear modulus, must be positive")
    m.inverse_D1 = 1 / D1
    m.instantaneous = k.get("MODULI") == "INSTANTANEOUS"


def _viscoelastic(m: Material, k: Keyword) -> None:
    for row in k.rows:
        m.prony.append((row.number(0), row.number(1, 0.0), row.number(2)))
    if any(np.real(x) < 0 for term in m.prony for x in term):
        raise DeckError(k.line, "g, k and tau of a Prony series must not be negative")
    if any(np.real(r) <= 0 for r in m._relaxed()):
        raise DeckError(k.line, "the sum of g (and of k) of a Prony series must stay below 1")


def _positive(k: Keyword, index: int, what: str) -> Number:
    value = k.only_row().number(index)
    if not np.real(value) > 0:
        raise DeckError(k.line, f"the {what} must be positive, got {np.real(value):g}")
    return value


_READERS = {
    "DENSITY": _density,
    "ELASTIC": _elastic,
    "HYPERELASTIC": _hyperelastic,
    "VISCOELASTIC": _viscoelastic,
}
