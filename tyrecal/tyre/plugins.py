"""Names of effects, the tool's own and those of installed packages; nothing is imported for them.

Installed packages add theirs under the entry point group EFFECT_GROUP: the id, and where its
`Effect` is.
"""

from __future__ import annotations

from importlib.metadata import entry_points

EFFECT_GROUP = "tyrecal.effects"
SPINDLE = ("spindle_lateral", "spindle_radial", "spindle_torsional", "spindle_tilt")
# Each in a module of its own name, or in SPINDLE's; listed, and applied to a case, in this order.
OWN = (
    "dynamic_stiffening",
    "frequency_stiffening",
    "tread_density",
    "tread_wear",
    "bead_filler",
    "cap_ply",
    "belt_angle",
    "belt_width",
    "carcass_fanning",
    "carcass_turn_up",
    "sidewall_gauge",
    "rim_width",
    "pressure_offset",
    "temperature",
    "temperature_drift",
    "cavity_air",
    *SPINDLE,
    "wheel_free",
    "stiffness_splice",
    "point_mass",
    "road_contact",
    "rotation",
)
ADDED = {entry.name: entry for entry in entry_points(group=EFFECT_GROUP) if entry.name not in OWN}
IDS = (*OWN, *sorted(ADDED))
