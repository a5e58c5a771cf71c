"""Materials of tyres of a type: compounds and cords with usual values, and where they are.

Compounds are known by their hardness. Gent (Rubber Chem. Technol. 31 (1958) 896) relates it to
Young's modulus, MPa, of Shore A hardness S:

    E = 0.0981 (56 + 7.66 S) / (0.137505 (254 - 2.54 S)),   C10 = G / 2 = E / 6

Two choices are the model's. The liner is as hard as the carcass' skim, which lies with it between
the inner surface and the cords: one of 50 Shore A alone would wrinkle at 850 kPa. And belts stand
20 degrees from the circumference, 18 on a truck: from 24 on they contract the carcass under them
until its cords, which have no bending stiffness here, are not stable.

Textile cords and the carcass of a truck, thin steel cord in soft rubber, go slack where they are
compressed. Belts and bead wires of steel, held straight by stiff skim or by each other, bear it.

Hardnesses, densities, cords and gauges are what textbooks and cut tyres show, not one maker's:
Gent and Walter, The Pneumatic Tire (NHTSA 2006), ch. 2 and 7; French, Tyre Technology (1989).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

HARDNESS_SPREAD = 4.0  # Shore A, a standard deviation over makers
POISSONS_RATIO = 0.475  # of rubber: elements do not lock, and it hardly yields in volume
TURN_UP = "belt1_turn_up"  # the line of the first belt, which the ply's turn-up goes on with
CAP, BASE = "cap", "base"


@dataclass(frozen=True)
class Compound:
    """A rubber."""

    hardness: float  # Shore A
    density: float  # kg/m3
    # share g of a vibration's shear modulus that is gone in a static state
    relaxed: float = 0.4

    @property
    def C10_Pa(self) -> float:
        """Half the shear modulus of a static state."""
        return gent_C10(self.hardness)

    @property
    def D1_per_Pa(self) -> float:
        """2 / K, with K / G = 2 (1 + nu) / (3 (1 - 2 nu)), G = 2 C10."""
        nu = POISSONS_RATIO
        return 3 * (1 - 2 * nu) / (2 * (1 + nu) * self.C10_Pa)

    @property
    def spread_percent(self) -> float:
        """Standard deviation of C10, per cent."""
        up, down = (gent_C10(self.hardness + d) for d in (HARDNESS_SPREAD, -HARDNESS_SPREAD))
        return 100 * (up - down) / (2 * self.C10_Pa)


def gent_C10(hardness: float) -> float:
    """C10, Pa, of a Shore A hardness."""
    E = 0.0981 * (56 + 7.66 * hardness) / (0.137505 * (254 - 2.54 * hardness))
    return 1e6 * E / 6


@dataclass(frozen=True)
class CordMaterial:
    """Young's modulus, Pa, Poisson's ratio and density, kg/m3, of the cord's own area; and whether
    it bears compression or goes slack."""

    youngs_modulus: float
    poissons_ratio: float
    density: float
    bears_compression: bool = True


@dataclass(frozen=True)
class Ply:
    """Cords of one layer: their material, area of one in m2, spacing in m across them, angle in
    degrees from the meridian, which runs from -z to +z, towards Theta."""

    cord: str
    area: float
    spacing: float
    angle: float


@dataclass(frozen=True)
class Belt:
    """A belt's cords, and its width: ``share`` of the widest, less ``steps`` of the usual step."""

    ply: Ply
    share: float = 1.0
    steps: int = 0


@dataclass(frozen=True)
class Construction:
    """A type of tyre. Gauges, m, as in `from_size.Gauges`: crown, sidewall, bead = (a, b) for
    a + b S1, S1 the nominal section width; liner to under_tread, too. step, m: by how much a belt
    is narrower than the widest, in width."""

    name: str
    compounds: dict[str, Compound]
    cords: dict[str, CordMaterial]
    carcass: tuple[Ply, ...]  # from inside to outside
    belts: tuple[Belt, ...]  # from inside to outside
    cap: Ply | None  # None: no cap ply
    crown: tuple[float, float]
    sidewall: tuple[float, float]
    bead: tuple[float, float]
    liner: float
    ply: float
    belt: float
    cap_gauge: float
    under_tread: float
    step: float
    wires: int  # how many are in a bead
    wire: float  # m2 of each
    # height of the bead filler, share of the arc from the rim to the widest point; the turn-up ends
    # there
    filler: float
    high: bool  # whether the turn-up ends at the widest point instead

    @property
    def lines(self) -> tuple[str, ...]:
        """Lines of the section, from the inner surface to the outer."""
        belts = [TURN_UP, *(f"belt{i}" for i in range(2, len(self.belts) + 1))]
        return ("inner", "ply", *belts, *([CAP] if self.cap else []), BASE, "outer")


