"""*Web page* in the tabs *View*, *Learn* and *Program*: the arm on show as a file for the visitor."""

from __future__ import annotations

from app.exports.snippets import named
from app.viewer.feature import Stage, save_file
from app.viewer.panel.status import Notice
from app.viewer.takehome.page import SavedArm, web_page
from kin.motion import Motion

OPEN = Notice("advice", "Not now", "The page would contain what the open question asks for.")


def send_page(stage: Stage, motion: Motion | None = None) -> None:
    """Download the arm as it is, with the postures of its target and, if there is one, a motion to play."""
    if stage.activity.withheld:
        stage.status.show(OPEN)
        return
    arm = stage.arm.now
    robot = named(arm.robot)
    drawn = stage.bodies.of(arm.robot, stage.robots.own)
    page = web_page(
        SavedArm(
            robot,
            arm.goal,
            drawn,
            arm.aim,
            arm.options,
            motion,
            stage.display.units,
            stage.links.page,
            arm.obstacles,
        )
    )
    words = "It needs no server: open it from a disk, send it, or put it into a learning platform."
    save_file(stage, f"{robot.id}.html", page, words)
