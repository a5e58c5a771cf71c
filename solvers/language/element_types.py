"""Types of elements that tyres' decks are made of, by ABAQUS' manual: how many nodes they have, and
what gives them properties."""

from __future__ import annotations

# by the keyword that gives them properties, and by their number of nodes
TYPES_BY_SECTION: dict[str, dict[int, str]] = {
    "SOLID SECTION": {
        2: "T3D2",
        3: "CGAX3 CGAX3H",
        4: "CGAX4 CGAX4H CGAX4R CGAX4RH C3D4 C3D4H",
        6: "CGAX6 CGAX6H C3D6 C3D6H",
        8: "CGAX8 CGAX8H CGAX8R CGAX8RH C3D8 C3D8H C3D8I C3D8IH C3D8R C3D8RH",
        10: "C3D10 C3D10H C3D10M C3D10MH",
        12: "CCL12 CCL12H",
        15: "C3D15 C3D15H",
        18: "CCL18 CCL18H",
        20: "C3D20 C3D20H C3D20R C3D20RH",
        24: "CCL24 CCL24H CCL24R CCL24RH",
    },
    "SURFACE SECTION": {
        2: "SFMGAX1",
        3: "SFMGAX2 SFM3D3",
        4: "SFM3D4 SFM3D4R",
        6: "SFM3D6 SFMCL6",
        8: "SFM3D8 SFM3D8R",
        9: "SFMCL9",
    },
    "MEMBRANE SECTION": {
        2: "MGAX1",
        3: "M3D3 MGAX2",
        4: "M3D4 M3D4R",
        6: "M3D6 MCL6",
        8: "M3D8 M3D8R",
        9: "M3D9 M3D9R MCL9",
    },
    "SHELL SECTION": {3: "S3 S3R", 4: "S4 S4R", 8: "S8R"},
    "RIGID BODY": {2: "RAX2", 3: "R3D3", 4: "R3D4"},
    "MASS": {1: "MASS"},
    "ROTARY INERTIA": {1: "ROTARYI"},
    "SPRING": {1: "SPRING1"},
}
NODES_AND_SECTION: dict[str, tuple[int, str]] = {
    name: (count, section)
    for section, counts in TYPES_BY_SECTION.items()
    for count, names in counts.items()
    for name in names.split()
}
