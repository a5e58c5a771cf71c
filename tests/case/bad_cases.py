"""Wrong cases: what is wrong, made from a case that is right, and what must be said of it.

``write(name, folder)`` puts one on disk; ``BAD`` says the key and words to expect.
"""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

CASES = Path(__file__).parents[2] / "cases"
GOOD = (CASES / "p235_75r17.yaml").read_text()
TABLE = (CASES / "p235_75r17.csv").read_text()
CSV = "p235_75r17.csv"
STATIONS = "section.stations"


@dataclass(frozen=True)
class Bad:
    """``key`` and ``words`` that a mistake must have; ``write`` makes the case in a folder."""

    key: str
    words: str
    write: Callable[[Path], Path]


BAD: dict[str, Bad] = {}


def write(name: str, folder: Path) -> Path:
    """Put the wrong case ``name`` into ``folder``, its station table too; the path to give."""
    (folder / CSV).write_text(TABLE)
    return BAD[name].write(folder)


def _content(name: str, key: str, words: str, content: str | bytes) -> None:
    def put(folder: Path) -> Path:
        path = folder / "case.yaml"
        path.write_bytes(content.encode() if isinstance(content, str) else content)
        return path

    assert name not in BAD
    BAD[name] = Bad(key, words, put)


def _edit(name: str, key: str, words: str, *edits: str) -> None:
    """Edits are pairs: text of the good case, text in its place (first occurrence)."""
    content = GOOD
    for old, new in zip(edits[::2], edits[1::2], strict=True):
        assert old in content, old
        content = content.replace(old, new, 1)
    _content(name, key, words, content)


def _table(name: str, words: str, table: str | bytes) -> None:
    def put(folder: Path) -> Path:
        (folder / CSV).write_bytes(table.encode() if isinstance(table, str) else table)
        path = folder / "case.yaml"
        path.write_text(GOOD)
        return path

    BAD[name] = Bad(STATIONS, words, put)


def _made(name: str, key: str, words: str, put: Callable[[Path], Path]) -> None:
    BAD[name] = Bad(key, words, put)


RUBBER = "materials.rubber"
C10 = "    C10_Pa: 1.0e+6\n"
PRESSURE = "pressure_kPa: 240.0"
SPACING = "spacing_m: 1.16e-3"
AXIAL = "{c: 0, m: 0, kind: axial, frequency_Hz: 31.7}"
ROWS = "rows: [1, 1, 1, 3] "
SOLID = "- {material: rubber}"
MORE = SOLID + "\n  - {material: rubber, "
NAME = "stations: p235_75r17.csv"

