"""Materials of a deck: rubber with Prony terms or a table of moduli, elastic cords, a gas; their
loss factors."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import lru_cache
from itertools import pairwise

import numpy as np

from ...language.text import Block, DeckError, Place
from .laws.data_lines import read_law
from .laws.hyperelastic import Hyperelastic
from .laws.principal import LinearElastic

Array = np.ndarray
Scalar = complex | float  # complex where it carries the tangent of a slope (`sensitivity`)


@dataclass(frozen=True)
class ModulusTable:
    """Storage over static shear modulus by frequency."""

    frequency_Hz: tuple[float, ...]  # rising
    ratios: tuple[Scalar, ...]  # at each frequency

    def ratio(self, frequency_Hz: float) -> Scalar:
        """rho, constant beyond the table's ends; complex where the table carries a tangent."""
        i, share = self._place(frequency_Hz)
        low, high = self.ratios[i : i + 2]
        return low * (high / low) ** share

    def slope(self, frequency_Hz: float) -> float:
        """d ln rho / d ln f."""
        i, share = self._place(frequency_Hz)
        if not 0.0 < share < 1.0:
            return 0.0
        low, high = np.real(self.ratios[i : i + 2])
        return float(np.log(high / low) / np.log(self.frequency_Hz[i + 1] / self.frequency_Hz[i]))

    def _place(self, frequency_Hz: float) -> tuple[int, float]:
        """The row before a frequency, and the share of the way to the next one."""
        table, f = np.log(self.frequency_Hz), np.log(max(frequency_Hz, 1e-12))
        i = int(np.clip(np.searchsorted(table, f) - 1, 0, len(table) - 2))
        return i, float(np.clip((f - table[i]) / (table[i + 1] - table[i]), 0.0, 1.0))


@dataclass(frozen=True)
class LossFactor:
    """Loss over storage modulus of a material: ``structural``, of all its stiffness, and what a
    table adds to it by frequency."""

    structural: float = 0.0
    frequency_Hz: tuple[float, ...] = ()  # rising; empty: there is no table
    shear: tuple[float, ...] = ()  # loss over storage modulus at each frequency
    bulk: tuple[float, ...] = ()  # the same of the bulk modulus

    def at(self, frequency_Hz: Array) -> tuple[Array, Array]:
        """Loss factors of shear and bulk at frequencies (f,), linear in ln f between the table's
        rows, constant beyond its ends."""
        whole = np.full(np.shape(frequency_Hz), self.structural)
        if not self.frequency_Hz:
            return whole, whole
        place, table = np.log(np.maximum(frequency_Hz, 1e-12)), np.log(self.frequency_Hz)
        shear, bulk = (np.interp(place, table, own) for own in (self.shear, self.bulk))
        return whole + shear, whole + bulk


@dataclass(eq=False)
class Material:
    """Constants as the deck gives them."""

    name: str
    place: Place
    density: Scalar = 0.0  # kg/m3
    youngs_modulus: Scalar | None = None  # Pa
    poissons_ratio: Scalar = 0.0
    rubber: Hyperelastic | None = None  # constants of one point
    instantaneous: bool = False  # the moduli are those of sudden loading
    prony: list[tuple[Scalar, Scalar, Scalar]] = field(default_factory=list)  # g, k, tau in s
    table: ModulusTable | None = None  # in place of a Prony series
    loss: LossFactor | None = None  # None: not known
    bulk_modulus: Scalar | None = None  # Pa, of a gas
    tension_only: bool = False  # a cord that bears no compression

    @property
    def law(self) -> Hyperelastic | None:
        """Law of a solid: its rubber law, or linear elasticity; None: the material has neither.
        Raises DeckError."""
        if self.rubber is not None or self.youngs_modulus is None:
            return self.rubber
        if self.tension_only:
            words = f"*NO COMPRESSION of material {self.name} is honoured of cords only"
            raise DeckError(self.place, words)
        E, nu = self.youngs_modulus, self.poissons_ratio
        if not -1 < np.real(nu) < 0.5:
            words = f"Poisson's ratio of material {self.name} must be above -1 and below 0.5"
            raise DeckError(self.place, words)
        return LinearElastic(np.asarray(E / (2 + 2 * nu)), np.asarray(E / (3 - 6 * nu)))

    def _relaxed(self) -> tuple[Scalar, Scalar]:
        """Long-term over instantaneous modulus, shear and bulk: 1 - sum g, 1 - sum k."""
        return 1 - sum(g for g, _, _ in self.prony), 1 - sum(k for _, k, _ in self.prony)

    def static_scale(self, long_term: bool) -> tuple[Scalar, Scalar]:
        """Factors on the given shear and bulk moduli in a static step."""
        shear, bulk = self._relaxed()
        if self.instantaneous == (not long_term):
            return 1.0, 1.0
        return (shear, bulk) if long_term else (1 / shear, 1 / bulk)

    def dynamic_ratio(self, frequency_Hz: float | None, long_term: bool) -> tuple[Scalar, Scalar]:
        """Storage modulus at a frequency over the static step's, shear and bulk.

        G'(w)/G0 = 1 - sum g + sum g w^2 tau^2 / (1 + w^2 tau^2) (Ferry, ch. 3).
        """
        if frequency_Hz is None:
            return 1.0, 1.0
        if self.table is not None:
            return self.table.ratio(frequency_Hz), 1.0
        ratios: list[Scalar] = []
        for kind, relaxed in enumerate(self._relaxed()):
            storage = relaxed
            for term in self.prony:
                x2 = (2 * np.pi * frequency_Hz * term[2]) ** 2
                storage = storage + term[kind] * x2 / (1 + x2)
            ratios.append(storage / (relaxed if long_term else 1.0))
        return ratios[0], ratios[1]


