"""Results as tables: for a terminal, and as CSV."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from typing import Any

from rich import box
from rich.table import Table
from rich.text import Text

from .words import CLOSE, FAR, motion

NONE = "-"
QUANTITIES = {  # of a footprint target: words, unit over SI, decimals
    "contact_area_m2": ("contact area, cm²", 1e4, 1),
    "vertical_stiffness_N_per_m": ("vertical stiffness, N/mm", 1e-3, 1),
}


def percent(share: float) -> str:
    """A standard error in %, two digits, and never 1.9e+02."""
    return f"{abs(share):.{0 if abs(share) >= 10 else 2}{'f' if abs(share) >= 10 else 'g'}}"


def fit_table(fit: Mapping[str, Any]) -> Table:
    """The content of fit.json like Table 2 of the paper: modes, variables, objective."""
    table = _table(("mode", "motion", "initial", "fitted", "target", "deviation %"))
    for mode in fit["modes"]:
        deviation = mode["deviation_percent"]
        hertz = [f"{mode[key]:.2f}" for key in ("initial_Hz", "fitted_Hz", "target_Hz")]
        _add(table, *_named(mode), *hertz, Text(f"{deviation:+.2f}", _colour(deviation)))
    for pressed in fit.get("footprint", ()):
        name, per_si, digits = QUANTITIES[pressed["quantity"]]
        figures = [f"{pressed[key] * per_si:.{digits}f}" for key in ("initial", "fitted", "target")]
        deviation = pressed["deviation_percent"]
        coloured = Text(f"{deviation:+.2f}", _colour(deviation))
        _add(table, f"{pressed['load_N']:g} N", name, *figures, coloured)
    table.add_section()
    header = ("variable", "", "initial", "fitted", "bounds", "std. err. %")
    _add(table, *(Text(text, "bold") for text in header))
    for name, variable in fit["variables"].items():
        error, value = variable["standard_error"], variable["value"]
        _add(
            table,
            name,
            Text("at bound" if variable["at_bound"] else "", "yellow"),
            f"{variable['initial']:.4g}",
            f"{value:.4g}",
            f"{variable['lower']:g}..{variable['upper']:g}",
            NONE if error is None or not value else percent(100 * error / value),
        )
    for name, value in fit.get("fixed", {}).items():
        _add(table, name, "held", f"{value:.4g}", f"{value:.4g}", NONE, NONE)
    table.add_section()
    objective = (f"{fit[key]:.3f}" for key in ("initial_objective_Hz", "objective_Hz"))
    in_hertz = fit.get("objective_unit", "Hz") == "Hz"
    words = "equation (1)" if in_hertz else "deviations in sigmas"
    _add(table, Text("objective", "bold"), words, *objective, "", "")
    table.caption = f"frequencies{' and objective' * in_hertz} in Hz; {_of(fit)}".rstrip("; ")
    return table


USUAL = "concave", "unknown"  # curvatures over the pressure


def modes_table(modes: Mapping[str, Any]) -> Table:
    """The content of modes.json: one row a mode, in its order."""
    entries = modes["modes"]
    known = ("symmetry", "member", "clarity", "overlap")
    extra = [key for key in known if any(key in mode for mode in entries)]
    table = _table(("mode", "motion", "Hz", *extra))
    load = f", {modes['load_N']:g} N" if modes["load_N"] else ""
    table.title = f"{modes['pressure_kPa']:g} kPa{load}, {modes['mass_kg']:.2f} kg"
    table.caption = _of(modes)
    for mode in entries:
        cells = [mode.get(key, NONE) for key in extra]
        _add(
            table,
            *_named(mode),
            f"{mode['frequency_Hz']:.2f}",
            *(f"{cell:.2f}" if isinstance(cell, float) else str(cell) for cell in cells),
        )
    return table


def _of(result: Mapping[str, Any]) -> str:
    """Tyre, what was set, mesh and solver of a result, in a line."""
    of = result.get("provenance")
    if not of:
        return ""
    given = [f"{name}={value:g}" for name, value in of["overrides"].items()]
    tyre = f"tyre {of['tyre_sha256'][:8]}"
    return ", ".join([tyre, *given, f"mesh {of['mesh']}", f"{of['solver']} {of['solver_version']}"])


def load_table(rows: Sequence[Mapping[str, Any]], design: str) -> Table:
    """One design's modes in load_sweep.json, a line a member of a doublet: Hz at each load."""
    table = _table(("mode", "motion", "symmetry", *(f"{row['load_N']:g} N" for row in rows)))
    table.title = f"{design}, Hz"
    found = [{(*_key(m), m["symmetry"]): m for m in row["modes"]} for row in rows]
    members = {key: mode for modes in reversed(found) for key, mode in modes.items()}
    lowest = {
        _key(m): min(x["frequency_Hz"] for k, x in members.items() if k[:3] == _key(m))
        for m in members.values()
    }
    for key in sorted(members, key=lambda k: (lowest[k[:3]], str(k[:3]), k[3] != "symmetric")):
        hertz = (f"{m[key]['frequency_Hz']:.2f}" if key in m else NONE for m in found)
        _add(table, *_named(members[key]), key[3], *hertz)
    return table


