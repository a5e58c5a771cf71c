"""Formulas of MF-Swift (6.1 and 6.2) for the keys that a tyre's structure determines.

The wheel stands upright, does not roll and does not slip. `tir` reads such keys from a tyre
property file and `studies.property_file` fits them; both use these formulas. SI; dp and df are
(p - NOMPRES) / NOMPRES and (F_z - FNOMIN) / FNOMIN.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import pi, sqrt

import numpy as np

Array = np.ndarray
Number = float | Array
FREQUENCIES = ("FREQ_LONG", "FREQ_LAT", "FREQ_YAW", "FREQ_WINDUP")


@dataclass(frozen=True)
class MFSwift:
    """A tyre by its keys, SI. A method raises KeyError for a key that it lacks, and if it needs the
    curve of F_z ValueError for a Q_FZ2 that is too large; keys of influences, such as PFZ1, are 0
    where absent. Loads in N, lengths in m."""

    keys: Mapping[str, float]

    def influence(self, key: str) -> float:
        """The value of a key, 0 where it is absent."""
        return self.keys.get(key, 0.0)

    @property
    def free_radius(self) -> float:
        """Radius of the unloaded tyre at rest, m."""
        return self.keys["UNLOADED_RADIUS"] * self.keys.get("Q_RE0", 1.0)

    def load(self, deflection: Number, dp: Number = 0.0) -> Number:
        """F_z of a deflection; VERTICAL_STIFFNESS is its tangent at FNOMIN."""
        linear, square = self._curve()
        x = deflection / self.keys["UNLOADED_RADIUS"]
        return self.keys["FNOMIN"] * (1 + self.influence("PFZ1") * dp) * (linear + square * x) * x

    def deflection(self, load: Number, dp: Number = 0.0) -> Number:
        """Deflection under F_z."""
        linear, square = self._curve()
        c = load / (self.keys["FNOMIN"] * (1 + self.influence("PFZ1") * dp))
        # the root of square x^2 + linear x = c that is c / linear where square is 0
        return self.keys["UNLOADED_RADIUS"] * 2 * c / (linear + (linear**2 + 4 * square * c) ** 0.5)

    def vertical(self, load: Number, dp: Number = 0.0) -> Number:
        """Slope of F_z over the deflection at F_z, N/m."""
        linear, square = self._curve()
        R0 = self.keys["UNLOADED_RADIUS"]
        slope = linear + 2 * square * self.deflection(load, dp) / R0
        return self.keys["FNOMIN"] * (1 + self.influence("PFZ1") * dp) * slope / R0

    def _curve(self) -> tuple[float, float]:
        """q_Fz1 and q_Fz2 of F_z / FNOMIN = q_Fz1 x + q_Fz2 x², x being deflection over radius."""
        k, square = self.keys, self.influence("Q_FZ2")
        ratio = k["VERTICAL_STIFFNESS"] * k["UNLOADED_RADIUS"] / k["FNOMIN"]
        if ratio**2 < 4 * square:
            raise ValueError(f"Q_FZ2 is {square:g}, must be at most {ratio**2 / 4:g}")
        return sqrt(ratio**2 - 4 * square), square

    def _relative_load(self, load: Number, dp: Number) -> Number:
        """F_z over C_z R_0."""
        stiffness = self.keys["VERTICAL_STIFFNESS"] * (1 + self.influence("PFZ1") * dp)
        return load / (stiffness * self.keys["UNLOADED_RADIUS"])

    def patch_length(self, load: Number, dp: Number = 0.0) -> Number:
        """Length 2 a of the contact patch."""
        k, x = self.keys, self._relative_load(load, dp)
        if "Q_RA1" not in k:  # version 5.2, 6.0
            f = load / k["FNOMIN"]
            return 2 * k["UNLOADED_RADIUS"] * (k["Q_A1"] * f**0.5 + k["Q_A2"] * f)
        return 2 * k["UNLOADED_RADIUS"] * (k["Q_RA2"] * x + k["Q_RA1"] * x**0.5)

    def patch_width(self, load: Number, dp: Number = 0.0) -> Number:
        """Width 2 b of the contact patch."""
        k, x = self.keys, self._relative_load(load, dp)
        return 2 * k["WIDTH"] * (k["Q_RB2"] * x + k["Q_RB1"] * x ** (1 / 3))

    def rolling_radius(self, load: Number, dp: Number = 0.0) -> Number:
        """Effective rolling radius R_e."""
        k, f = self.keys, load / self.keys["FNOMIN"]
        stiffness = k["VERTICAL_STIFFNESS"] * (1 + self.influence("PFZ1") * dp)
        bent = k["FREFF"] * f + k["DREFF"] * np.arctan(k["BREFF"] * f)
        return self.free_radius - k["FNOMIN"] / stiffness * bent

    def longitudinal(self, load: Number, dp: Number = 0.0) -> Number:
        """Longitudinal stiffness, rim to held patch, N/m."""
        return self.keys["LONGITUDINAL_STIFFNESS"] * self._influences("PCFX", load, dp)

    def lateral(self, load: Number, dp: Number = 0.0) -> Number:
        """Lateral stiffness, rim to held patch, N/m."""
        return self.keys["LATERAL_STIFFNESS"] * self._influences("PCFY", load, dp)

    def _influences(self, stem: str, load: Number, dp: Number) -> Number:
        one, two, three = (self.influence(f"{stem}{i}") for i in (1, 2, 3))
        df = load / self.keys["FNOMIN"] - 1
        return (1 + one * df + two * df**2) * (1 + three * dp)

    def yaw(self, load: Number, dp: Number = 0.0) -> Number:
        """Torsional stiffness about the vertical, N m/rad; no key states its change with the
        load, so 0 * load only gives the result its shape."""
        return self.keys["YAW_STIFFNESS"] * (1 + self.influence("PCMZ1") * dp) + 0 * load

    def springs(self) -> dict[str, float]:
        """Stiffness between rim and rigid belt, (2 pi f)² times its inertia: ``x`` (also vertical),
        ``y`` in N/m; ``yaw``, ``windup`` in N m/rad. BELT_IXX is about any diameter, z too."""
        inertias = ("BELT_MASS", "BELT_MASS", "BELT_IXX", "BELT_IYY")
        pairs = zip(("x", "y", "yaw", "windup"), FREQUENCIES, inertias, strict=True)
        return {
            name: (2 * pi * self.keys[frequency]) ** 2 * self.keys[inertia]
            for name, frequency, inertia in pairs
        }

    def residual_springs(self) -> dict[str, float]:
        """Springs between belt and patch with which the whole has the static stiffnesses, at FNOMIN
        and NOMPRES: ``x``, ``y``, ``z`` in N/m, ``yaw`` in N m/rad. One that is negative means that
        the belt's springs alone are too soft. The lever from axle to patch turns the belt."""
        k, belt = self.keys, self.springs()
        square = (self.free_radius - float(self.deflection(k["FNOMIN"]))) ** 2  # of the lever, m2
        left = {
            "x": 1 / k["LONGITUDINAL_STIFFNESS"] - 1 / belt["x"] - square / belt["windup"],
            "y": 1 / k["LATERAL_STIFFNESS"] - 1 / belt["y"] - square / belt["yaw"],
            "z": 1 / k["VERTICAL_STIFFNESS"] - 1 / belt["x"],
            "yaw": 1 / k["YAW_STIFFNESS"] - 1 / belt["yaw"],
        }
        return {name: 1 / compliance for name, compliance in left.items()}
