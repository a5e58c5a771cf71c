"""What the solver honours of the ABAQUS keyword language; everything else is refused by name.

Per keyword: the parameters it may carry, each with the values it may take (None = any value,
an empty string = the parameter stands without a value).
"""

from __future__ import annotations

from ...language.text import Block, DeckError

ParameterValues = tuple[str, ...] | None

YES = ("YES", "")
SECTION_JOB: dict[str, dict[str, ParameterValues]] = {
    "HEADING": {},
    "RESTART": {"WRITE": ("",), "FREQUENCY": None},
    "NODE": {"NSET": None},
    "ELEMENT": {"TYPE": None, "ELSET": None},  # `section.shapes` knows the types
    "NSET": {"NSET": None, "GENERATE": ("",)},
    "ELSET": {"ELSET": None, "GENERATE": ("",)},
    "RIGID BODY": {"REF NODE": None, "TIE NSET": None},
    "SURFACE": {"NAME": None, "TYPE": ("ELEMENT",)},
    "SOLID SECTION": {"ELSET": None, "MATERIAL": None, "CONTROLS": None},
    "SECTION CONTROLS": {"NAME": None, "HOURGLASS": ("STIFFNESS",)},
    "HOURGLASS STIFFNESS": {},
    "SURFACE SECTION": {"ELSET": None},
    "EMBEDDED ELEMENT": {
        "HOST ELSET": None,
        "ROUNDOFF TOLERANCE": None,
        "EXTERIOR TOLERANCE": None,
        "ABSOLUTE EXTERIOR TOLERANCE": None,
    },
    "REBAR LAYER": {"GEOMETRY": ("CONSTANT", "ANGULAR")},
    "MATERIAL": {"NAME": None},
    "DENSITY": {},
    "ELASTIC": {"TYPE": ("ISOTROPIC",), "MODULI": ("LONG TERM",)},  # the manual's default
    "HYPERELASTIC": {
        **dict.fromkeys(
            (
                "NEO HOOKE",
                "MOONEY-RIVLIN",
                "POLYNOMIAL",
                "REDUCED POLYNOMIAL",
                "YEOH",
                "ARRUDA-BOYCE",
                "OGDEN",
            ),
            ("",),
        ),
        "N": ("1", "2", "3"),
        "MODULI": ("LONG TERM", "INSTANTANEOUS"),
    },
    "NO COMPRESSION": {},
    "VISCOELASTIC": {"TIME": ("PRONY",), "FREQUENCY": ("TABULAR",)},
    "ACOUSTIC MEDIUM": {"BULK MODULUS": ("",)},
    "BOUNDARY": {},
}
STEP_KEYWORDS: dict[str, dict[str, ParameterValues]] = {
    "STEP": {"NAME": None, "NLGEOM": YES, "INC": None, "PERTURBATION": ("",)},
    "STATIC": {"LONG TERM": ("",), "DIRECT": ("",)},
    "FREQUENCY": {
        "EIGENSOLVER": ("LANCZOS",),
        "NORMALIZATION": ("MASS",),
        "PROPERTY EVALUATION": None,
        "SIM": ("NO",),
    },
    "BOUNDARY": {"OP": ("MOD", "NEW")},
    "COMPLEX FREQUENCY": {"PROPERTY EVALUATION": None},
    "DLOAD": {"OP": ("MOD",)},
    "DSLOAD": {"OP": ("MOD",)},
    "CLOAD": {"OP": ("MOD",)},
    "CONTACT CONTROLS": {"SLAVE": None, "MASTER": None, "STABILIZE": ("",)},
    "CONTACT FILE": {"SLAVE": None},
    "FILE FORMAT": {"ASCII": ("",)},
    "NODE FILE": {"NSET": None, "FREQUENCY": None},
    "MODAL FILE": {},
    "END STEP": {},
}
REVOLVE_JOB: dict[str, dict[str, ParameterValues]] = {
    "HEADING": {},
    "SYMMETRIC MODEL GENERATION": {"REVOLVE": ("",)},
    "SYMMETRIC RESULTS TRANSFER": {"STEP": None, "INC": None},
    "NODE": {"NSET": None},
    "ELEMENT": {"TYPE": ("SPRING1", "MASS", "ROTARYI"), "ELSET": None},
    "SPRING": {"ELSET": None},
    "MASS": {"ELSET": None},
    "ROTARY INERTIA": {"ELSET": None},
    "RIGID BODY": {"REF NODE": None, "TIE NSET": None, "ANALYTICAL SURFACE": None},
    "SURFACE": {"NAME": None, "TYPE": ("CYLINDER",)},
    "SURFACE INTERACTION": {"NAME": None},
    "SURFACE BEHAVIOR": {"PRESSURE-OVERCLOSURE": ("LINEAR",)},
    "FRICTION": {"ELASTIC SLIP": None},
    "CONTACT PAIR": {"INTERACTION": None, "TYPE": ("SURFACE TO SURFACE",)},
    "BOUNDARY": {},
}


