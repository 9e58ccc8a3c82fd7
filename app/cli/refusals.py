"""Errors as ``--json`` prints them: the problem documents of REST, on standard output."""

from __future__ import annotations

from app.shared.problems import Problem, problem, problem_of
from kin import KinematicsError


def print_error(error: KinematicsError, program: str) -> int:
    """Print an error of the core, such as an invalid value; returns the exit code 2."""
    hint = f"`{program} --help` describes the arguments."
    return _print(problem_of(error, hint, "`kinboard robots` describes them."))


def print_usage_error(message: str, program: str) -> int:
    """Print that the arguments cannot be read; returns the exit code 2."""
    return _print(problem(400, "bad-request", message, f"`{program} --help` lists the arguments."))


def _print(document: Problem) -> int:
    print(document.model_dump_json())
    return 2
