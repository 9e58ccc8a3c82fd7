"""One arm as one HTML file: sliders, a target to drag, its postures, DH table and a program, without a server.

The file holds the arm as data and a script that moves it. The script computes forward kinematics itself, from the
same constants as the scene of the viewer (:mod:`app.viewer.scene.chain`), so each slider answers at once, and
inverse kinematics with the arm's own kernels (:mod:`app.viewer.takehome.solver`). The postures of an arm whose
kernels cannot be generated, and programs, are solved here, and the file holds the answers. Its parts are the
template ``takehome/page.html``, ``static/takehome`` (style and scripts) and three.js in ``static/vendor/three``.

Nothing is loaded from elsewhere, which a content security policy in the file makes certain.
"""

from __future__ import annotations

import base64
import json
import math
import os
import zlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from markupsafe import Markup
from numpy.typing import ArrayLike, NDArray

from app.shared.settings import static_folder
from app.viewer.panel.posture import short
from app.viewer.scene.bodies.drawing import Drawing, drawing
from app.viewer.scene.bodies.parts import Part, joint_color
from app.viewer.scene.chain import Link, chain
from app.viewer.scene.meshes import Body, body
from app.viewer.takehome.solver import solver_of
from app.viewer.views.templates import render
from kin import IKOptions, InputError, Obstacle, Robot, __version__, solve_ik
from kin.collision.solids import BOX, CYLINDER
from kin.ik.problem import read_pose
from kin.motion import Gripper, Motion
from kin.named import robot_of
from kin.robot import Joint
from kin.solvers.contract import POSE
from kin.transforms import Array
from kin.units import DEFAULT_UNITS, Units, typeset

LARGEST = 2_000_000  # bytes of a file: what learning platforms and mail take without a question
HIGHLIGHTED = "The highlighted value of a row moves with its joint."
SCRIPTS = ("takehome/numbers.js", "takehome/solver.js", "takehome/page.js")
# What the pages of all arms have in common, by the name of a file of its own.
_SHARED = {"page.css": ("takehome/page.css",), "three.js": ("vendor/three/three.min.js",), "page.js": SCRIPTS}
RATE = 60.0  # of the samples of a program, per second
MOST_SAMPLES = 3000  # of a program: a longer one has fewer a second
_STEPS = 65535  # of a coordinate of a mesh, over the size of the mesh
_OPTIONS = IKOptions()
_OBSTACLE = (158, 162, 168)  # as in the viewer
_HIDDEN = ("axis", "approach")  # parts of a generated body that show how a joint moves, not how the arm looks


@dataclass(frozen=True, eq=False)
class SavedArm:
    """What a saved page shows.

    Attributes:
        robot: the arm.
        q: its configuration ``(n,)``, radians (metres).
        drawn: the body that it is drawn with; None: the one made from its table.
        target: a pose of the tool ``(4, 4)`` whose postures can be stepped through; None: none.
        options: how the target is solved.
        motion: a program to play; None: none.
        units: of the numbers on the page.
        link: address of the full page with the same arm; "": there is none.
        obstacles: bodies around the arm, in the frame of the target.
    """

    robot: Robot
    q: Array
    drawn: Drawing | None = None
    target: ArrayLike | None = None
    options: IKOptions = _OPTIONS
    motion: Motion | None = None
    units: Units = DEFAULT_UNITS
    link: str = ""
    obstacles: tuple[Obstacle, ...] = ()


def save_page(
    robot: Robot | str,
    path: str | os.PathLike[str],
    q: ArrayLike | None = None,
    target: ArrayLike | None = None,
    motion: Motion | None = None,
    link: str = "",
    obstacles: Sequence[Obstacle] = (),
) -> Path:
    """As `kin.save_page`."""
    robot = robot_of(robot)
    if motion is not None and motion.robot != robot:
        raise InputError("motion", motion.robot.name, f"a motion of the same arm, {robot.name}")
    at = robot.q_home if q is None else robot.check_q(q)
    bodies = tuple(obstacles)
    options = IKOptions(obstacles=bodies)
    saved = SavedArm(robot, at, drawing(robot), target, options, motion, DEFAULT_UNITS, link, bodies)
    file = Path(path)
    file.write_text(web_page(saved), encoding="utf-8")
    return file


