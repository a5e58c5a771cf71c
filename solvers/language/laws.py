"""The one list of hyperelastic laws: names of their constants, in the order of the data lines."""

from __future__ import annotations

from collections.abc import Callable

ON_A_LINE = 8  # constants on each data line of *HYPERELASTIC
MAX_ENERGY_ORDER = 6


def _numbered(form: str, count: int) -> list[str]:
    return [form.format(i) for i in range(1, count + 1)]


LAW_CONSTANTS: dict[str, Callable[[int], list[str]]] = {  # of order N
    "NEO HOOKE": lambda N: ["C10", "D1"],
    "MOONEY-RIVLIN": lambda N: ["C10", "C01", "D1"],
    "YEOH": lambda N: [*_numbered("C{}0", 3), *_numbered("D{}", 3)],
    "REDUCED POLYNOMIAL": lambda N: [*_numbered("C{}0", N), *_numbered("D{}", N)],
    "POLYNOMIAL": lambda N: [
        *(f"C{total - j}{j}" for total in range(1, N + 1) for j in range(total + 1)),
        *_numbered("D{}", N),
    ],
    "ARRUDA-BOYCE": lambda N: ["mu", "lambda_m", "D1"],
    "OGDEN": lambda N: [
        *(name for i in range(1, N + 1) for name in (f"mu{i}", f"alpha{i}")),
        *_numbered("D{}", N),
    ],
}
OF_ORDER_N = ("REDUCED POLYNOMIAL", "POLYNOMIAL", "OGDEN")  # the others take no N
LAWS_NOT_READ = ("VAN DER WAALS", "MARLOW", "USER", "EXTENDED TUBE", "VALANIS-LANDEL")
INSTEAD_OF_TESTS = (
    "give the constants of a law that fits the same tests, or of a cord its modulus by *ELASTIC"
)
