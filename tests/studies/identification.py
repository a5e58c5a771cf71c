"""Does what is identified hang on rounding? Drawn files under every BLAS kernel.

    python tests/studies/identification.py [files] [seed]

Each file: 3 to 9 modes of 1 to 5 % damping, some of them close pairs, of one or two references,
noise from 1e-6 to 0.1 of the functions' size (uniform in ln), in a wide band or one that holds two
or three modes only. The same values are identified under each kernel with one and two threads, and
with every value off by 1e-10 of itself, half a million times rounding. Told: in how many files the
modes found differ from those under the first kernel, and the largest difference of a frequency in
its sigma.
"""

from __future__ import annotations

import json
import sys
import tempfile
from pathlib import Path

import numpy as np

from tests.kernels import KERNELS, THREADS, run
from tyrecal.errors import InputError
from tyrecal.measured.identify import Responses, identify

Array = np.ndarray
OFF = 1e-10


def drawn(random: np.random.Generator) -> tuple[Responses, float, float]:
    """A test's functions, and the band asked for."""
    hertz = np.cumsum(random.uniform(4, 20, random.integers(3, 10))) + 30
    if random.random() < 0.4:  # the two of a doublet
        hertz = np.sort(np.append(hertz, random.choice(hertz) * random.uniform(1.005, 1.03)))
    f = np.arange(20.0, hertz[-1] + 30, random.choice([0.25, 0.5, 0.625]))
    ratios = random.uniform(0.01, 0.05, len(hertz))
    w, wk = 2 * np.pi * f, 2 * np.pi * hertz[:, None]
    sensors, references = int(random.integers(5, 14)), int(random.integers(1, 3))
    phi = random.standard_normal((references, 3 * sensors, len(hertz)))
    phi *= random.standard_normal((references, 1, len(hertz)))
    curves = 1j * w / (wk**2 - w**2 + 2j * ratios[:, None] * w * wk)
    H = np.einsum("rsk,kn->rsn", phi, curves).reshape(-1, len(f))  # no BLAS
    size = np.exp(random.uniform(np.log(1e-6), np.log(0.1))) * np.sqrt(np.mean(np.abs(H) ** 2))
    H = H + size * (random.standard_normal(H.shape) + 1j * random.standard_normal(H.shape))
    low, high = hertz[0] - 6, hertz[-1] + 6
    if random.random() < 0.5:
        first = int(random.integers(0, len(hertz) - 2))
        low, high = hertz[first] - 3, hertz[first + 2] - 3
        low, high = (low, high) if (high - low) / (f[1] - f[0]) > 20 else (low, high + 15)
    points = np.tile(np.repeat(np.arange(sensors), 3), references)
    return Responses(f, H, "mobility", points), float(low), float(high)


def found(values: Responses, low: float, high: float) -> list[list[float]]:
    """Frequency and sigma of each mode."""
    try:
        modes = identify(values, low, high).modes
    except InputError:
        return []
    return [[m.frequency_Hz, float(m.sigma_Hz or np.nan), float(m.damping or 0)] for m in modes]


def child(folder: Path, shaken: bool) -> list[list[list[float]]]:
    """Modes that are identified in each file of a folder."""
    result, random = [], np.random.default_rng(1)
    for path in sorted(folder.glob("*.npz")):
        a = np.load(path)
        H = a["H"] * (1 + shaken * OFF * random.standard_normal(a["H"].shape))
        result.append(found(Responses(a["f"], H, "mobility", a["points"]), *a["band"].tolist()))
    return result


def compared(one: list[list[list[float]]], other: list[list[list[float]]]) -> tuple[int, float]:
    """Files whose modes are not as many; largest difference of a frequency, in sigma."""
    alike = [(a, b) for a, b in zip(one, other, strict=True) if len(a) == len(b)]
    off = [abs(a[0] - b[0]) / a[1] for x, y in alike for a, b in zip(x, y, strict=True)]
    return len(one) - len(alike), float(np.nanmax(off))


def main(files: int, seed: int) -> int:
    differ = 0
    with tempfile.TemporaryDirectory() as name:
        for i in range(files):
            values, low, high = drawn(np.random.default_rng([seed, i]))
            np.savez(
                Path(name) / f"{i:04}",
                f=values.frequency_Hz,
                H=values.values,
                points=values.points,
                band=[low, high],
            )
        first = None
        for kernel, threads, shaken in [
            *((k, n, "") for k in KERNELS for n in THREADS),
            (KERNELS[1], 1, "shaken"),
        ]:
            done = run([__file__, "--child", name, shaken], kernel, threads)
            if done.returncode:
                print(f"{kernel}: {done.stderr.strip()[-300:]}")
                continue
            here = json.loads(done.stdout)
            first = first or here
            count, off = compared(first, here)
            differ += count
            modes = sum(map(len, here))
            print(
                f"{kernel:9} {threads} {shaken:6}: {modes} modes in {files} files,"
                f" {sum(not each for each in here)} refused; {count} files differ,"
                f" frequencies by {off:.1e} sigma at most",
                flush=True,
            )
    return differ


if __name__ == "__main__":
    if sys.argv[1:2] == ["--child"]:
        print(json.dumps(child(Path(sys.argv[2]), bool(sys.argv[3]))))
    else:
        sys.exit(bool(main(int((sys.argv[1:] or ["60"])[0]), int((sys.argv[2:] or ["0"])[0]))))
