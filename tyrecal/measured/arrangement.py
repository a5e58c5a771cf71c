"""Arrangement of tests: the channels that count, the side of the functions that was moved over the
tyre, and the files that are parts of one test.

``gather`` calls it once for all universal files. By reciprocity the response at i to a force at j
is the response at j to a force at i. So if the hammer was moved and the accelerometers were fixed,
the impacts are the shape's points. Files with a common reference and different channels are parts
of one test; files with the same channels are repeats.
"""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..errors import InputError
from .universal import Function, MeasuredShape, Universal, channel_name

TYRE_NAMES = re.compile(r"tyre|tire|reifen|pneu|tread", re.IGNORECASE)  # in a component's name
FUNCTION_UNITS = {  # of functions, as they state it without brackets and blanks, in SI
    f"{motion}{force}": a / b
    for motion, a in (
        *(("m/s^2", 1.0), ("m/s2", 1.0), ("m/s**2", 1.0), ("mm/s^2", 1e-3), ("mm/s2", 1e-3)),
        *(("g", 9.80665), ("m/s", 1.0), ("mm/s", 1e-3), ("m", 1.0), ("mm", 1e-3)),
    )
    for force, b in (("", 1.0), ("/n", 1.0), ("/kn", 1e3), ("/lbf", 4.4482216))
}
SAME_CHANNELS = 0.5  # share of common channels from which two files are repeats


class Arranged(NamedTuple):
    """Tests, each as one universal file with the channels that count, and notes for the user."""

    tests: list[Universal]
    notes: list[str]


def arrange(files: Sequence[Universal], leave_out: Sequence[str] = ()) -> Arranged:
    """Tests in ``files``, in their order.

    leave_out: channels to drop, NODE, NODE:DIRECTION or COMPONENT, or COMPONENT before either.
    Raises InputError where one of them is no channel, or components count the same nodes.
    """
    files = _without(files, leave_out)
    files, moved = _with_moved_responses(files)
    files, more = _motions(files)
    files, others = _of_the_tyre(files)
    files = _in_one_unit(files)
    tests, joined = _join(files)
    return Arranged(tests, [*moved, *more, *others, *joined])


def _with_moved_responses(files: Sequence[Universal]) -> tuple[list[Universal], list[str]]:
    """Files whose responses are on the side that was moved over the tyre: that with more channels,
    in all files together if it has more than twice as many, else in each file."""

    def excess(functions: Sequence[Function]) -> float:
        """Channels of the references over those of the responses."""
        sides = {_reference(each) for each in functions}, {_response(each) for each in functions}
        return len(sides[0]) / max(len(sides[1]), 1)

    together = excess([each for file in files for each in file.functions])
    clear = not 0.5 <= together <= 2
    result, moved = list(files), list[Universal]()
    for k, file in enumerate(files):
        if (together if clear else excess(file.functions)) > 1:
            result[k] = replace(file, functions=[_exchange(each) for each in file.functions])
            moved.append(result[k])
    count = len({_response(each) for file in moved for each in file.functions})
    words = (
        f"the impacts were moved over {count} channels; by reciprocity they are the shapes' points"
    )
    names = ", ".join(file.path.name for file in moved)
    return result, [f"{names}: {words}"] if moved else []


def _response(each: Function) -> tuple[str, int, int]:
    return (each.response_part, each.response[0], abs(each.response[1]))


def _reference(each: Function) -> tuple[str, int, int]:
    return (each.reference_part, each.reference[0], abs(each.reference[1]))


def _exchange(each: Function) -> Function:
    """The function with response and reference exchanged, which reciprocity allows."""
    return replace(
        each,
        response=each.reference,
        reference=each.response,
        response_part=each.reference_part,
        reference_part=each.response_part,
    )


def _kept(
    files: Sequence[Universal], keep: Callable[[Function], bool]
) -> tuple[list[Universal], list[Function]]:
    """Files with the functions to keep, and the others."""
    left_out = [each for file in files for each in file.functions if not keep(each)]
    return [replace(f, functions=[e for e in f.functions if keep(e)]) for f in files], left_out


def _without(files: Sequence[Universal], leave_out: Sequence[str]) -> list[Universal]:
    """Files without the channels that a user takes away. Raises InputError."""
    result = list(files)
    for name in leave_out:
        matches = _matcher(name)
        gone = {
            id(each)
            for file in result
            for each in file.functions
            if matches(*_response(each)) or matches(*_reference(each))
        }
        result = [
            replace(file, functions=[each for each in file.functions if id(each) not in gone])
            for file in result
        ]
        shapes = [[_shape_without(shape, matches) for shape in file.shapes] for file in result]
        if not gone and not any(changed for each in shapes for _, changed in each):
            raise InputError(f"--leave-out {name}: no file has such a channel")
        result = [
            replace(file, shapes=[shape for shape, _ in each])
            for file, each in zip(result, shapes, strict=True)
        ]
    return result


