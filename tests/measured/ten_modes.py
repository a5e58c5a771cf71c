"""A modal test of a tyre with ten known modes, written as measuring systems write it.

Sixteen points on three rings at half the tread's width, triaxial, one shaker; a plane doublet for
each label with waves. ``files`` writes one way; what it says beside the plain file is its name.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from tyrecal.simulate.modes.label import Label

from ..chance import generator
from .test_universal import function, units, write

Array = np.ndarray
Sets = list[dict[str, Any]]

MODES = {
    Label(0, 0, "axial"): 38.0,
    Label(0, 0, "torsional"): 41.0,
    Label(1, 1): 46.0,
    Label(1, 0): 71.0,
    Label(2, 1): 79.0,
    Label(2, 0): 96.0,
    Label(3, 0): 117.0,
    Label(3, 1): 124.0,
    Label(4, 0): 138.0,
    Label(5, 0): 160.0,
}
F = np.arange(28.0, 172.0, 0.5)
R, COUNT = 0.33, 16
THETA = 2 * np.pi * np.arange(COUNT) / COUNT + 0.06 * np.sin(7.0 * np.arange(COUNT))
Z = np.tile([0.04, 0.0, -0.04], 6)[:COUNT]
SHAKERS = ((0.2, 0.03, (0.6, 0.6, 0.5)), (2.5, -0.04, (0.5, -0.6, 0.6)))  # theta, z, direction
POINTS = np.column_stack([R * np.sin(THETA), Z, R * np.cos(THETA)])  # the axle along y
# r, theta, z of each point in x, y, z
AXES = np.array([[[np.sin(t), 0, np.cos(t)], [np.cos(t), 0, -np.sin(t)], [0, 1, 0]] for t in THETA])
NUMBERS = np.arange(1, COUNT + 1)
REFERENCES = (99, 98)


def motion(label: Label, theta: float, z: float) -> Array:
    """(members, 3) radial, tangential and axial motion of a mode's members at a place."""
    if label.kind == "axial":
        return np.array([[0.3 * z / R, 0.0, 1.0]])
    if not label.c:
        return np.array([[0.0, 1.0, 0.0]])
    members = []
    for phase in (0.3, 0.3 + np.pi / 2 / label.c):
        a, b = (np.cos(label.c * (theta - phase)), np.sin(label.c * (theta - phase)))
        members.append([10 * z * a, -3 * z * b, a] if label.m else [a, -b / label.c, 0.0])
    return np.array(members)


@cache
def accelerances(shaker: int = 0, form: int = 2) -> Array:
    """(COUNT, 3, lines) response along r, theta, z over force, with 1 % noise; form: 0, 1, 2 for
    receptance, mobility, accelerance."""
    theta, z, along = SHAKERS[shaker]
    w, H = 2 * np.pi * F, np.zeros((COUNT, 3, len(F)), complex)
    for label, hertz in MODES.items():
        wk = 2 * np.pi * hertz
        driven = motion(label, theta, z) @ np.array(along)
        shape = np.array([driven @ motion(label, t, q) for t, q in zip(THETA, Z, strict=True)])
        H += shape[..., None] * (1j * w) ** form / (wk**2 - w**2 + 0.05j * w * wk)
    rng = generator("ten modes", shaker, form)
    noise = rng.standard_normal(H.shape) + 1j * rng.standard_normal(H.shape)
    return H + 0.01 * np.sqrt(np.mean(np.abs(H) ** 2) / 2) * noise


def along_xyz(shaker: int = 0) -> Array:
    """(COUNT, 3, lines) along x, y, z."""
    return np.einsum("nkd,nkf->ndf", AXES, accelerances(shaker))


def nodes(kind: int = 2411, system: Any = 0, scale: float = 1.0, places: Array = POINTS) -> Any:
    x, y, z = scale * places.T
    cs = np.broadcast_to(system, COUNT)
    more = {"def_cs": 0 * cs, "disp_cs": cs, "color": 1 + 0 * cs}
    return {"type": kind, "node_nums": NUMBERS, "x": x, "y": y, "z": z, **more}