MAX_FIELDS = {  # data fields that are honoured; a further one that is not blank is refused
    "DENSITY": 1,
    "ELASTIC": 2,
    "HYPERELASTIC": 8,
    "VISCOELASTIC": 5,
    "ACOUSTIC MEDIUM": 1,
    "SPRING": 1,
    "MASS": 1,
    "ROTARY INERTIA": 3,
    "HOURGLASS STIFFNESS": 1,
    "REBAR LAYER": 6,
    "BOUNDARY": 4,
    "DLOAD": 9,
    "COMPLEX FREQUENCY": 1,
    "DSLOAD": 3,
    "CLOAD": 3,
    "SURFACE BEHAVIOR": 1,
    "FRICTION": 1,
    "CONTACT PAIR": 2,
    "STATIC": 2,
    "FREQUENCY": 4,
}


def check(keywords: list[Block], revolve: bool) -> tuple[list[Block], list[list[Block]]]:
    """Split a job into its model and its steps, refusing what is not honoured.

    Raises DeckError naming the keyword or parameter and its line.
    """
    model: list[Block] = []
    steps: list[list[Block]] = []
    inside = False
    for keyword in keywords:
        if keyword.name == "STEP":
            if inside:
                raise DeckError(keyword.place, "*STEP inside a step: *END STEP is missing")
            inside = True
            steps.append([])
        allowed = STEP_KEYWORDS if inside else REVOLVE_JOB if revolve else SECTION_JOB
        _check_one(keyword, allowed, "a step" if inside else "the model")
        (steps[-1] if inside else model).append(keyword)
        if keyword.name == "END STEP":
            inside = False
    if inside:
        raise DeckError(steps[-1][0].place, "*STEP without *END STEP: the deck is cut off")
    formats = [keyword for keyword in keywords if keyword.name == "FILE FORMAT"]
    if len(formats) > 1:
        words = f"*FILE FORMAT may stand once in a job: it is given in {formats[0].place} already"
        raise DeckError(formats[1].place, words)
    return model, steps


def _check_one(keyword: Block, allowed: dict[str, dict[str, ParameterValues]], where: str) -> None:
    if keyword.name not in allowed:
        raise DeckError(keyword.place, f"keyword *{keyword.name} is not honoured in {where}")
    for row in keyword.rows if keyword.name in MAX_FIELDS else ():
        extra = [text for text in row.fields[MAX_FIELDS[keyword.name] :] if text]
        if extra:
            raise DeckError(row.place, f"data '{extra[0]}' of *{keyword.name} is not honoured")
    parameters = allowed[keyword.name]
    for name, value in keyword.parameters.items():
        if name not in parameters:
            raise DeckError(keyword.place, f"parameter {name} of *{keyword.name} is not honoured")
        values = parameters[name]
        if values is not None and value not in values:
            expected = " or ".join(v or "no value" for v in values)
            raise DeckError(
                keyword.place, f"{name}={value} of *{keyword.name} is not honoured, only {expected}"
            )
