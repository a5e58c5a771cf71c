"""Standard errors of the real tyre with further modes measured, as in cases/own_tyre.md.

    python -m tests.studies.more_modes

The fit of cases/205_60r15.yaml to four modes, then fits in which further modes are measured, each
to 1 Hz, where the fitted tyre has them. Prints standard errors by scatter, in %, and the least
singular value. Half a minute of a core.
"""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

import tyrecal

CASES = Path(__file__).parents[2] / "cases"
FURTHER = ((2, 0), (2, 1), (3, 0), (4, 0))
SETS = (0, 1, 4)  # how many of them are measured


def main() -> None:
    case = tyrecal.load_case(CASES / "205_60r15.yaml")
    head, *targets = (CASES / "205_60r15_mf_swift.csv").read_text(encoding="utf-8").splitlines()
    targets = [row for row in targets if row.startswith("frequency")]
    first = tyrecal.fit_case(case)
    modes = tyrecal.evaluate_modes(case, first.fitted.values)
    hertz = {(mode.label.c, mode.label.m): mode.frequency_Hz for mode in modes}
    results = []
    for count in SETS:
        rows = [f"frequency_Hz,{c},{m},,,220,0,{hertz[c, m]:.6f},1" for c, m in FURTHER[:count]]
        with TemporaryDirectory() as folder:
            path = Path(folder) / "measured.csv"
            path.write_text("\n".join([head, *targets, *rows, ""]), encoding="utf-8")
            results.append(tyrecal.fit_case(case, path).result)
    print("| variable | four modes | and [2,0] | and [2,1], [3,0], [4,0] |\n|---|---|---|---|")
    for name in results[0]["variables"]:
        each_set = [result["variables"][name] for result in results]
        cells = [f"{100 * each['standard_error'] / each['value']:.2f}" for each in each_set]
        print(f"| {name} | {' | '.join(cells)} |")
    cells = [f"{result['singular_values'][-1]:.3f}" for result in results]
    print(f"| least | {' | '.join(cells)} |")


if __name__ == "__main__":
    main()
