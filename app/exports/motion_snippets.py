"""A planned program as code for other tools: this library, this service, and Universal Robots' controllers."""

from __future__ import annotations

from collections.abc import Callable

from app.exports.motion import FORMATS
from app.exports.snippets import Service, named, posted
from kin import InputError, robot_to_dict
from kin.motion import Motion, program_to_dict

RATE = 100.0  # samples per second


def python(motion: Motion, own: bool, service: Service) -> str:
    """Python, with this package and without any service."""
    return _text("python", motion)


def curl(motion: Motion, own: bool, service: Service) -> str:
    """A command for a shell that asks this service; `own`: the arm is sent along."""
    body: dict[str, object] = {
        "program": program_to_dict(motion.program),
        "q_start": motion.q_start.tolist(),
        "rate": RATE,
    }
    address = f"{service.address}api/v1/robots/{motion.robot.id}/motion"
    if own:
        address, body = f"{service.address}api/v1/motion", {"robot": robot_to_dict(named(motion.robot)), **body}
    return posted(address, service.token, body)


def urscript(motion: Motion, own: bool, service: Service) -> str:
    """URScript; for other arms a comment that says why there is none."""
    try:
        return _text("urscript", motion)
    except InputError as error:
        return f"# URScript is for {error.expected}.\n"


def _text(name: str, motion: Motion) -> str:
    return b"".join(FORMATS[name].pieces(motion, RATE)).decode()


SNIPPETS: dict[str, Callable[[Motion, bool, Service], str]] = {
    "Python, kin": python,
    "curl": curl,
    "URScript": urscript,
}