# numbers
_edit("missing_key", f"{RUBBER}.C10_Pa", "must be given", C10, "")
_edit("missing_part", "rim", "must be given", "rim:\n  reference_point_m: {r: 0.0, z: 0.0} ", "#")
_edit("text_for_number", "pressure_kPa", "must be a number", PRESSURE, "pressure_kPa: high")
_edit("quoted_number", "pressure_kPa", "must be a number", PRESSURE, 'pressure_kPa: "240.0"')
_edit("decimal_comma", "pressure_kPa", "must be a number", PRESSURE, "pressure_kPa: 240,0")
_edit("nan", "pressure_kPa", "finite", PRESSURE, "pressure_kPa: .nan")
_edit("infinite", "pressure_kPa", "finite", PRESSURE, "pressure_kPa: .inf")
_edit("overflow", "pressure_kPa", "finite", PRESSURE, "pressure_kPa: 1e999")
_edit("endless_digits", "pressure_kPa", "finite", PRESSURE, "pressure_kPa: " + "9" * 9000)
_edit("nan_option", "solver.options.x", "finite", "options: {}", "options: {x: .nan}")
_edit("bool_for_number", "pressure_kPa", "must be a number", PRESSURE, "pressure_kPa: true")
_edit("list_for_number", "pressure_kPa", "must be a number", PRESSURE, "pressure_kPa: [240]")
_edit("table_for_number", "pressure_kPa", "must be a number", PRESSURE, "pressure_kPa: {a: 1}")
_edit("null_for_number", "pressure_kPa", "must be a number", PRESSURE, "pressure_kPa:")
_edit("date_for_number", "pressure_kPa", "must be a number", PRESSURE, "pressure_kPa: 2020-01-01")
_edit("number_for_text", "size", "must be text", "size: P235/75R17", "size: 235")
_edit("huge_pressure", "pressure_kPa", "less than 2000", PRESSURE, "pressure_kPa: 240000.0")
_edit("negative_pressure", "pressure_kPa", "at least 0", PRESSURE, "pressure_kPa: -1")
_edit("format", "format", "at most 1", "format: 1", "format: 2")
_edit("format_true", "format", "whole number", "format: 1", "format: true")
_edit("line_break_in_name", "size", "line breaks", "size: P235/75R17", 'size: "a\\n*STEP"')
# materials
_edit("negative_density", f"{RUBBER}.density_kg_per_m3", "greater than 0", "1100.0", "-1100.0")
_edit("soft_rubber", f"{RUBBER}.C10_Pa", "C10_Pa + C01_Pa", "C01_Pa: 0.0", "C01_Pa: -2.0e+6")
_edit("zero_D1", f"{RUBBER}.D1_per_Pa", "greater than 0", "5.085e-8", "0.0")
_edit("prony_share", f"{RUBBER}.prony.0.g", "less than 1", "g: 0.3", "g: 1.3")
_edit(
    "prony_sum",
    f"{RUBBER}.prony",
    "sum of all g",
    "tau_s: 0.1}",
    "tau_s: 0.1}, {g: 0.8, k: 0.0, tau_s: 1.0}",
)
_edit("prony_time", f"{RUBBER}.prony.0.tau_s", "greater than 0", "tau_s: 0.1", "tau_s: 0")
_edit(
    "poisson",
    "materials.belt_cord.poissons_ratio",
    "less than 0.5",
    "poissons_ratio: 0.3",
    "poissons_ratio: 0.5",
)
_edit("zero_modulus", "materials.belt_cord.youngs_modulus_Pa", "greater than 0", "172.2e+9", "0")
_edit("moduli", f"{RUBBER}.moduli", "'instantaneous'", "moduli: long_term", "moduli: short")
_edit("unknown_kind", f"{RUBBER}.kind", "'cord'", "kind: rubber ", "kind: steel ")
_edit("no_kind", f"{RUBBER}.kind", "must be given", "    kind: rubber  ", "    #")
_edit("unknown_key", f"{RUBBER}.C10_MPa", "did you mean 'C10_Pa'", C10, C10 + "    C10_MPa: 1.0\n")
_edit("misspelt_key", "presure_kPa", "did you mean 'pressure_kPa'", PRESSURE, "presure_kPa: 240.0")
_edit("material_name", "materials.belt cord", "one word", "  belt_cord:", '  "belt cord":')
_edit("same_name", "materials.BELT_CORD", "upper case", "  carcass_cord:\n", "  BELT_CORD:\n")
# solids and cords
_edit(
    "unknown_material", "solids.0.material", "did you mean 'rubber'", SOLID, "- {material: ruber}"
)
_edit("cord_as_solid", "solids.0.material", "must be a rubber", SOLID, "- {material: belt_cord}")
_edit(
    "unknown_region", "solids.1.regions.0", "did you mean 'crown'", SOLID, MORE + "regions: [crow]}"
)
_edit(
    "unknown_between",
    "solids.1.between.1",
    "did you mean 'outer'",
    SOLID,
    MORE + "between: [belt2, auter]}",
)
_edit(
    "between_order",
    "solids.1.between",
    "inner line first",
    SOLID,
    MORE + "between: [outer, belt2]}",
)
_edit(
    "between_three", "solids.1.between", "at most 2", SOLID, MORE + "between: [inner, ply, belt2]}"
)
_edit("no_solids", "solids", "at least 1", "solids:  ", "solids: [] #", "  " + SOLID, "")
_edit(
    "bare_region",
    "solids",
    "must cover the section",
    SOLID,
    "- {material: rubber, regions: [crown]}",
)
_edit(
    "unknown_line", "rebar_layers.belt_1.line", "did you mean 'belt2'", "line: belt1", "line: belt3"
)
_edit("outer_line", "rebar_layers.belt_1.line", "inside the section", "line: belt1", "line: outer")
_edit(
    "rubber_as_cord",
    "rebar_layers.carcass.material",
    "must be a cord",
    "material: carcass_cord",
    "material: rubber",
)
_edit("zero_spacing", "rebar_layers.belt_1.spacing_m", "greater than 0", SPACING, "spacing_m: 0.0")
_edit("no_spacing", "rebar_layers.belt_1.spacing_m", "must be given", f"{SPACING}, ", "")
_edit(
    "angular_spacing",
    "rebar_layers.belt_1.spacing_deg",
    "must be given",
    SPACING,
    "geometry: angular",
)
_edit(
    "both_spacings",
    "rebar_layers.belt_1.spacing_deg",
    "must be absent",
    SPACING,
    f"{SPACING}, spacing_deg: 1.0",
)
_edit("angle", "rebar_layers.belt_1.angle_deg", "at most 180", "angle_deg: 70.0", "angle_deg: 700")
# mesh
_edit(
    "unknown_level", "mesh.level", "did you mean 'default'", "level: default\n", "level: defalt\n"
)
_edit("unknown_element", "mesh.element", "'CGAX8R'", "element: CGAX8R", "element: C3D8")
_edit("too_few_rows", "mesh.levels.default.rows", "must have 4 entries", ROWS, "rows: [1, 1, 3] ")
_edit("no_rows", "mesh.levels.default.rows", "must have 4 entries", ROWS, "rows: [] ")
_edit("half_row", "mesh.levels.default.rows.3", "whole number", ROWS, "rows: [1, 1, 1, 2.5] ")
_edit("zero_row", "mesh.levels.default.rows.0", "at least 1", ROWS, "rows: [0, 1, 1, 3] ")
_edit("missing_elements", "mesh.levels.default.elements.bead", "must be given", ", bead: 2}", "}")
_edit(
    "too_many_elements",
    "mesh.levels.default.elements.crown",
    "at most 200",
    "crown: 8,",
    "crown: 8000,",
)
_edit(
    "elements_elsewhere",
    "mesh.levels.default.elements.shoulder",
    "not a region",
    "bead: 2}",
    "bead: 2, shoulder: 3}",
)
_edit("grading", "mesh.levels.default.grading.3", "at least 0.1", "1.0, 0.7]", "1.0, 0.0]")
_edit("grading_length", "mesh.levels.default.grading", "must have 4", "1.0, 0.7]", "0.7]")
# analysis, solver
_edit("few_sectors", "analysis.sectors", "at least 8", "sectors: 60", "sectors: 3")
_edit("harmonics", "analysis.highest_harmonic", "at most 20", "harmonic: 4", "harmonic: 400")
ROAD = "road: {loads_N: [500, 500]}\nsolver:"
_edit("loads_not_rising", "road.loads_N", "must rise", "solver:", ROAD)
_edit("negative_load", "road.loads_N.1", "greater than 0", "solver:", ROAD.replace(", 5", ", -5"))
_edit("no_loads", "road.loads_N", "at least 1", "solver:", "road: {loads_N: []}\nsolver:")
_edit("slippery", "road.friction", "at least 0", "solver:", "road: {friction: -0.1}\nsolver:")
_edit(
    "around",
    "road.element_angles_deg",
    "sum 180, got 190",
    "solver:",
    "road: {element_angles_deg: [10, 180]}\nsolver:",
)
_edit("road_key", "road.frction", "'friction'", "solver:", "road: {frction: 0.1}\nsolver:")
_edit("no_modes", "analysis.modes_per_harmonic", "at least 1", "per_harmonic: 2", "per_harmonic: 0")
_edit("solver_number", "solver.name", "must be text", "name: bundled", "name: 7")
_edit("no_time", "solver.time_limit_s", "greater than 0", "time_limit_s: 300", "time_limit_s: 0")
# variables
_edit(
    "crossed_bounds", "variables.C10.upper", "greater than lower", "upper: 1.0e+7", "upper: 1.0e+4"
)
_edit("start_outside", "variables.C10.start", "at most upper", "start: 1.0e+6", "start: 1.0e+8")
_edit("log_of_zero", "variables.C10.lower", "scale: linear", "lower: 1.0e+5", "lower: 0.0")
_edit(
    "bound_refused",
    "variables.A_carcass.lower",
    "greater than 0",
    "lower: 1.0e-8",
    "lower: -1.0\n    scale: linear",
)
_edit(
    "sets_nothing", "variables.C10.sets.0", "did you mean 'C10_Pa'", "rubber.C10_Pa]", "rubber.C10]"
)
_edit("sets_text", "variables.C10.sets.0", "no number", "[materials.rubber.C10_Pa]", "[size]")
_edit(
    "sets_whole",
    "variables.C10.sets.0",
    "whole number",
    "[materials.rubber.C10_Pa]",
    "[analysis.sectors]",
)
_edit(
    "sets_target",
    "variables.C10.sets.0",
    "cannot set targets",
    "[materials.rubber.C10_Pa]",
    "[targets.modes.0.frequency_Hz]",
)
_edit(
    "set_twice",
    "variables.A_carcass.sets.0",
    "by 'A_belt' already",
    "[rebar_layers.carcass.area_m2]",
    "[rebar_layers.belt_1.area_m2]",
)
_edit("sets_empty", "variables.C10.sets", "at least 1", "[materials.rubber.C10_Pa]", "[]")
# uncertainties
_edit("no_size", "uncertainties.pressure.percent", "or absolute", "absolute: 1.0}", "}")
_edit(
    "two_sizes",
    "uncertainties.pressure.absolute",
    "absent with percent",
    "[pressure_kPa], absolute: 1.0}",
    "[pressure_kPa], absolute: 1.0, percent: 1.0}",
)
_edit(
    "uncertain_nothing",
    "uncertainties.pressure.sets.0",
    "did you mean 'pressure_kPa'",
    "sets: [pressure_kPa]",
    "sets: [pressure]",
)
_edit(
    "uncertain_text",
    "uncertainties.pressure.sets.0",
    "no number",
    "sets: [pressure_kPa]",
    "sets: [name]",
)
_edit(
    "uncertain_effect",
    "uncertainties.rim_width.sets.0",
    "not one of the effects",
    "sets: [effects.rim_width]",
    "sets: [effects.rim_widht]",
)
_edit(
    "percent_of_an_effect",
    "uncertainties.rim_width.sets.0",
    "state 'absolute'",
    "sets: [effects.rim_width], absolute: 1.0e-3",
    "sets: [effects.rim_width], percent: 3.0",
)
_edit(
    "percent_of_nothing",
    "uncertainties.carcass_angle.sets.0",
    "state 'absolute'",
    "[rebar_layers.carcass.angle_deg], absolute: 1.0",
    "[rebar_layers.carcass.angle_deg], percent: 3.0",
)
_edit(
    "too_few_signs",
    "uncertainties.pressure.signs",
    "must have 1 entries",
    "[pressure_kPa], absolute: 1.0}",
    "[pressure_kPa], absolute: 1.0, signs: [1, -1]}",
)