def load_csv(rows: Sequence[Mapping[str, Any]]) -> str:
    """The rows of load_sweep.json as CSV, a line a mode, all digits."""
    keys = ("c", "m", "kind", "symmetry", "frequency_Hz", "overlap", "spanned")
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["design", "load_N", "deflection_m", *keys])
    for row in rows:
        for mode in row["modes"]:
            cells = ["" if mode[key] is None else mode[key] for key in keys]
            writer.writerow([row["design"], row["load_N"], row["deflection_m"], *cells])
    return text.getvalue()


def fit_csv(fit: Mapping[str, Any]) -> str:
    """The modes of fit.json as CSV, all digits; where there are footprint targets, they follow in
    columns of their own."""
    keys = [
        "c",
        "m",
        "kind",
        "multiplicity",
        "initial_Hz",
        "fitted_Hz",
        "target_Hz",
        "deviation_percent",
    ]
    footprint = fit.get("footprint", [])
    if footprint:
        keys += ["load_N", "quantity", "initial", "fitted", "target", "sigma"]
    text = io.StringIO()
    writer = csv.DictWriter(text, keys, restval="", extrasaction="ignore", lineterminator="\n")
    writer.writeheader()
    writer.writerows([*fit["modes"], *footprint])
    return text.getvalue()


def sweep_table(rows: Sequence[Mapping[str, Any]], findings: Mapping[str, Any]) -> Table:
    """One design's modes: Hz at both ends of the sweep, rise, slopes at both ends, curvature."""
    first, last = ({_key(mode): mode for mode in row["modes"]} for row in (rows[0], rows[-1]))
    low, high = findings["from_kPa"], findings["to_kPa"]
    table = _table(
        (
            "mode",
            "motion",
            f"Hz, {low:g} kPa",
            f"{high:g} kPa",
            "rise Hz",
            "rise %",
            "slope",
            f"{high:g} kPa",
            "curvature",
        )
    )
    table.title = findings["design"]
    table.caption = f"slope: d ln f / d ln p, at {low:g} and {high:g} kPa"
    for mode in findings["modes"]:
        ends = first[_key(mode)], last[_key(mode)]
        _add(
            table,
            *_named(ends[0]),
            *(f"{end['frequency_Hz']:.2f}" for end in ends),
            f"{mode['rise_Hz']:+.2f}",
            f"{mode['rise_percent']:+.1f}",
            *(NONE if e["d_ln_f_d_ln_p"] is None else f"{e['d_ln_f_d_ln_p']:.3f}" for e in ends),
            Text(
                mode["curvature"], "" if mode["curvature"] in ("concave", "unknown") else "yellow"
            ),
        )
    return table


def sweep_csv(rows: Sequence[Mapping[str, Any]]) -> str:
    """The rows of pressure_sweep.json as CSV, a line a mode, all digits."""
    keys = ("c", "m", "kind", "multiplicity", "frequency_Hz", "d_ln_f_d_ln_p")
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["design", "pressure_kPa", *keys])
    for row in rows:
        for mode in row["modes"]:
            cells = ["" if mode[key] is None else mode[key] for key in keys]
            writer.writerow([row["design"], row["pressure_kPa"], *cells])
    return text.getvalue()


FOOTPRINT = {  # key of a row: heading, unit over SI, decimals
    "load_N": ("load N", 1.0, 0),
    "deflection_m": ("deflection mm", 1e3, 2),
    "area_m2": ("area cm²", 1e4, 1),
    "length_m": ("length mm", 1e3, 1),
    "width_m": ("width mm", 1e3, 1),
    "mean_pressure_Pa": ("mean kPa", 1e-3, 1),
    "peak_pressure_Pa": ("peak kPa", 1e-3, 1),
    "vertical_stiffness_N_per_m": ("stiffness N/mm", 1e-3, 1),
}


