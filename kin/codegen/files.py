"""The files of an arm: head, interface, kernels, constants, and vectors that test them."""

from __future__ import annotations

import keyword
import math
import re
from collections.abc import Iterable
from pathlib import Path
from string import Template
from typing import Literal, get_args

import numpy as np

from kin._version import __version__
from kin.codegen import c, entries, js
from kin.codegen.arm import Arm, arm_of
from kin.codegen.fingerprint import fingerprint
from kin.codegen.vectors import c_test
from kin.errors import InputError
from kin.named import robot_of
from kin.robot import Robot
from kin.transforms import Array

Language = Literal["c", "js", "mjs", "d.ts", "c-test"]
_FOLDER = Path(__file__).parent
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,39}")
_INTERVALS = 4 * entries.ROWS_OF_ARCS + 2


def generate(
    robot: Robot | str, language: Language = "c", *, name: str | None = None, closest: bool = True
) -> str:
    """Source of forward and inverse kinematics of one arm, which needs nothing but a mathematical library.

    Args:
        robot: the arm, or the id of a built-in one.
        language: ``"c"`` (C99, and C++), ``"js"`` (a script for a page or `require`), ``"mjs"`` (an ES module),
            ``"d.ts"`` (the types of that), or ``"c-test"`` (a C file with poses that checks the first one).
        name: what the names in it begin with; by default made of the arm's id.
        closest: whether it also finds what comes closest to a pose that no configuration meets.

    Returns:
        The text of one file. Its head says how to use it, and what is promised and what not.

    Raises:
        InputError: an arm that cannot be emitted, with why and what would help; an unknown language; a name that
            is no identifier, or a word of one of the languages.

    Examples:
        >>> import kin
        >>> text = kin.generate("ur5e", "c")
        >>> "int ur5e_ik(const double T[16]" in text
        True
    """
    robot = robot_of(robot)
    if language not in get_args(Language):
        raise InputError("language", language, "one of " + ", ".join(get_args(Language)))
    arm, name = arm_of(robot, closest), name_for(robot, name)
    if language == "c-test":
        return c_test(arm, name)
    return c_file(arm, name) if language == "c" else js_file(arm, name, language)


def name_for(robot: Robot, name: str | None) -> str:
    """What the names in a file begin with."""
    if name is None:
        made = re.sub(r"\W", "_", robot.id, flags=re.ASCII).strip("_")[:40]
        return made if _NAME.fullmatch(made) and not _is_word(made) else f"arm_{made}"[:40]
    if not isinstance(name, str) or not _NAME.fullmatch(name) or _is_word(name):
        raise InputError(
            "name", name, "a letter, then at most 39 letters, digits and _, and no word of C or JavaScript"
        )
    return name


def _is_word(name: str) -> bool:
    return keyword.iskeyword(name) or name in c.WORDS or name in js.WORDS


def c_file(arm: Arm, name: str) -> str:
    """One file that is header and source."""
    made = arm.entries
    values = _common(arm, name) | {
        "kernels": c.unit(arm.program, arm.rooms), "constants": _constants(arm, name),
        "rows_type": c.name_of(made["solve"].kinds[-1]), "buffer": arm.buffer(),
        "why_unmet": f"; {name}_nearest says why" if "nearest" in made else "",
        "home": _numbers(arm.robot.q_home),
    }  # fmt: skip
    for each in made:
        needed = arm.buffer(each) > 0
        values[f"{each}_scratch"] = f", {name}_scratch *scratch" if needed else ""
        values[f"{each}_memory"] = "scratch->numbers, " if needed else ""
        values[f"{each}_passed"] = ", scratch" if needed else ""
    values["answer_memory"] = f"scratch->numbers + {arm.answers}, " if arm.buffer("solve") else ""
    return _file(arm, name, "c", values)