def functions(H: Array, shaker: int = 0, **more: Any) -> Sets:
    ends = {"ref_node": REFERENCES[shaker], "ref_dir": 1}
    return [
        function(H[i, k], F, i + 1, ord_data_type=5, binary=1, rsp_dir=k + 1, **ends) | more
        for i in range(COUNT)
        for k in range(3)
    ]


def systems_18(kind: int = 0) -> dict[str, Any]:
    """A system for each node, its x radial and its z axial; or, cylindrical, one for all."""
    count = 1 if kind else COUNT
    origin, x, z = (POINTS, AXES[:, 0], AXES[:, 2])
    if kind:  # about the axle, theta from z to x
        origin, x, z = np.zeros((1, 3)), np.array([[0, 0, 1.0]]), np.array([[0, 1.0, 0]])
    return {
        "type": 18,
        "cs_num": np.arange(count) + 11,
        "cs_type": np.full(count, kind),
        "ref_cs_num": np.zeros(count, int),
        "cs_name": ["S"] * count,
        "ref_o": origin,
        "x_point": origin + x,
        "xz_point": origin + x + z,
    }


def systems_2420() -> dict[str, Any]:
    matrices = [np.vstack([axes, place]) for axes, place in zip(AXES, POINTS, strict=True)]
    return {
        "type": 2420,
        "CS_sys_labels": [int(n) + 10 for n in NUMBERS],
        "CS_types": [0] * COUNT,
        "CS_colors": [1] * COUNT,
        "CS_names": ["S"] * COUNT,
        "CS_matrices": matrices,
    }


def hammer() -> Sets:
    """Test with one accelerometer and impacts at all points."""
    sets = functions(along_xyz())
    swapped = {"rsp_node": "ref_node", "rsp_dir": "ref_dir", "ref_node": "rsp_node"}
    swapped["ref_dir"] = "rsp_dir"
    return [each | {new: each[old] for new, old in swapped.items()} for each in sets]


def shapes(H: Array) -> Sets:
    """Data set 55: residues of the first shaker, by their places in r, theta, z, turned as H is."""
    theta, z, along = SHAKERS[0]
    sets = []
    for number, (label, hertz) in enumerate(MODES.items(), 1):
        driven = motion(label, theta, z) @ np.array(along)
        u = np.array([driven @ motion(label, t, q) for t, q in zip(THETA, Z, strict=True)])
        u = np.einsum("nkd,nk->nd", H, u)
        sets.append(
            {
                "type": 55,
                "model_type": 1,
                "analysis_type": 2,
                "data_ch": 2,
                "spec_data_type": 8,
                "load_case": 1,
                "mode_n": number,
                "freq": hertz,
                "modal_damp_his": 0.05,
                "node_nums": NUMBERS,
                **{f"r{k + 1}": u[:, k] for k in range(3)},
            }
        )
    return sets


def text_2414(sets: Sets) -> str:
    """Data sets 55 as the newer 2414."""
    lines = []
    for each in sets:
        lines += ["    -1", "  2414", f"{each['mode_n']:10d}", "mode", f"{1:10d}", *["NONE"] * 5]
        lines += ["".join(f"{n:10d}" for n in (1, 2, 2, 8, 2, 3))]
        lines += [
            "".join(f"{n:10d}" for n in (0, 0, 0, 0, 0, each["mode_n"], 0, 0)),
            f"{0:10d}" * 2,
        ]
        lines += ["".join(f"{x:13.5e}" for x in (0, each["freq"], 0, 1, 0, 0.05))]
        lines += ["".join(f"{x:13.5e}" for x in [0.0] * 6)]
        for node, *u in zip(*(each[name] for name in ("node_nums", "r1", "r2", "r3")), strict=True):
            lines += [f"{node:10d}", "".join(f"{x:13.5e}" for x in u)]
        lines += ["    -1"]
    return "\n".join(lines) + "\n"