def _matcher(name: str) -> Callable[[str, int, int], bool]:
    """Whether a channel (component, node, direction) is what ``name`` says. Raises InputError."""
    match = re.fullmatch(r"(?:([^:]*[^:\d][^:]*)(?::|$))?(?:(\d+)(?::(\d))?)?", name.strip())
    if not match or not name.strip():
        raise InputError(
            f"--leave-out {name}: must be NODE, NODE:DIRECTION or COMPONENT, like 12 or 12:3"
        )
    part, *numbers = match.groups()
    wanted = [int(number) if number else None for number in numbers]

    def matches(component: str, node: int, direction: int) -> bool:
        same = all(a in (None, b) for a, b in zip(wanted, (node, direction), strict=True))
        return same and (part is None or part.lower() == component.lower())

    return matches


def _shape_without(
    shape: MeasuredShape, matches: Callable[[str, int, int], bool]
) -> tuple[MeasuredShape, bool]:
    """The shape without some of its values, and whether it had them."""
    gone = np.array([[matches("", node, k) for k in (1, 2, 3)] for node in shape.nodes])
    return replace(shape, values=np.where(gone, np.nan, shape.values)), bool(gone.any())


def _motions(files: Sequence[Universal]) -> tuple[list[Universal], list[str]]:
    """Files without channels that are no motion along a direction 1, 2 or 3."""
    files, gone = _kept(files, lambda each: abs(each.response[1]) in (1, 2, 3))
    names = dict.fromkeys(channel_name(each.response, each.response_part) for each in gone)
    if not gone:
        return files, []
    words = "no motion along a direction 1, 2 or 3"
    return files, [f"left out, {words}: channel {', '.join(names)}"]


def _of_the_tyre(files: Sequence[Universal]) -> tuple[list[Universal], list[str]]:
    """Files without the measurements on components other than the tyre. Raises InputError where two
    components count the same nodes, and their names do not show which one is the tyre."""
    nodes: defaultdict[str, set[int]] = defaultdict(set)
    for file in files:
        for each in file.functions:
            nodes[each.response_part].add(each.response[0])
    tyre = {part for part in nodes if TYRE_NAMES.search(part)} or set(nodes)
    for part in tyre:
        for other in tyre:
            if part < other and (both := nodes[part] & nodes[other]):
                raise InputError(
                    f"{_first(files, other).place}: node {min(both)} is one of the component"
                    f" '{other}' and one of '{part}'; take away what is not on the tyre, as in"
                    f" --leave-out {other or part}"
                )
    files, gone = _kept(files, lambda each: each.response_part in tyre)
    parts = dict.fromkeys(each.response_part or "without a name" for each in gone)
    if not gone:
        return files, []
    return files, [
        f"left out, not on the tyre: {len(gone)} functions of component {', '.join(parts)}"
    ]


def _first(files: Sequence[Universal], part: str) -> Function:
    return next(e for file in files for e in file.functions if e.response_part == part)


def _in_one_unit(files: Sequence[Universal]) -> list[Universal]:
    """Files whose functions are in the unit of the first one, where they state different ones.
    Raises InputError where a unit among them is not known."""
    every = [each for file in files for each in file.functions]
    units = {each.unit for each in every if each.unit}
    if len(units) < 2:
        return list(files)

    def scaled(each: Function) -> Function:
        if (size := FUNCTION_UNITS.get(each.unit)) is None:
            stated = f"states the unit '{each.unit}'" if each.unit else "states no unit"
            known = ", ".join(FUNCTION_UNITS)
            raise InputError(
                f"{each.place}: {stated}, and other functions another one; must be one of {known}"
            )
        return replace(each, values=each.values * size)

    return [replace(file, functions=[scaled(each) for each in file.functions]) for file in files]


def _channels(file: Universal) -> dict[tuple[object, object], Function]:
    """Functions by reference and response. Raises InputError where one was measured twice."""
    channels: dict[tuple[object, object], Function] = {}
    for each in file.functions:
        if channels.setdefault((_reference(each), _response(each)), each) is not each:
            node, direction = each.response
            raise InputError(
                f"{each.place}: node {node}, direction {direction} was measured before in this"
                " file; give each repeat a file of its own"
            )
    return channels


def _join(files: Sequence[Universal]) -> tuple[list[Universal], list[str]]:
    """Files, those that are parts of one test as one."""
    tests: list[list[Universal]] = []
    channels: list[dict[tuple[object, object], Function]] = []
    for file in files:
        mine = _channels(file)
        for test, known in zip(tests, channels, strict=True):
            common = {key[0] for key in mine} & {key[0] for key in known}
            if common and len(mine.keys() & known.keys()) < SAME_CHANNELS * len(mine):
                test.append(file)
                known.update({key: each for key, each in mine.items() if key not in known})
                break
        else:
            tests.append([file])
            channels.append(mine)
    joined, notes = [], []
    for test, known in zip(tests, channels, strict=True):
        if len(test) == 1:
            joined += test
            continue
        joined.append(replace(test[0], functions=list(known.values())))
        names = ", ".join(Path(file.path).name for file in test)
        notes.append(f"one test in {len(test)} files with a common reference: {names}")
    return joined, notes
