"""Forty tyres from their size codes: inflated, 16 modes, mass and vertical stiffness.

    python -m tests.studies.sizes RECORD.jsonl > table.md

Each is what ``tyrecal init`` writes for the code and its service description, on its coarse mesh,
pressed on the road with its rated load on a coarser one (`quicker`). RECORD keeps every tyre, and
those in it are not computed again.

Bands: what is recalled of tyres, wide on purpose. Vertical stiffness 160 to 320 N/mm (passenger
cars), 250 to 450 (light trucks), 700 to 1200 (11R22.5 to 315/80R22.5); mass 15 to 25 kg (light
trucks), 8.5 to 10 kg (205/55R16), 13 to 16 (P235/75R17), 50 to 58 (11R22.5) and 62 to 72
(315/80R22.5). For cars of other sizes the two masses are a power of D S (S + 2 H), the meridian's
length round the tyre times a gauge that grows with it, for trucks of D S1^2, 10 % and 8 % either
way. Beside the stiffness stands what Rhyne found of belted radials that were measured (Tire Science
and Technology 33 (2005) 136): it knows the pressure, which the bands do not.
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
from math import log, sqrt
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from tyrecal.tyre.section.size import TyreSize, parse_size

PASSENGER = [
    "145/80R13 75T",
    "165/70R14 81T",
    "175/65R14 82T",
    "185/60R15 84H",
    "195/65R15 91H",
    "195/55R16 87V",
    "205/55R16 91V",
    "205/50R17 93W XL",
    "215/60R16 95V",
    "215/55R17 94V",
    "225/45R17 91W",
    "235/45R18 98Y XL",
    "245/45R18 100Y XL",
    "HL245/40R19 101Y",
]
SUV = [
    "P235/75R17 108S",
    "215/65R16 98H",
    "225/65R17 102H",
    "235/60R18 103V",
    "235/55R19 101V",
    "245/60R18 105H",
    "255/55R18 105V",
    "265/60R18 110H",
]
LIGHT_TRUCK = [
    "LT245/75R16/C 108/104S",
    "LT235/75R15/C 104/101S",
    "LT265/75R16/C 112/109S",
    "LT265/70R17/C 112/109S",
    "30x9.50R15LT/C 104S",
    "31x10.50R15LT/C 109S",
    "32x11.50R15LT/C 113S",
    "225/75R16C 118/116R",
]
TRUCK = [
    "11R22.5 144/142L",
    "12R22.5 152/148L LRH",
    "11R24.5 146/143L",
    "275/80R22.5 149/146L",
    "295/75R22.5 144/141L",
    "295/80R22.5 152/148M",
    "305/70R22.5 150/147L",
    "315/70R22.5 154/150L",
    "275/70R22.5 148/145M",
    "315/80R22.5 156/150L",
]
BEYOND = [  # not of the forty: at 550 kPa, of which the band of light trucks knows nothing
    "LT245/75R16/E 120/116S",
    "LT225/75R16/E 115/112S",
    "LT265/70R17/E 121/118S",
    "LT275/65R18/E 123/120S",
]
SIXTEEN = [(0, 0), (0, 0), (1, 0), (1, 1), (2, 0), (2, 1), (3, 0), (3, 1), (4, 0)]
STIFFNESS_N_PER_MM = {"passenger": (160, 320), "light truck": (250, 450), "truck": (700, 1200)}
# two tyres of a kind: size, mass in kg; then the share either way
KNOWN = {
    "passenger": ("205/55R16", 9.25, "P235/75R17", 14.5, 0.10),
    "truck": ("11R22.5", 54.0, "315/80R22.5", 67.0, 0.08),
}


def kind(size: TyreSize) -> str:
    return "truck" if size.truck else "light truck" if size.light_truck else "passenger"


def extent(size: TyreSize) -> float:
    """Extent of a tyre, of which the mass of its kind is a power."""
    if size.truck:
        return size.overall_diameter * size.width**2
    width = size.section_width(size.measuring_rim)
    return size.overall_diameter * width * (width + 2 * size.section_height)


def rhyne_N_per_mm(size: TyreSize) -> float:
    """K = 0.00028 p sqrt((1.03 - 0.004 AR) S D) + 3.45 in kg/mm, of p in kPa, S and D in mm."""
    aspect = 100 * size.section_height / size.width
    root = sqrt((1.03 - 0.004 * aspect) * 1e6 * size.width * size.overall_diameter)
    return 9.80665 * (0.00028 * size.pressure_kPa * root + 3.45)


def mass_band_kg(size: TyreSize) -> tuple[float, float]:
    if kind(size) == "light truck":
        return 15.0, 25.0
    first, m1, second, m2, share = KNOWN[kind(size)]
    x1, x2 = extent(parse_size(first)), extent(parse_size(second))
    mass = m1 * (extent(size) / x1) ** (log(m2 / m1) / log(x2 / x1))
    return (1 - share) * mass, (1 + share) * mass


def quicker(case: str) -> str:
    """The case with fewer elements round the tyre and along its coarse section, for the road: a
    205/55R16 is 1.3 % stiffer so (245.5 in place of 242.3 N/mm), in half of the time."""
    words = ("elements: {", "}")
    start = case.index(words[0], case.index("coarse:"))
    end = case.index(words[1], start)
    elements = case[start:end]
    for region, most in (("crown", 4), ("upper_sidewall", 2), ("lower_sidewall", 1), ("filler", 1)):
        elements = re.sub(rf"\b{region}: \d+", f"{region}: {most}", elements)
    angles = "element_angles_deg: [5.0, 6.0, 9.0, 20.0, 50.0, 90.0]"
    return (case[:start] + elements + case[end:]).replace("road:\n", f"road:\n  {angles}\n")


def computed(code: str) -> dict[str, Any]:
    """Mass, modes and footprint by the command line."""
    size = parse_size(code)
    with TemporaryDirectory() as folder:

        def tyrecal(*words: str) -> Any:
            done = subprocess.run(
                [sys.executable, "-m", "tyrecal", *words],
                cwd=folder,
                capture_output=True,
                text=True,
            )
            if done.returncode:
                return {"error": done.stderr.strip().splitlines()[-1][:200]}
            return json.loads(done.stdout) if "--json" in words else None

        row: dict[str, Any] = {"code": code, "kPa": size.pressure_kPa, "load_N": size.load_N}
        failed = tyrecal("init", code, "--output", "tyre.yaml", "--no-pictures", "--quiet")
        if failed:
            return {**row, **failed}
        quick = ("--mesh", "coarse", "--no-pictures", "--no-store", "--json")
        modes = tyrecal("modes", "tyre.yaml", *quick)
        if "error" in modes:
            return {**row, **modes}
        row["mass_kg"] = modes["mass_kg"]
        row["modes"] = [
            (m["c"], m["m"], m["kind"], round(m["frequency_Hz"], 2)) for m in modes["modes"]
        ]
        case = Path(folder, "tyre.yaml")
        case.write_text(quicker(case.read_text()))
        pressed = tyrecal("footprint", "tyre.yaml", "--loads-N", f"{size.load_N:.0f}", *quick)
        if "error" in pressed:
            return {**row, **pressed}
        last = pressed["rows"][-1]
        row["stiffness_N_per_mm"] = last["vertical_stiffness_N_per_m"] / 1e3
        row["deflection_mm"] = 1e3 * last["deflection_m"]
        return row


def verdict(row: dict[str, Any]) -> str:
    size = parse_size(row["code"])
    if "error" in row:
        return row["error"]
    wrong = []
    labels = [(c, m) for c, m, *_ in row["modes"]]
    if any(labels.count(each) < SIXTEEN.count(each) for each in SIXTEEN):
        wrong.append("modes")
    low, high = mass_band_kg(size)
    if not low <= row["mass_kg"] <= high:
        wrong.append(f"mass, {low:.1f} to {high:.1f}")
    least, most = STIFFNESS_N_PER_MM[kind(size)]
    if not least <= row["stiffness_N_per_mm"] <= most:
        wrong.append(f"stiffness, {least} to {most}")
    return "; ".join(wrong) or "within"


def main(record: Path) -> None:
    known = (
        [json.loads(line) for line in record.read_text().splitlines()] if record.exists() else []
    )
    rows = {row["code"]: row for row in known}
    print(
        "| size | kPa | N | kg | lateral | torsional | [1,0] | [2,0] | N/mm | Rhyne | mm | bands |"
    )
    print("|---" * 12 + "|")
    forty = [*PASSENGER, *SUV, *LIGHT_TRUCK, *TRUCK]
    good, off = 0, list[float]()
    for code in [*forty, *BEYOND]:
        if code not in rows:
            rows[code] = computed(code)
            with record.open("a") as file:
                file.write(json.dumps(rows[code]) + "\n")
        row = rows[code]
        Hz = {(c, m, k): f for c, m, k, f in row.get("modes", [])}
        shown = [
            Hz.get(k, float("nan"))
            for k in ((0, 0, "axial"), (0, 0, "torsional"), (1, 0, None), (2, 0, None))
        ]
        stiffness = row.get("stiffness_N_per_mm", float("nan"))
        rhyne = rhyne_N_per_mm(parse_size(code))
        off.append(stiffness / rhyne - 1)
        numbers = [stiffness, rhyne, row.get("deflection_mm", float("nan"))]
        print(
            f"| {code} | {row['kPa']:g} | {row['load_N']:.0f} | {row.get('mass_kg', 0):.1f} |"
            + "".join(f" {f:.1f} |" for f in (*shown, *numbers))
            + f" {verdict(row)} |",
            flush=True,
        )
        good += code in forty and verdict(row) == "within"
    print(f"\n{good} of {len(forty)} within their bands; stiffness over Rhyne's:", end=" ")
    print(f"{100 * min(off):+.0f} to {100 * max(off):+.0f} %")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