def with_component(sets: Sets, name: str) -> Sets:
    return [each | {"rsp_ent_name": name, "ref_ent_name": "tyre"} for each in sets]


def broken(sets: Sets) -> Sets:
    """Channel 5:2 with a broken cable."""
    size = 1000 * np.abs(sets[0]["data"]).max()
    rng = generator("broken")
    noise = size * (rng.standard_normal(len(F)) + 1j * rng.standard_normal(len(F)))
    return [e | {"data": noise} if (e["rsp_node"], e["rsp_dir"]) == (5, 2) else e for e in sets]


def no_motion(sets: Sets) -> Sets:
    """A microphone, a moment, a force of the hub, and an accelerance with a direction 0."""
    other = sets[0] | {"rsp_node": 500}
    return [
        *sets,
        other | {"rsp_dir": 0, "ordinate_spec_data_type": 15},
        other | {"rsp_dir": 4},
        other | {"ordinate_spec_data_type": 9, "rsp_dir": 2},
        other | {"ordinate_spec_data_type": 12, "rsp_dir": 0, "rsp_node": 501},
    ]


def partly(sets: Sets) -> Sets:
    """Test with two shakers, the second measured with the first 12 points only."""
    second = functions(along_xyz(1), 1)
    return [*sets, *[each for each in second if each["rsp_node"] <= 12]]


WAYS: dict[str, Callable[[], list[Sets]]] = {
    "plain": lambda: [[units(), nodes(), *functions(along_xyz())]],
    "a frame per node, 18": lambda: [
        [units(), systems_18(), nodes(15, NUMBERS + 10), *functions(accelerances())]
    ],
    "a frame per node, 2420": lambda: [
        [units(), nodes(2411, NUMBERS + 10), systems_2420(), *functions(accelerances())]
    ],
    "a cylindrical frame": lambda: [
        [units(), systems_18(1), nodes(15, 11), *functions(accelerances())]
    ],
    "components": lambda: [
        [
            units(),
            nodes(),
            *with_component(functions(along_xyz()), "tyre"),
            *with_component(functions(-3 * along_xyz()[::-1]), "hub"),
        ]
    ],
    "shapes, 55": lambda: [[units(), nodes(15), *shapes(AXES)]],
    "hammer": lambda: [[units(), nodes(), *hammer()]],
    "runs": lambda: [
        [units(), nodes()],
        *[functions(along_xyz())[k : k + 12] for k in range(0, 48, 12)],
    ],
    "two references": lambda: [[units(), nodes(), *partly(functions(along_xyz()))]],
    "a broken cable": lambda: [[units(), nodes(), *broken(functions(along_xyz()))]],
    "no motion": lambda: [[units(), nodes(), *no_motion(functions(along_xyz()))]],
    "mm": lambda: [[units(1e3), nodes(15, 0, 1e3), *functions(1e3 * along_xyz())]],
    "directions of the sensors": lambda: [[units(), nodes(), *functions(accelerances())]],
}


def files(folder: Path, way: str, points: int = COUNT, binary: int = 1) -> list[Path]:
    """The universal files of one way in ``WAYS``, or of "shapes, 2414"; with functions of the first
    ``points`` alone, and as text where ``binary`` is 0."""
    if way == "shapes, 2414":
        path = write(folder / "0.uff", units(), nodes())
        path.write_text(path.read_text() + text_2414(shapes(AXES)))
        return [path]
    paths = []
    for number, sets in enumerate(WAYS[way]()):
        few = [
            each | {"binary": binary} if each["type"] == 58 else each
            for each in sets
            if not points < min(each.get("rsp_node", 0), each.get("ref_node", 0)) <= COUNT
        ]
        paths.append(write(folder / f"{number}.uff", *few))
    return paths
