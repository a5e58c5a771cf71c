"""Response functions against the direct solution at many frequencies up to the band's end.

    python -m tests.studies.direct_response [frequencies]

The tyre, points and harmonics are those of `tests/bundled/test_response.py`. Exit code 1 where an
error is above 0.2 % of the largest response.
"""

from __future__ import annotations

import sys

import numpy as np

from ..bundled.test_response import HIGHEST_HZ, direct_errors, solve


def main(count: int = 200) -> int:
    every, driving = direct_errors(solve(), np.linspace(0.0, HIGHEST_HZ, count))
    print(
        f"{count} frequencies, 0 to {HIGHEST_HZ:g} Hz: receptances within {every.max():.2e} of the"
        f" largest; of driving points within {driving.max():.2e} of each one's largest"
    )
    return int(max(every.max(), driving.max()) > 0.002)


if __name__ == "__main__":
    sys.exit(main(*map(int, sys.argv[1:])))
