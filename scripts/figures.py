"""Hook of MkDocs: arms in the pages of docs/ that readers can move.

``<!-- figure: ur5 -->`` in a page becomes a frame with a row of `FIGURES`, which `kin.save_page` writes for the
site. In a checkout the comment stays invisible.
"""

from __future__ import annotations

import re
import tempfile
from html import escape
from pathlib import Path
from typing import Any, NamedTuple

from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

import kin

ROOT = Path(__file__).parents[1]
COMMENT = re.compile(r"^<!-- figure: ([\w-]+) -->$", re.MULTILINE)


class Figure(NamedTuple):
    """One arm to move.

    Attributes:
        title: what a reader sees and can do.
        postures: whether the postures at its home can be stepped through.
        program: file of a program to play, below the top of the checkout.
    """

    title: str
    postures: bool = True
    program: str = ""


# By the id of the arm.
FIGURES = {
    "pioneer5": Figure("The Pioneer arm: move its joints, and step through the postures of its target"),
    "redundant7": Figure("The redundant arm as printed: joints 1 and 2 turn about one line"),
    "iiwa14": Figure("The LBR iiwa 14: postures that differ in shoulder, elbow and wrist"),
    "puma560": Figure("The PUMA 560 and the eight postures of its target"),
    "stanford": Figure("The Stanford arm: the third joint slides"),
    "ur5": Figure("The UR5 and the eight postures of its target"),
    "scara": Figure("A SCARA and its two postures"),
    "panda": Figure(
        "The Panda plays a program of lines and stops", postures=False, program="tests/data/pick.toml"
    ),
}


def on_files(files: Files, config: Any) -> Files:
    """Add the pages of all figures to the site."""
    with tempfile.TemporaryDirectory() as folder:
        for name, figure in FIGURES.items():
            robot = kin.get_robot(name)
            target = kin.fk(robot, robot.q_home) if figure.postures else None
            motion = None
            if figure.program:
                program = kin.motion.parse_program((ROOT / figure.program).read_text(encoding="utf-8"), robot)
                motion = kin.plan_motion(robot, program)
            path = kin.save_page(robot, Path(folder) / "page.html", target=target, motion=motion)
            files.append(File.generated(config, address(name), content=path.read_text(encoding="utf-8")))
    return files


def on_page_markdown(markdown: str, page: Page, **_: Any) -> str:
    """Put a frame in the place of each comment."""
    up = "../" * page.url.strip("/").count("/") + ("../" if page.url.strip("/") else "")
    return COMMENT.sub(lambda found: frame(found[1], up), markdown)


def address(name: str) -> str:
    """Of a figure's page, from the top of the site."""
    return f"figures/{name}.html"


def frame(name: str, up: str) -> str:
    """The frame of a figure; `up` leads to the top of the site."""
    title = escape(FIGURES[name].title)
    return (
        f'<figure class="arm"><iframe src="{up}{address(name)}" title="{title}" loading="lazy"></iframe>'
        f"<figcaption>{title}</figcaption></figure>"
    )