def web_page(saved: SavedArm, shared: bool = False) -> str:
    """The file, of at most `LARGEST` bytes.

    A body with more triangles than there is room for gives way to the one made from the table.

    Args:
        shared: whether what the pages of all arms have in common is in files beside this one (`shared_files`).

    Raises:
        InputError: a link that is no address of a web page, a program with nothing to drive, or obstacles for
            which there is no room.
    """
    if saved.link and not saved.link.startswith(("http://", "https://")):
        raise InputError("link", saved.link, "an address that begins with http:// or https://")
    page = _page(saved, saved.drawn, shared)
    if saved.drawn is not None and len(page.encode()) > LARGEST:
        page = _page(saved, None, shared)
    if saved.obstacles and len(page.encode()) > LARGEST:
        count = len(saved.obstacles)
        raise InputError(
            "obstacles", f"{count} in {len(page.encode())} bytes", f"a page of at most {LARGEST} bytes"
        )
    return page


def shared_files() -> dict[str, str]:
    """The files beside pages that share them: texts by name."""
    return {name: _text(name) for name in _SHARED}


def _page(saved: SavedArm, drawn: Drawing | None, shared: bool) -> str:
    solver = solver_of(saved.robot)
    return render(
        "takehome/page",
        title=saved.robot.name,
        joints=saved.robot.n,
        rows=_rows(saved.robot),
        source=saved.robot.source,
        version=__version__,
        link=saved.link,
        data=_as_script(_data(saved, drawn)),
        shared=shared,
        style=_text("page.css"),
        three=_text("three.js"),
        kernels=Markup(solver.script),
        script=_text("page.js"),
        refusal=solver.refusal,
        ignored=_ignored(saved),
        grips=saved.motion is not None
        and any(isinstance(each, Gripper) for each in saved.motion.program.segments),
    )


@cache
def _text(name: str) -> Markup:
    texts = [(static_folder() / part).read_text(encoding="utf-8") for part in _SHARED[name]]
    return Markup("\n".join(texts))


def _ignored(saved: SavedArm) -> str:
    """What counts for the saved target and not for the ones that the page solves for."""
    options = replace(saved.options, obstacles=())
    parts = ["obstacles are drawn, not avoided"] if saved.obstacles else []
    if options != _OPTIONS:
        parts.append("locked joints, a chosen posture and what else was asked of the saved target do not count")
    return "; ".join(parts)


def _as_script(data: dict[str, Any]) -> Markup:
    """JSON that nothing in it can end: a name may contain ``</script>``."""
    text = json.dumps(data, allow_nan=False, separators=(",", ":"), ensure_ascii=False)
    return Markup(text.replace("<", "\\u003c"))


def _data(saved: SavedArm, drawn: Drawing | None) -> dict[str, Any]:
    robot, made = saved.robot, body(saved.robot)
    return {
        "title": robot.name,
        "units": {"degrees": saved.units.degrees, "length": saved.units.length},
        "robot": arm_data(robot),
        "q": saved.q.tolist(),
        "parts": [
            _mesh(part, link, T) for part, link, T in [*_parts(made, drawn), *map(_obstacle, saved.obstacles)]
        ],
        "frames": [
            {"link": link.index + 1, "pose": T.ravel().tolist()}
            for link in made.chain.links
            for _, T in link.frames
        ],
        "center": made.center.tolist(),
        "radius": made.radius,
        "size": made.size,
        "floor": made.mount.floor,
        "target": None if saved.target is None else _target(saved, saved.target),
        "program": None if saved.motion is None else _program(saved.motion),
        "solver": solver_of(robot).about,
    }


def arm_data(robot: Robot) -> dict[str, Any]:
    """Joints, constants and rows of an arm as the script takes them."""
    found = chain(robot)
    return {
        "joints": [
            _joint(i, joint, home) for i, (joint, home) in enumerate(zip(robot.joints, robot.home, strict=True))
        ],
        "links": [_link(link) for link in found.links[1:]],
        "tool": found.T_last_tool.ravel().tolist(),
        "rows": _rows(robot),
        "convention": f"{robot.convention.capitalize()} convention. {HIGHLIGHTED}",
    }


def _joint(index: int, joint: Joint, home: float) -> dict[str, Any]:
    """A joint; the slider of one without limits reaches half a turn to either side, as in the viewer."""
    lower, upper = joint.limits or (-math.pi, math.pi)
    return {
        "name": joint.name,
        "turns": joint.kind == "revolute",
        "lower": lower,
        "upper": upper,
        "home": home,
        "color": joint_color(index),
    }


def _link(link: Link) -> dict[str, Any]:
    """What moves a link: a joint, so many times as far."""
    assert link.joint is not None
    return {
        "turns": link.joint.kind == "revolute",
        "joint": link.leader,
        "ratio": link.joint.ratio,
        "axis": link.T_parent_axis.ravel().tolist(),
    }


