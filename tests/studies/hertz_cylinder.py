"""Distance of the bundled solver's contact from Hertz: meshes, loads, road, friction.

python -m tests.studies.hertz_cylinder (some minutes)
"""

from __future__ import annotations

from ..bundled.test_hertz import Found, ball, cylinder

CYLINDERS: list[dict[str, float]] = [
    *({"share": 0.1, "degrees": d} for d in (2.0, 1.5, 1.0, 0.7, 0.5)),
    {"share": 0.05, "degrees": 0.5},
    {"share": 0.025, "degrees": 0.25, "first": 2e-3},
    {"share": 0.1, "degrees": 1.0, "first": 2e-3, "growth": 1.5},  # thinner elements inwards
    *({"share": 0.1, "degrees": 1.0, "stiffness": k} for k in (1e9, 1e11, 1e12)),
    *({"share": 0.1, "degrees": 1.0, "friction": 0.5, "steps": n} for n in (1, 3, 10)),
]
BALLS: list[dict[str, float]] = [
    *({"share": 0.1, "degrees": d} for d in (2.0, 1.43, 1.0)),
    {"share": 0.05, "degrees": 0.7},
]

NAMES = ("peak", "radius", "mean")


def line(what: str, options: dict[str, float], press: Found) -> str:
    """Deviations from the theory in percent."""
    shares = [100 * (getattr(press, n) - 1) for n in NAMES]
    words = ", ".join(f"{k} {v:g}" for k, v in options.items())
    return (
        f"| {what}: {words} | "
        + " | ".join(f"{s:+.2f}" for s in shares)
        + (f" | {press.deflection:.4f} | {press.traction:.3f} | {press.elements} | {press.nodes} |")
    )


def main() -> None:
    names = [*NAMES, "deflection", "traction", "elements", "nodes"]
    print("| deviation, % | " + " | ".join(names) + " |")
    print("|---" * (len(names) + 1) + "|")
    for what, cases in (("cylinder", CYLINDERS), ("ball", BALLS)):
        for options in cases:
            solve = cylinder if what == "cylinder" else ball
            print(line(what, options, solve(**options)), flush=True)  # type: ignore[arg-type]


if __name__ == "__main__":
    main()