def footprint_table(rows: Sequence[Mapping[str, Any]]) -> Table:
    """The rows of footprint.json, a line a load."""
    table = _table(("design", *(heading for heading, _, _ in FOOTPRINT.values())))
    for row in rows:
        cells = (f"{row[key] * unit:.{n}f}" for key, (_, unit, n) in FOOTPRINT.items())
        _add(table, row["design"], *cells)
    table.caption = "mean and peak: contact pressure; stiffness: tangent at the load"
    return table


def footprint_csv(rows: Sequence[Mapping[str, Any]]) -> str:
    """The rows of footprint.json as CSV, SI units, all digits."""
    text = io.StringIO()
    writer = csv.DictWriter(text, ["design", *FOOTPRINT], lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()


SOLVER_COLUMNS = ("solver", "version", "decks", "can do")


def solvers_table(solvers: Sequence[Mapping[str, Any]]) -> Table:
    """The installed solvers and what they can do, or why they cannot."""
    table = _table(SOLVER_COLUMNS)
    for solver in solvers:
        words = solver["problem"] or ", ".join(solver["capabilities"])
        _add(table, solver["name"], solver["version"] or "", solver["dialect"] or "", words)
    return table


EFFECTS = ("effect", "what", "unit", "solvers")


def effects_table(effects: Sequence[Mapping[str, Any]]) -> Table:
    """The catalogue of effects: parameter's range, solvers that can express it."""
    table = _table((*EFFECTS[:2], "from", "to", *EFFECTS[2:]))
    for each in effects:
        ends = (f"{each[end]:g}" for end in ("low", "high"))
        _add(table, each["id"], each["title"], *ends, each["unit"], ", ".join(each["solvers"]))
    return table


def signatures_table(effects: Sequence[Mapping[str, Any]]) -> Table:
    """How far each effect of effects.json moves the modes, and the variables that follow it."""
    names = list(effects[0]["refitted"])
    table = _table(("effect", "size", "unit", "kg", "before %", "after %", "absorbed %", *names))
    for each in effects:
        figures = (f"{each[key]:.2f}" for key in ("before_percent", "after_percent"))
        absorbed = NONE if each["absorbed"] is None else f"{100 * each['absorbed']:.1f}"
        moved = (_moved(change) for change in each["refitted"].values())
        size = f"{each['value']:g}", each["unit"], f"{each['mass_kg']:+.2f}"
        _add(table, each["id"], *size, *figures, absorbed, *moved)
    table.caption = (
        "rms change of all modes, as it comes and after the best linear re-fit of the variables;"
        " how far that moves them"
    )
    return table


def _moved(change: Mapping[str, float]) -> str:
    before, after = change["before"], change["after"]
    return f"{100 * (after / before - 1):+.1f} %" if before else f"{after - before:+.3g}"


def _table(columns: tuple[str, ...]) -> Table:
    # figures never break: on a narrow terminal only names and words do
    table = Table(box=box.SIMPLE_HEAD, padding=(0, 0, 0, 1), pad_edge=False, show_edge=False)
    for name in columns:
        words = ("mode", "motion", "symmetry", "curvature", "design", *SOLVER_COLUMNS, *EFFECTS)
        figures = name not in words
        table.add_column(
            name, justify="right" if figures else "left", no_wrap=figures, overflow="fold"
        )
    return table


def _add(table: Table, *cells: str | Text) -> None:
    # square brackets of names and labels are markup to rich unless they come as Text
    table.add_row(*(Text(cell) if isinstance(cell, str) else cell for cell in cells))


def _named(mode: Mapping[str, Any]) -> tuple[str, str]:
    pair = f" ×{mode['multiplicity']}" if mode["multiplicity"] > 1 else ""
    return f"[{mode['c']},{mode['m']}]{pair}", motion(mode["c"], mode["m"], mode["kind"])


def _colour(deviation: float) -> str:
    return "green" if abs(deviation) < CLOSE else "yellow" if abs(deviation) < FAR else "red"


def _key(mode: Mapping[str, Any]) -> tuple[int, int, str | None]:
    return mode["c"], mode["m"], mode["kind"]