def _rows(robot: Robot) -> list[dict[str, Any]]:
    rows: list[dict[str, Any]] = []
    links = iter(chain(robot).links[1:])
    for row in robot.rows:
        moves = {"revolute": "theta", "prismatic": "d"}.get(row.kind)
        numbers = {"theta": row.theta, "d": row.d, "a": row.a, "alpha": row.alpha}
        joint = next(links).leader if moves else None
        rows.append({"name": row.name, "moves": moves, "joint": joint, "ratio": row.ratio, **numbers})
    return rows


def _parts(made: Body, drawn: Drawing | None) -> list[tuple[Part, int, Array | None]]:
    """Each mesh, the link that carries it (0: the base), and its pose there; None: as the link's."""
    found: list[tuple[Part, int, Array | None]] = [(made.mount.part, 0, None)]
    if drawn is not None:
        found += [(part, k, None) for k, parts in enumerate(drawn.parts) for part in parts]
        return [*found, *((part, each.link, None) for each in drawn.fingers for part in each.parts)]
    for link, parts in zip(made.chain.links, made.parts, strict=True):
        for part in parts:
            if part.name not in _HIDDEN:
                fixed = part.fixed_to_parent
                found.append(
                    (part, link.index if fixed else link.index + 1, link.T_parent_axis if fixed else None)
                )
    last = len(made.chain.links) - 1
    return [*found, (made.gripper[0], last, made.chain.T_last_tool)]


def _obstacle(obstacle: Obstacle) -> tuple[Part, int, Array]:
    """The mesh of an obstacle, beside the base."""
    from trimesh import creation  # its import takes a quarter of a second

    half, solid = obstacle.half, obstacle.kind.solid
    if solid == BOX:
        mesh = creation.box(2.0 * half)
    elif solid == CYLINDER:
        mesh = creation.cylinder(half[0], 2.0 * half[2], sections=48)
    else:
        mesh = creation.icosphere(2, half[0])
    return Part("obstacle", mesh, _OBSTACLE), 0, obstacle.T


def _mesh(part: Part, link: int, T: Array | None) -> dict[str, Any]:
    """A mesh as text: its coordinates as 16-bit steps over the size of the mesh, some micrometres each.

    Of rows of three the differences to the row before are deflated, most of which are small: a ninth of the rows.
    """
    vertices, faces = np.asarray(part.mesh.vertices, dtype=float), np.asarray(part.mesh.faces)
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    step = np.maximum(high - low, 1e-9) / _STEPS
    wide = len(vertices) > _STEPS
    return {
        "link": link,
        "pose": None if T is None else T.ravel().tolist(),
        "color": part.color,
        "double": part.double_sided,
        "wide": wide,
        "low": low.tolist(),
        "step": step.tolist(),
        "vertices": _packed(np.rint((vertices - low) / step).astype("<u2")),
        "faces": _packed(faces.astype("<u4" if wide else "<u2")),
    }


def _packed(rows: NDArray[Any]) -> str:
    """Whole numbers ``(k, 3)``; their differences are taken in their own type, in which sums go round too."""
    steps = np.diff(rows, axis=0, prepend=np.zeros((1, 3), rows.dtype)).astype(rows.dtype)
    return _base64(np.frombuffer(zlib.compress(steps.tobytes(), 9), np.uint8))


def _target(saved: SavedArm, target: ArrayLike) -> dict[str, Any]:
    result = solve_ik(saved.robot, target, q_seed=saved.q, options=saved.options)
    postures = [
        {"q": each.q.tolist(), "name": short(each.branch), "branch": each.branch} for each in result.solutions
    ]
    # Kernels take no pose of rounded digits, as `solve_ik` does.
    return {
        "pose": read_pose(target, POSE)[0].ravel().tolist(),
        "reason": typeset(result.explain(saved.units).text),
        "postures": postures,
        "plain": saved.options == _OPTIONS,
    }


def _program(motion: Motion) -> dict[str, Any]:
    driven = motion.driven
    if driven is None:
        raise InputError("motion", motion.reason, "a program that can be driven, at least in part")
    count = int(min(MOST_SAMPLES, max(2.0, math.ceil(driven.duration * RATE) + 1.0)))
    times = np.linspace(0.0, driven.duration, count)
    return {
        "name": "Program" if motion.planned else "Program, as far as it can be driven",
        "times": times.tolist(),
        "q": _base64(driven.sample(times).q.astype("<f8")),
    }


def _base64(values: NDArray[Any] | Sequence[float]) -> str:
    return base64.b64encode(np.ascontiguousarray(values).tobytes()).decode()
