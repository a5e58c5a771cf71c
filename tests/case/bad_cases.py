"""Wrong cases, all of them: those of wrong values are listed here."""

from __future__ import annotations

from .wrong import BAD as BAD
from .wrong import CASES as CASES
from .wrong import CSV as CSV
from .wrong import GOOD as GOOD
from .wrong import PRESSURE, edit
from .wrong import TABLE as TABLE
from .wrong import write as write

RUBBER = "materials.rubber"
C10 = "    C10_Pa: 1.0e+6\n"
SPACING = "spacing_m: 1.16e-3"
AXIAL = "{c: 0, m: 0, kind: axial, frequency_Hz: 31.7}"
ROWS = "rows: [1, 1, 1, 3] "
SOLID = "- {material: rubber}"
MORE = SOLID + "\n  - {material: rubber, "

# numbers
edit("missing_key", f"{RUBBER}.C10_Pa", "must be given", C10, "")
edit("missing_part", "rim", "must be given", "rim:\n  reference_point_m: {r: 0.0, z: 0.0} ", "#")
edit("text_for_number", "pressure_kPa", "must be a number", PRESSURE, "pressure_kPa: high")
edit("quoted_number", "pressure_kPa", "must be a number", PRESSURE, 'pressure_kPa: "240.0"')
edit("decimal_comma", "pressure_kPa", "must be a number", PRESSURE, "pressure_kPa: 240,0")
edit("nan", "pressure_kPa", "finite", PRESSURE, "pressure_kPa: .nan")
edit("infinite", "pressure_kPa", "finite", PRESSURE, "pressure_kPa: .inf")
edit("overflow", "pressure_kPa", "finite", PRESSURE, "pressure_kPa: 1e999")
edit("endless_digits", "pressure_kPa", "finite", PRESSURE, "pressure_kPa: " + "9" * 9000)
edit("nan_option", "solver.options.x", "finite", "options: {}", "options: {x: .nan}")
edit("bool_for_number", "pressure_kPa", "must be a number", PRESSURE, "pressure_kPa: true")
edit("list_for_number", "pressure_kPa", "must be a number", PRESSURE, "pressure_kPa: [240]")
edit("table_for_number", "pressure_kPa", "must be a number", PRESSURE, "pressure_kPa: {a: 1}")
edit("null_for_number", "pressure_kPa", "must be a number", PRESSURE, "pressure_kPa:")
edit("date_for_number", "pressure_kPa", "must be a number", PRESSURE, "pressure_kPa: 2020-01-01")
edit("number_for_text", "size", "must be text", "size: P235/75R17", "size: 235")
edit("huge_pressure", "pressure_kPa", "less than 2000", PRESSURE, "pressure_kPa: 240000.0")
edit("negative_pressure", "pressure_kPa", "at least 0", PRESSURE, "pressure_kPa: -1")
edit("format", "format", "at most 1", "format: 1", "format: 2")
edit("format_true", "format", "whole number", "format: 1", "format: true")
edit("line_break_in_name", "size", "line breaks", "size: P235/75R17", 'size: "a\\n*STEP"')
edit("name_from_right_to_left", "name", "marks of direction", "name: ", 'name: "\u202ex" # ')
edit("keyword_as_name", "name", "must not begin with *", "name: ", 'name: "*INCLUDE, INPUT=x" # ')
# materials
edit("negative_density", f"{RUBBER}.density_kg_per_m3", "greater than 0", "1100.0", "-1100.0")
edit("soft_rubber", f"{RUBBER}.C10_Pa", "C10_Pa + C01_Pa", "C01_Pa: 0.0", "C01_Pa: -2.0e+6")
edit("zero_D1", f"{RUBBER}.D1_per_Pa", "greater than 0", "5.085e-8", "0.0")
edit("prony_share", f"{RUBBER}.prony.0.g", "less than 1", "g: 0.3", "g: 1.3")
edit(
    "prony_sum",
    f"{RUBBER}.prony",
    "sum of all g",
    "tau_s: 0.1}",
    "tau_s: 0.1}, {g: 0.8, k: 0.0, tau_s: 1.0}",
)
edit("prony_time", f"{RUBBER}.prony.0.tau_s", "greater than 0", "tau_s: 0.1", "tau_s: 0")
edit(
    "poisson",
    "materials.belt_cord.poissons_ratio",
    "less than 0.5",
    "poissons_ratio: 0.3",
    "poissons_ratio: 0.5",
)
edit("zero_modulus", "materials.belt_cord.youngs_modulus_Pa", "greater than 0", "172.2e+9", "0")
edit("moduli", f"{RUBBER}.moduli", "'instantaneous'", "moduli: long_term", "moduli: short")
edit("unknown_kind", f"{RUBBER}.kind", "'cord'", "kind: rubber ", "kind: steel ")
edit("no_kind", f"{RUBBER}.kind", "must be given", "    kind: rubber  ", "    #")
edit("unknown_key", f"{RUBBER}.C10_MPa", "did you mean 'C10_Pa'", C10, C10 + "    C10_MPa: 1.0\n")
edit("misspelt_key", "presure_kPa", "did you mean 'pressure_kPa'", PRESSURE, "presure_kPa: 240.0")
edit("material_name", "materials.belt cord", "one word", "  belt_cord:", '  "belt cord":')
edit("same_name", "materials.BELT_CORD", "upper case", "  carcass_cord:\n", "  BELT_CORD:\n")
# solids and cords
edit("unknown_material", "solids.0.material", "did you mean 'rubber'", SOLID, "- {material: ruber}")
edit("cord_as_solid", "solids.0.material", "must be a rubber", SOLID, "- {material: belt_cord}")
edit(
    "unknown_region", "solids.1.regions.0", "did you mean 'crown'", SOLID, MORE + "regions: [crow]}"
)
edit(
    "unknown_between",
    "solids.1.between.1",
    "did you mean 'outer'",
    SOLID,
    MORE + "between: [belt2, auter]}",
)
edit(
    "between_order",
    "solids.1.between",
    "inner line first",
    SOLID,
    MORE + "between: [outer, belt2]}",
)
edit(
    "between_three", "solids.1.between", "at most 2", SOLID, MORE + "between: [inner, ply, belt2]}"
)
edit("no_solids", "solids", "at least 1", "solids:  ", "solids: [] #", "  " + SOLID, "")
edit(
    "bare_region",
    "solids",
    "must cover the section",
    SOLID,
    "- {material: rubber, regions: [crown]}",
)
edit(
    "unknown_line", "rebar_layers.belt_1.line", "did you mean 'belt2'", "line: belt1", "line: belt3"
)
edit(
    "other_line", "rebar_layers.belt_1.line", "not a line of the section", "line: belt1", "line: x"
)
edit(
    "rubber_as_cord",
    "rebar_layers.carcass.material",
    "must be a cord",
    "material: carcass_cord",
    "material: rubber",
)
edit("zero_spacing", "rebar_layers.belt_1.spacing_m", "greater than 0", SPACING, "spacing_m: 0.0")
edit("no_spacing", "rebar_layers.belt_1.spacing_m", "must be given", f"{SPACING}, ", "")
edit(
    "angular_spacing",
    "rebar_layers.belt_1.spacing_deg",
    "must be given",
    SPACING,
    "geometry: angular",
)
edit(
    "both_spacings",
    "rebar_layers.belt_1.spacing_deg",
    "must be absent",
    SPACING,
    f"{SPACING}, spacing_deg: 1.0",
)
edit("angle", "rebar_layers.belt_1.angle_deg", "at most 180", "angle_deg: 70.0", "angle_deg: 700")
# mesh
edit("unknown_level", "mesh.level", "did you mean 'default'", "level: default\n", "level: defalt\n")
edit("unknown_element", "mesh.element", "'CGAX8R'", "element: CGAX8R", "element: C3D8")
edit("too_few_rows", "mesh.levels.default.rows", "must have 4 entries", ROWS, "rows: [1, 1, 3] ")
edit("no_rows", "mesh.levels.default.rows", "must have 4 entries", ROWS, "rows: [] ")
edit("half_row", "mesh.levels.default.rows.3", "whole number", ROWS, "rows: [1, 1, 1, 2.5] ")
edit("zero_row", "mesh.levels.default.rows.0", "at least 1", ROWS, "rows: [0, 1, 1, 3] ")
edit("missing_elements", "mesh.levels.default.elements.bead", "must be given", ", bead: 2}", "}")
edit(
    "too_many_elements",
    "mesh.levels.default.elements.crown",
    "at most 200",
    "crown: 8,",
    "crown: 8000,",
)
edit(
    "elements_elsewhere",
    "mesh.levels.default.elements.shoulder",
    "not a region",
    "bead: 2}",
    "bead: 2, shoulder: 3}",
)
edit("grading", "mesh.levels.default.grading.3", "at least 0.1", "1.0, 0.7]", "1.0, 0.0]")
edit("grading_length", "mesh.levels.default.grading", "must have 4", "1.0, 0.7]", "0.7]")
# analysis, solver
edit("few_sectors", "analysis.sectors", "at least 8", "sectors: 60", "sectors: 3")
edit("harmonics", "analysis.highest_harmonic", "at most 20", "harmonic: 4", "harmonic: 400")
ROAD = "road: {loads_N: [500, 500]}\nsolver:"
edit("loads_not_rising", "road.loads_N", "must rise", "solver:", ROAD)
edit("negative_load", "road.loads_N.1", "greater than 0", "solver:", ROAD.replace(", 5", ", -5"))
edit("no_loads", "road.loads_N", "at least 1", "solver:", "road: {loads_N: []}\nsolver:")
edit("slippery", "road.friction", "at least 0", "solver:", "road: {friction: -0.1}\nsolver:")
edit(
    "around",
    "road.element_angles_deg",
    "sum 180, got 190",
    "solver:",
    "road: {element_angles_deg: [10, 180]}\nsolver:",
)
edit("road_key", "road.frction", "'friction'", "solver:", "road: {frction: 0.1}\nsolver:")
edit("no_modes", "analysis.modes_per_harmonic", "at least 1", "per_harmonic: 2", "per_harmonic: 0")
edit("solver_number", "solver.name", "must be text", "name: bundled", "name: 7")
edit("no_time", "solver.time_limit_s", "greater than 0", "time_limit_s: 300", "time_limit_s: 0")
# variables
edit(
    "crossed_bounds", "variables.C10.upper", "greater than lower", "upper: 1.0e+7", "upper: 1.0e+4"
)
edit("start_outside", "variables.C10.start", "at most upper", "start: 1.0e+6", "start: 1.0e+8")
edit("log_of_zero", "variables.C10.lower", "scale: linear", "lower: 1.0e+5", "lower: 0.0")
edit(
    "bound_refused",
    "variables.A_carcass.lower",
    "greater than 0",
    "lower: 1.0e-8",
    "lower: -1.0\n    scale: linear",
)
edit(
    "sets_nothing", "variables.C10.sets.0", "did you mean 'C10_Pa'", "rubber.C10_Pa]", "rubber.C10]"
)
edit("sets_text", "variables.C10.sets.0", "no number", "[materials.rubber.C10_Pa]", "[size]")
edit(
    "sets_whole",
    "variables.C10.sets.0",
    "whole number",
    "[materials.rubber.C10_Pa]",
    "[analysis.sectors]",
)
edit(
    "sets_target",
    "variables.C10.sets.0",
    "cannot set targets",
    "[materials.rubber.C10_Pa]",
    "[targets.modes.0.frequency_Hz]",
)
edit(
    "set_twice",
    "variables.A_carcass.sets.0",
    "by 'A_belt' already",
    "[rebar_layers.carcass.area_m2]",
    "[rebar_layers.belt_1.area_m2]",
)
edit("sets_empty", "variables.C10.sets", "at least 1", "[materials.rubber.C10_Pa]", "[]")
# uncertainties
edit("no_size", "uncertainties.pressure.percent", "or absolute", "absolute: 1.0}", "}")
edit(
    "two_sizes",
    "uncertainties.pressure.absolute",
    "absent with percent",
    "[pressure_kPa], absolute: 1.0}",
    "[pressure_kPa], absolute: 1.0, percent: 1.0}",
)
edit(
    "uncertain_nothing",
    "uncertainties.pressure.sets.0",
    "did you mean 'pressure_kPa'",
    "sets: [pressure_kPa]",
    "sets: [pressure]",
)
edit(
    "uncertain_text",
    "uncertainties.pressure.sets.0",
    "no number",
    "sets: [pressure_kPa]",
    "sets: [name]",
)
edit(
    "uncertain_effect",
    "uncertainties.rim_width.sets.0",
    "not one of the effects",
    "sets: [effects.rim_width]",
    "sets: [effects.rim_widht]",
)
edit(
    "percent_of_an_effect",
    "uncertainties.rim_width.sets.0",
    "state 'absolute'",
    "sets: [effects.rim_width], absolute: 1.0e-3",
    "sets: [effects.rim_width], percent: 3.0",
)
edit(
    "percent_of_nothing",
    "uncertainties.carcass_angle.sets.0",
    "state 'absolute'",
    "[rebar_layers.carcass.angle_deg], absolute: 1.0",
    "[rebar_layers.carcass.angle_deg], percent: 3.0",
)
edit(
    "too_few_signs",
    "uncertainties.pressure.signs",
    "must have 1 entries",
    "[pressure_kPa], absolute: 1.0}",
    "[pressure_kPa], absolute: 1.0, signs: [1, -1]}",
)