# targets
_edit("unknown_label", "targets.modes.0.kind", "'torsional'", AXIAL, AXIAL.replace("axial", "axle"))
_edit(
    "no_label",
    "targets.modes.0.kind",
    "axial or torsional",
    AXIAL,
    "{c: 0, m: 0, frequency_Hz: 31.7}",
)
_edit(
    "kind_too_many",
    "targets.modes.2.kind",
    "must be absent",
    "{c: 1, m: 1,",
    "{c: 1, m: 1, kind: axial,",
)
_edit("same_target", "targets.modes.3", "already", "{c: 1, m: 0,", "{c: 1, m: 1,")
_edit("high_target", "targets.modes.8.c", "highest_harmonic", "{c: 4, m: 0,", "{c: 5, m: 0,")
_edit("zero_frequency", "targets.modes.0.frequency_Hz", "greater than 0", "31.7", "0")
_edit("negative_weight", "targets.modes.0.weight", "at least 0", "31.7}", "31.7, weight: -1}")
FOOTPRINT = """  footprint:
    - {load_N: 4000, contact_area_m2: 0.0158, sigma_m2: 0.0003}
uncertainties:"""


def _footprint(name: str, key: str, words: str, *edits: str) -> None:
    """Edits of a good footprint target, which stands before ``uncertainties``."""
    text = FOOTPRINT
    for old, new in zip(edits[::2], edits[1::2], strict=True):
        assert old in text, old
        text = text.replace(old, new, 1)
    _edit(name, f"targets.footprint{key}", words, "\nuncertainties:", f"\n{text}")