def js_file(arm: Arm, name: str, language: Language) -> str:
    """A script, an ES module, or the types of it."""
    if language == "d.ts":
        return _file(arm, name, "d.ts", _common(arm, name))
    constants = "\n".join(
        f"const {each} = vector({_json(value)});" if each != "starts" else _js_starts(value)
        for each, value in arm.constants.items()
    )
    values = _common(arm, name) | {"kernels": js.unit(arm.program), "constants": constants}
    end = {
        "js": f'if (typeof module !== "undefined" && module.exports) module.exports = {name};\n',
        "mjs": f"export {{ {name} }};\nexport default {name};\n",
    }
    return _file(arm, name, "js", values) + end[language]


def _js_starts(value: Array) -> str:
    return f"const starts = new A2(constant({_json(value)}), {len(value)}, {value.shape[1]});"


def _json(value: Array) -> str:
    return f"[{_numbers(value).replace('INFINITY', 'Infinity')}]"


def _common(arm: Arm, name: str) -> dict[str, object]:
    """What the templates of all languages name."""
    n, made = arm.robot.n, arm.entries
    return {
        "name": name, "NAME": name.upper(), "n": n, "k": arm.rows, "size_of_jacobian": 6 * n,
        "joint": f"{arm.parameter.joint}, " if arm.parameter and arm.alone.stepped else "",
        "step": 180 // entries.HALF_TURN, "arcs": arm.alone.intervals, "intervals": _INTERVALS,
        "starts": len(arm.constants.get("starts", ())),
        "parameter": "" if arm.parameter is None else _ascii(arm.parameter.label),
        "circular": "true" if arm.parameter is not None and arm.parameter.circular else "false",
        "names": ",\n    ".join(f'"{_ascii(each)}"' for each in arm.form.branches),
        "intervals_kernel": made["intervals"].name if "intervals" in made else "",
        **{each: instance.name for each, instance in made.items() if each != "intervals"},
    }  # fmt: skip


def _file(arm: Arm, name: str, kind: str, values: dict[str, object]) -> str:
    """The head, and a template without the parts that the arm does not have."""
    text = _selected((_FOLDER / f"api.{kind}.txt").read_text(encoding="utf-8"), _sections(arm))
    head = "\n".join(f"// {line}".rstrip() for line in _head(arm, name, kind))
    return f"{head}\n{Template(text).substitute(values)}"


def _sections(arm: Arm) -> set[str]:
    """The parts of the interface that an arm has."""
    found = {"intervals", "nearest"} & set(arm.entries)
    if arm.buffer():
        found.add("buffer")
    found.add("ik_buffer" if arm.buffer("solve") else "ik_stack")
    if arm.robot.n < 6:
        found.add("few")
    if arm.parameter is None:
        return found | {"all"}
    return found | {"ik_at", "stepped" if arm.alone.stepped else "one"}


def _selected(text: str, sections: set[str]) -> str:
    """The lines of a template outside of parts ``@name … @end`` that are not among the sections."""
    found, keep = [], True
    for line in text.splitlines():
        if line.startswith("@"):
            keep = line == "@end" or line[1:] in sections
        elif keep:
            found.append(line)
    return "\n".join(found) + "\n"


def _constants(arm: Arm, name: str) -> str:
    """The arrays that are read: an unused one is a warning."""
    unused = {"held"} if arm.parameter is None else set()
    used = arm.constants.keys() - unused
    return "\n".join(
        f"static const double {name}_{each}[{value.size}] = {{{_numbers(value)}}};"
        for each, value in arm.constants.items()
        if each in used
    )


def _numbers(values: Array) -> str:
    words = {math.inf: "INFINITY", -math.inf: "-INFINITY"}
    return ", ".join(words.get(x, repr(x)) for x in map(float, np.ravel(values)))


