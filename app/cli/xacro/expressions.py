"""What expressions of xacro may say, and the answers of `$(find)`, `$(dirname)` and `$(cwd)`.

xacro gives expressions a few builtins and refuses names with two underscores, but only outside of lambdas and
comprehensions, and `vars`, `type`, frames of generators and `$(eval)` lead to everything else. Here the whole
expression is looked at before it is evaluated.
"""

from __future__ import annotations

import ast
import builtins
from collections.abc import Callable
from pathlib import Path
from typing import Any

import xacro
from xacro import substitution_args

UNSAFE = {  # attributes that lead from a value to Python's insides
    *("mro", "with_traceback", "tb_frame", "tb_next", "f_back", "f_builtins", "f_code", "f_globals", "f_locals"),
    *(
        f"{kind}_{what}"
        for kind in ("gi", "cr", "ag")
        for what in ("frame", "code", "await", "yieldfrom", "origin")
    ),
}
REMOVED = ("vars", "type")  # of the name space `python`


class RefusedError(Exception):
    """Something that xacro may not do or does not find; says what, and what would be valid."""

    def __init__(self, value: str, expected: str) -> None:
        super().__init__(f"{value}: {expected}")
        self.value, self.expected = value, expected


def bound(file: Path, folder: Path, packages: dict[str, str]) -> None:
    """Check every expression from now on, and tell xacro where the file and its packages are."""
    evaluate, evaluate_argument = xacro.safe_eval, substitution_args._eval
    allowed = substitution_args._eval_dict["__builtins__"].keys() | substitution_args._eval_dict.keys()
    hidden = set(dir(builtins)) - allowed

    def checked(expression: str, *tables: Any) -> Any:
        _check(expression, set())
        return evaluate(expression, *tables)

    def checked_argument(expression: str, context: dict[str, Any]) -> str:
        _check(expression, hidden)
        return str(evaluate_argument(expression, context))

    def find(name: str) -> str:
        if name not in packages:
            raise RefusedError(name, f"a package in the folder {folder} (--folder DIR)")
        return packages[name]

    for name in REMOVED:
        xacro._global_symbols["python"].pop(name, None)
    xacro.safe_eval, substitution_args._eval = checked, checked_argument
    answers: dict[str, Callable[..., str]] = {"find": find, "env": _no_variable}
    substitution_args._eval_dict.update(answers)
    substitution_args._eval_find = find
    substitution_args._eval_env = _no_variable
    substitution_args._eval_dirname = lambda _: str(Path(xacro.filestack[-1]).parent)
    xacro.substitution_args_context["filename"] = str(file)
    xacro.root_dir = str(file.parent)
    xacro.init_stacks(str(file))


def _no_variable(name: str) -> str:
    raise RefusedError(
        f"$(env {name})", "no environment variable: none is given to xacro ($(optenv NAME DEFAULT))"
    )


def _check(expression: str, hidden: set[str]) -> None:
    """Refuse what reaches the insides of Python. A syntax error is left to xacro."""
    for node in ast.walk(ast.parse(expression.strip(), mode="eval")):
        names = [
            value for field in ("id", "attr", "arg") if isinstance(value := getattr(node, field, None), str)
        ]  # of names, attributes, and arguments of calls and lambdas
        for name in names:
            inside = isinstance(node, ast.Attribute) and name in UNSAFE
            if "__" in name or inside or (isinstance(node, ast.Name) and name in hidden):
                raise RefusedError(name, "a name that expressions of xacro may use")