AREA, SIGMA = "contact_area_m2: 0.0158", ", sigma_m2: 0.0003"
STIFF = "vertical_stiffness_N_per_m: 2.3e+5"
_footprint("no_load", ".0.load_N", "must be given", "load_N: 4000, ", "")
_footprint("load_below_zero", ".0.load_N", "greater than 0", "4000", "-4000")
_footprint("nothing_measured", ".0.load_N", "contact_area_m2 or", f", {AREA}{SIGMA}", "")
_footprint("area_zero", ".0.contact_area_m2", "greater than 0", "0.0158", "0")
_footprint("area_without_sigma", ".0.sigma_m2", "must be given: the standard", SIGMA, "")
_footprint("sigma_zero", ".0.sigma_m2", "greater than 0", "0.0003", "0.0")
_footprint("sigma_of_other", ".0.sigma_m2", "must be absent", AREA, STIFF)
_footprint("stiffness_without_sigma", ".0.sigma_N_per_m", "must be given", AREA, STIFF)
_footprint("two_in_one", ".0.vertical_stiffness_N_per_m", "of its own", AREA, f"{AREA}, {STIFF}")
_footprint("area_key", ".0.area_m2", "did you mean", "contact_area_m2", "area_m2")
_footprint("area_text", ".0.contact_area_m2", "must be a number", "0.0158", "158 cm2")
_footprint("footprint_weight", ".0.weight", "at least 0", "0.0003", "0.0003, weight: -1")
_footprint(
    "same_footprint",
    ".1",
    "contact_area_m2 at 4000 N is a target already",
    "\nuncertainties:",
    "\n    - {load_N: 4000.0, contact_area_m2: 0.016, sigma_m2: 0.001}\nuncertainties:",
)
_footprint("footprint_table", "", "must be a list", "    - {load_N", "    {load_N")
_edit("zero_sigma", "targets.modes.0.sigma_Hz", "greater than 0", "31.7}", "31.7, sigma_Hz: 0}")
# YAML
_edit("duplicate_key", "pressure_kPa", "on line 6 already", PRESSURE, f"{PRESSURE}\n{PRESSURE}")
_edit("python_tag", "", "tag", "name: P235", "name: !!python/object/apply:os.system [x] #")
_edit("anchor_tag", "", "tag", PRESSURE, "pressure_kPa: !!float 240.0")
_edit("alias", "", "alias", "crown: 16", "crown: &a 16", "upper_sidewall: 16", "upper_sidewall: *a")
_edit("merge_key", "", "plain word", PRESSURE, f"{PRESSURE}\n<<: {{a: 1}}")
_edit("number_key", "", "plain word", PRESSURE, f"{PRESSURE}\n3: 4")
_edit("comma_in_braces", "", "'frequency_Hz' before it a comma", "31.7}", "31,7}")
_edit("list_key", "", "plain word", PRESSURE, f"{PRESSURE}\n? [a]\n: 4")
_edit("tabs", "", "spaces, not tabs", "  stations:", "\tstations:")
_edit("open_bracket", "", "not YAML", "prony: [{g", "prony: [[{g")
_edit("control_character", "", "not YAML", "bundled", "bund\x01led")
_edit("two_documents", "", "not YAML", "solver:", "---\nuncertainties:")
LAUGHS = [f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 9)}]" for i in range(1, 12)]
_content("alias_bomb", "", "alias", "\n".join(["a0: &a0 [x]", *LAUGHS]))
_content("deep_nest", "", "deep", "a: " + "[" * 5000)
_content("empty", "", "empty", "")
_content("comments_only", "", "keys and values", "# nothing\n")
_content("text_only", "", "keys and values", "hello")
_content("list_only", "", "keys and values", "- 1\n- 2\n")
_content("binary", "", "UTF-8", b"\x7fELF\xff\xfe\x00\x01")
_content("latin_1", "", "UTF-8", GOOD.replace("P235", "Größe", 1).encode("latin-1"))
_content("huge", "", "larger than", GOOD + "#" * 1_000_000)
# files
_made("missing_file", "", "no such file", lambda folder: folder / "nothing.yaml")
_made("directory", "", "directory", lambda folder: folder)
_edit("absolute_path", STATIONS, "inside the case's folder", NAME, "stations: /etc/passwd")
_edit("parent_path", STATIONS, "inside the case's folder", NAME, "stations: ../p235_75r17.csv")
_edit("missing_table", STATIONS, "none of this name", NAME, "stations: other.csv")
_edit("long_path", STATIONS, "cannot be read", NAME, "stations: " + "x" * 290)
_edit(
    "parent_templates", "templates", "inside the case's", PRESSURE, f"{PRESSURE}\ntemplates: ../t"
)
_edit("missing_templates", "templates", "must be a folder", PRESSURE, f"{PRESSURE}\ntemplates: t")