def _ascii(text: str) -> str:
    """A text that every compiler reads as one line of a comment, or as it is in quotes.

    Names of arms and joints may come from anywhere: neither a line break nor a backslash, which would go on with
    the comment, is left, nor two question marks, which may stand for one.
    """
    for letter, word in (("θ", "theta"), ("ψ", "psi"), (" · ", ", "), ("·", ","), ("°", " deg")):
        text = text.replace(letter, word)
    return re.sub(r'[\\"\x00-\x1f\x7f]|\?(?=\?)', "_", text.encode("ascii", "replace").decode())


def _head(arm: Arm, name: str, kind: str) -> Iterable[str]:
    """What a user needs to know before reading on."""
    robot, form = arm.robot, arm.form
    yield f"{_ascii(robot.name)}: forward and inverse kinematics, generated by Kinboard {__version__}."
    yield f"Kernels {fingerprint(entries.__file__)[:12]}; MIT License, for this generated file too."
    yield ""
    yield f"Solver: {_ascii(form.name)}, {_ascii(form.title)}."
    yield "Metres and radians. A pose is the tool in the world frame of the table. The joints, as in the table"
    yield f"({robot.convention} Denavit-Hartenberg: theta, d, a, alpha) and their limits:"
    for joint, low, high in zip(robot.joints, robot.lower.tolist(), robot.upper.tolist(), strict=True):
        row = ", ".join(f"{x:.9g}" for x in (joint.theta, joint.d, joint.a, joint.alpha))
        yield f"  {_ascii(joint.name)}: {joint.kind}, {row}; {low:.9g} to {high:.9g}"
    yield ""
    yield "Promised: every configuration meets its pose within 1e-9 m and 1e-9 rad by forward kinematics, is"
    yield "inside the limits unless the status says otherwise, and is the whole-turn image nearest to the seed."
    yield "Rows that are equal within 1e-7 are one."
    yield from _not_promised(arm)
    yield ""
    if kind == "c":
        if size := arm.buffer():
            yield "No heap, no static state: any number of threads may call it, each with a buffer of its own for"
            yield f"large arrays, {name}_scratch of {size / 125:.0f} kB. Small ones are on the stack."
        else:
            yield "No heap, no static state: any number of threads may call it. All arrays are on the stack."
        yield "To use it, #include it for the declarations, and compile it once with"
        yield f"-D{name.upper()}_IMPLEMENTATION, not together with another arm's. To try it:"
        yield f"  cc -std=c99 -O2 -D{name.upper()}_EXAMPLE {name}.c -lm"
    else:
        offered = {"ik_at": "ik_at(T, value, seed)", "intervals": "intervals(T, seed)"}
        offered["nearest"] = "nearest(T, seed, point)"
        there = [call for each, call in offered.items() if each in _sections(arm)]
        always = ["fk(q)", "jacobian(q)", "ik(T, seed)"]
        yield f"It defines one constant, {name}, with {', '.join([*always, *there])}."
        yield "Poses are 4 rows of 4 numbers."


def _not_promised(arm: Arm) -> Iterable[str]:
    yield "Not promised: the same bits as Kinboard or with another compiler; more than single points of a curve of"
    yield "configurations, where a singular pose has one."
    yield "Nor that poses may be rounded, as for Kinboard: rotations must have R^T R = I within 1e-6."
    if arm.robot.n < 6:
        yield "With fewer than six joints, a pose rounded beyond 1e-9 is approximate at best: only Kinboard"
        yield "widens its tolerances."
    if arm.form.name == "general6":
        yield "Nor that the list is complete: beside singular configurations Kinboard searches on, in Python."
    if arm.parameter is not None:
        yield "Nor all configurations, of which there is a continuum: each is one of its branch, at one value of"
        label = _ascii(arm.parameter.label)
        if arm.alone.stepped:
            step = 180 // entries.HALF_TURN
            yield f"{label}, given or by steps of {step} deg the nearest to the seed's that the limits allow."
            yield "A range narrower than a step may be missed: then the status is limits or unmet. Where nothing"
            yield "is found, all steps are tried, which takes tens of milliseconds."
        else:
            yield f"{label}, given or the nearest to the seed's that the limits allow."