STEEL_CORD = CordMaterial(190e9, 0.3, 7850.0)
# 1670 dtex/2, dipped, at the strain of an inflated carcass
POLYESTER_CORD = CordMaterial(7.5e9, 0.3, 1380.0, bears_compression=False)
NYLON_CORD = CordMaterial(3e9, 0.3, 1140.0, bears_compression=False)  # 1400 dtex/2

SOFT = {  # of passenger cars
    "tread": Compound(65, 1150, 0.5),
    "under_tread": Compound(62, 1120),
    "sidewall": Compound(54, 1110),
    "bead_filler": Compound(88, 1200),
    "rim_strip": Compound(72, 1150),
    "inner_liner": Compound(72, 1150),
    "belt_skim": Compound(78, 1180),
}
# areas of textile cords: dtex, in 1e-7 kg/m, over the density
PASSENGER = Construction(
    name="passenger car",
    compounds=SOFT,
    cords={"steel_cord": STEEL_CORD, "polyester_cord": POLYESTER_CORD, "nylon_cord": NYLON_CORD},
    carcass=(Ply("polyester_cord", 2.42e-7, 1.0e-3, 0.0),),
    # cords of 2 + 2 wires of 0.25 mm
    belts=(
        Belt(Ply("steel_cord", 1.96e-7, 1.2e-3, 70.0)),
        Belt(Ply("steel_cord", 1.96e-7, 1.2e-3, 110.0), steps=1),
    ),
    cap=Ply("nylon_cord", 2.46e-7, 1.0e-3, 90.0),
    crown=(7e-3, 0.027),
    sidewall=(3e-3, 0.01),
    bead=(8e-3, 0.02),
    liner=1.2e-3,
    ply=1.2e-3,
    belt=1.2e-3,
    cap_gauge=0.9e-3,
    under_tread=1.5e-3,
    step=0.010,
    wires=20,
    wire=7.2e-7,  # 0.96 mm wide
    filler=0.45,
    high=True,
)
LIGHT_TRUCK = Construction(
    name="light truck",
    compounds={**SOFT, "tread": Compound(64, 1150, 0.5), "sidewall": Compound(57, 1120)},
    cords=PASSENGER.cords,
    carcass=2 * PASSENGER.carcass,
    belts=(
        Belt(Ply("steel_cord", 2.83e-7, 1.4e-3, 70.0)),  # 4 wires of 0.30 mm
        Belt(Ply("steel_cord", 2.83e-7, 1.4e-3, 110.0), steps=1),
    ),
    cap=PASSENGER.cap,
    crown=(9.5e-3, 0.03),
    sidewall=(4.5e-3, 0.015),
    bead=(11e-3, 0.02),
    liner=1.8e-3,
    ply=1.6e-3,
    belt=1.5e-3,
    cap_gauge=1.1e-3,
    under_tread=2e-3,
    step=0.015,
    wires=30,
    wire=7.2e-7,
    filler=0.5,
    high=True,
)
HEAVY = Ply("steel_cord", 6.7e-7, 2.0e-3, 72.0)  # wires: 3 of 0.20 and 6 of 0.35 mm
TRUCK = Construction(
    name="truck",
    compounds={
        "tread": Compound(65, 1130, 0.5),
        "under_tread": Compound(62, 1110),
        "sidewall": Compound(58, 1110),
        "bead_filler": Compound(78, 1160),
        "rim_strip": Compound(75, 1150),
        "inner_liner": Compound(72, 1150),
        "belt_skim": Compound(78, 1190),
    },
    cords={"steel_cord": STEEL_CORD, "carcass_cord": replace(STEEL_CORD, bears_compression=False)},
    carcass=(Ply("carcass_cord", 6.5e-7, 2.0e-3, 0.0),),  # 27 of 0.175 mm
    belts=(
        Belt(Ply("steel_cord", HEAVY.area, HEAVY.spacing, 50.0), share=0.75),  # transition belt
        Belt(HEAVY),
        Belt(Ply("steel_cord", HEAVY.area, HEAVY.spacing, 108.0), steps=1),
        Belt(Ply("steel_cord", HEAVY.area, HEAVY.spacing, 108.0), share=0.75),  # protects the rest
    ),
    cap=None,
    crown=(8e-3, 0.06),
    sidewall=(8e-3, 0.02),
    bead=(18e-3, 0.04),
    liner=3e-3,
    ply=2.2e-3,
    belt=2.2e-3,
    cap_gauge=0.0,
    under_tread=3e-3,
    step=0.020,
    wires=56,
    wire=2.0e-6,  # 1.6 mm
    filler=0.6,
    high=False,
)