def _link(folder: Path) -> Path:
    (folder / CSV).unlink()
    (folder / CSV).symlink_to(CASES / CSV)
    shutil.copy(CASES / "p235_75r17.yaml", folder / "case.yaml")
    return folder / "case.yaml"


_made("link_outside", STATIONS, "link to a place outside", _link)


# station tables
ROW = TABLE.splitlines()


def _row(number: int, row: str) -> str:
    return "\n".join([*ROW[:number], row, *ROW[number + 1 :]]) + "\n"


_table("semicolons", "separated by commas", TABLE.replace(",", ";"))
_table("tabulators", "separated by commas", TABLE.replace(",", "\t"))
METRES = re.sub(r"(\d+\.\d+)", lambda mm: f"{float(mm[1]) / 1000:.8f}", TABLE)
_table("metres", "must be in mm", METRES)
_table("column_missing", "'ply_z_mm' is missing", TABLE.replace("ply_z_mm", "ply_x_mm", 1))
_table("line_missing", "'ply_r_mm' is missing", TABLE.replace("ply_r_mm", "ply_rmm", 1))
_table("column_twice", "given 2 times", TABLE.replace("station,", "region,", 1))
_table("text_in_table", "must be a number in mm", _row(3, ROW[3].replace("376.24637", "wide")))
_table("nan_in_table", "finite number in mm", _row(3, ROW[3].replace("376.24637", "nan")))
_table("rigid_two", "rigid is '2'", _row(3, ROW[3][:-1] + "2"))
_table("off_centre", "z = 0", _row(1, ROW[2]))
_table("gap_in_inner", "every station", _row(3, ROW[3].replace("376.24637", "")))
_table("short_row", "values for 13 columns", _row(3, ROW[3].rpartition(",")[0]))
_table("comma_in_row", "values for 13 columns", _row(3, ROW[3].replace("376.24637", "376,24637")))
_table("three_stations", "too few", "\n".join(ROW[:3]))
_table(
    "region_returns", "follow one another", _row(100, ROW[100].replace("upper_sidewall", "crown"))
)
_table("empty_table", "empty", "")
_table("binary_table", "UTF-8", b"\xff\xfe\x00")
_table("huge_table", "larger than", TABLE + " " * 1_000_000)
_table("not_held", "held by the rim", "\n".join([ROW[0], *(r[:-1] + "0" for r in ROW[1:])]))
BACK = [
    f"{a.split(',')[0]},{b.partition(',')[2]}"
    for a, b in zip(ROW[20:60], ROW[59:19:-1], strict=True)
]
_table("folds_over", "folds over", "\n".join([*ROW[:20], *BACK, *ROW[60:]]))