# targets
edit("unknown_label", "targets.modes.0.kind", "'torsional'", AXIAL, AXIAL.replace("axial", "axle"))
edit(
    "no_label",
    "targets.modes.0.kind",
    "axial (lateral) or torsional",
    AXIAL,
    "{c: 0, m: 0, frequency_Hz: 31.7}",
)
edit(
    "kind_too_many",
    "targets.modes.2.kind",
    "must be absent",
    "{c: 1, m: 1,",
    "{c: 1, m: 1, kind: axial,",
)
edit("same_target", "targets.modes.3", "already", "{c: 1, m: 0,", "{c: 1, m: 1,")
edit("high_target", "targets.modes.8.c", "highest_harmonic", "{c: 4, m: 0,", "{c: 5, m: 0,")
edit("zero_frequency", "targets.modes.0.frequency_Hz", "greater than 0", "31.7", "0")
edit("negative_weight", "targets.modes.0.weight", "at least 0", "31.7}", "31.7, weight: -1}")
FOOTPRINT = """  footprint:
    - {load_N: 4000, contact_area_m2: 0.0158, sigma_m2: 0.0003}
uncertainties:"""


def _footprint(name: str, key: str, words: str, *edits: str) -> None:
    """Edits of a good footprint target, which stands before ``uncertainties``."""
    text = FOOTPRINT
    for old, new in zip(edits[::2], edits[1::2], strict=True):
        assert old in text, old
        text = text.replace(old, new, 1)
    edit(name, f"targets.footprint{key}", words, "\nuncertainties:", f"\n{text}")


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
_footprint(
    "two_in_one", ".0.vertical_stiffness_N_per_m", "a separate target", AREA, f"{AREA}, {STIFF}"
)
LENGTH = "contact_length_m: 0.132"
_footprint("length_without_sigma", ".0.sigma_m", "must be given", f"{AREA}{SIGMA}", LENGTH)
_footprint("sigma_of_area", ".0.sigma_m2", "absent", AREA, f"{LENGTH}, sigma_m: 0.002")
_footprint(
    "length_and_width",
    ".0.contact_width_m",
    "a separate target",
    AREA,
    f"{LENGTH}, contact_width_m: 0.1",
)
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
edit("zero_sigma", "targets.modes.0.sigma_Hz", "greater than 0", "31.7}", "31.7, sigma_Hz: 0}")
