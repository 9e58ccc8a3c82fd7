"""Hook of MkDocs: arms in the pages of docs/ that readers can move.

Each built-in arm has a page, as `kin.save_page` writes it, but with the scripts that all share in files of their
own. The pictures of the page *Arms* lead to it, and ``<!-- figure: ur5 -->`` in a page becomes a frame with a row
of `FIGURES`. In a checkout the comment stays invisible.
"""

from __future__ import annotations

import re
from html import escape
from pathlib import Path
from typing import Any, NamedTuple

from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

import kin
from app.viewer.scene.bodies.drawing import drawing
from app.viewer.takehome.page import SavedArm, shared_files, web_page

ROOT = Path(__file__).parents[1]
PICTURE = re.compile(r"!\[[^\]]*\]\(images/arms/([\w-]+)\.webp\)")
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
    """Add the pages of all arms, and leave out the theme's source maps and the word lists of other languages."""
    for file in list(files):
        if file.src_uri.startswith("assets/") and (file.src_uri.endswith(".map") or "/lunr/" in file.src_uri):
            files.remove(file)
    for name, text in shared_files().items():
        files.append(File.generated(config, f"figures/{name}", content=text))
    for robot in kin.builtin_robots().values():
        figure = FIGURES.get(robot.id, Figure(""))
        target = kin.fk(robot, robot.q_home) if figure.postures else None
        motion = None
        if figure.program:
            program = kin.motion.parse_program((ROOT / figure.program).read_text(encoding="utf-8"), robot)
            motion = kin.plan_motion(robot, program)
        saved = SavedArm(robot, robot.q_home, drawing(robot), target, motion=motion)
        files.append(File.generated(config, address(robot.id), content=web_page(saved, shared=True)))
    return files


def on_page_markdown(markdown: str, page: Page, **_: Any) -> str:
    """Put a frame in the place of each comment, and an arm's page behind its picture."""
    up = "../" * page.url.strip("/").count("/") + ("../" if page.url.strip("/") else "")
    if page.file.src_uri == "arms.md":
        markdown = PICTURE.sub(lambda found: f"[{found[0]}<br>Try it]({address(found[1])})", markdown)
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