def read_materials(keywords: list[Block]) -> dict[str, Material]:
    """All materials by upper-case name. Raises DeckError."""
    blocks: dict[str, list[Block]] = {}  # of each material
    own: list[Block] = []
    for k in keywords:
        if k.name == "MATERIAL":
            name = k.need("NAME")
            if name in blocks:
                raise DeckError(k.place, f"material {name} is defined twice")
            own = blocks[name] = [k]
        elif k.name in MATERIAL_READERS:
            if not own:
                raise DeckError(k.place, f"*{k.name} must follow a *MATERIAL")
            own.append(k)
    return {name: _material(tuple(own)) for name, own in blocks.items()}


@lru_cache(maxsize=256)
def _material(blocks: tuple[Block, ...]) -> Material:
    """The material of a *MATERIAL and its options, remembered while these are the same objects, as
    those are that carry no tangent. Raises DeckError."""
    material = Material(blocks[0].need("NAME"), blocks[0].place)
    for k in blocks[1:]:
        MATERIAL_READERS[k.name](material, k)
        if material.rubber is not None and material.youngs_modulus is not None:
            raise DeckError(material.place, f"material {material.name} has two laws")
    return material


def _density(m: Material, k: Block) -> None:
    m.density = _positive(k, 0, "density")


def _elastic(m: Material, k: Block) -> None:
    m.youngs_modulus = _positive(k, 0, "Young's modulus")
    m.poissons_ratio = k.only_row().value(1, 0.0)


def _hyperelastic(m: Material, k: Block) -> None:
    m.rubber = read_law(k)
    m.instantaneous = k.get("MODULI") == "INSTANTANEOUS"


def _viscoelastic(m: Material, k: Block) -> None:
    """Read a *VISCOELASTIC block into a material: Prony terms (g, k, tau) or a table of moduli.
    Raises DeckError."""
    if "FREQUENCY" in k.parameters:
        m.table = _modulus_table(k)
        m.loss = _with_losses(m, k)
        return
    for row in k.rows:
        m.prony.append((row.value(0, 0.0), row.value(1, 0.0), row.value(2)))
    if any(np.real(x) < 0 for term in m.prony for x in term):
        raise DeckError(k.place, "g, k and tau of a Prony series must not be negative")
    if any(np.real(r) <= 0 for r in m._relaxed()):
        raise DeckError(k.place, "the sum of g (and of k) of a Prony series must stay below 1")


def _modulus_table(k: Block) -> ModulusTable:
    """Rows of loss and storage: G''/G0, 1 - G'/G0, K''/K0, 1 - K'/K0, frequency in Hz."""
    frequency = [row.number(4) for row in k.rows]
    ratios = [1 - row.value(1, 0.0) for row in k.rows]
    if len(frequency) < 2 or any(b <= a for a, b in pairwise([0.0, *frequency])):
        raise DeckError(k.place, "a table of moduli has two rows or more, their frequencies rise")
    if any(np.real(ratio) <= 0 for ratio in ratios) or any(row.value(3, 0.0) for row in k.rows):
        raise DeckError(k.place, "shear moduli of a table are positive, and the bulk modulus stays")
    return ModulusTable(tuple(frequency), tuple(ratios))


def _with_losses(m: Material, k: Block) -> LossFactor | None:
    """The loss factors of a table of moduli besides those that the material has."""
    assert m.table is not None
    losses = [[row.number(i, 0.0) for i in (0, 2)] for row in k.rows]
    if any(each < 0 for row in losses for each in row):
        raise DeckError(k.place, "losses of a table must not be negative")
    if not any(map(any, losses)):
        return m.loss
    storage = np.real(m.table.ratios)
    shear, bulk = np.array(losses).T / np.array([storage, np.ones_like(storage)])
    structural = m.loss.structural if m.loss else 0.0
    return LossFactor(structural, m.table.frequency_Hz, tuple(shear), tuple(bulk))


def _damping(m: Material, k: Block) -> None:
    structural = k.number("STRUCTURAL")
    if structural is None or structural < 0:
        raise DeckError(k.place, "*DAMPING needs STRUCTURAL=, a loss factor of 0 or more")
    if k.rows:
        raise DeckError(k.rows[0].place, "*DAMPING takes no data lines here")
    m.loss = replace(m.loss or LossFactor(), structural=structural)


def _positive(k: Block, index: int, what: str) -> Scalar:
    value = k.only_row().value(index)
    if not np.real(value) > 0:
        raise DeckError(k.place, f"the {what} must be positive, got {np.real(value):g}")
    return value


def _no_compression(m: Material, k: Block) -> None:
    if m.youngs_modulus is None:
        raise DeckError(k.place, "*NO COMPRESSION must follow an *ELASTIC")
    if k.rows:
        raise DeckError(k.rows[0].place, "*NO COMPRESSION has no data")
    m.tension_only = True


def _acoustic(m: Material, k: Block) -> None:
    m.bulk_modulus = _positive(k, 0, "bulk modulus")


MATERIAL_READERS = {
    "ACOUSTIC MEDIUM": _acoustic,
    "DAMPING": _damping,
    "DENSITY": _density,
    "ELASTIC": _elastic,
    "HYPERELASTIC": _hyperelastic,
    "NO COMPRESSION": _no_compression,
    "VISCOELASTIC": _viscoelastic,
}
