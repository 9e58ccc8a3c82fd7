"""The part *Compare with…* of the tab: what is chosen, the comparison in the background, the drawing.

The arm on show is the table in question, the other arm the reference. Every change of either starts a new
comparison, and what is under way for the old one ends.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import cast, get_args

from app.shared.computations import Subscription
from app.viewer.declared.scene import SceneView
from app.viewer.feature import Stage
from app.viewer.meshes.incoming import IncomingFile
from app.viewer.own_arm import OwnArm
from app.viewer.panel import Post, assign, listen, update_html
from app.viewer.panel.part import add_html
from app.viewer.panel.status import Notice
from app.viewer.tabs.robot import edits
from app.viewer.tabs.robot.compare import reference, views
from app.viewer.tabs.robot.compare.drawing import Overlay
from app.viewer.tabs.robot.compare.reference import Reference
from app.viewer.tabs.robot.edits import EditError
from app.viewer.tabs.robot.files import MOST
from kin import InputError, KinematicsError
from kin.comparison import Comparison, Frames
from kin.files.numbers import index_of
from kin.transforms import Array

POLL = 0.1  # s between two looks at a comparison under way
TYPED = "typed"  # stands for a pasted text in the list of arms


class Comparing:
    """The comparison of one page. Builds its elements in whatever container is open.

    Args:
        post: posts ``("walk",)``, the joint that is marked.
    """

    def __init__(self, stage: Stage, post: Post) -> None:
        self._stage = stage
        self._other: Reference | None = None
        self._frames: Frames = "fixed"
        self._typing = False  # whether the field for a text is open
        self._reader: Subscription[Comparison] | None = None
        self._found: Comparison | None = None
        self._stopped = False
        self._view = SceneView(stage.client.scene, "compare", post)
        self._overlay: Overlay | None = None
        self._joint = 0
        gui = stage.client.gui
        self._form, self._answer = add_html(gui), add_html(gui)
        self._walk = gui.add_slider(
            "Joint of both arms",
            1,
            2,
            1,
            1,
            visible=False,
            hint="Marks the axis of one joint in both arms, in the scene",
        )
        listen(self._walk, post, ("walk",))
        self._about = add_html(gui)
        self.refresh()

    # What is chosen

    def choose(self, value: object) -> None:
        """Compare with an arm of the service, with a text, or with none."""
        if value == TYPED:
            self._typing = True
            self._use(None)
        elif value == "":
            self._typing = False
            self._use(None)
        else:
            found = reference.restored(value, self._stage.store) if isinstance(value, str) else None
            if found is None:
                valid = [TYPED, *(key for key, _ in reference.choices(self._stage.store))]
                raise InputError("other", value, "one of " + ", ".join(valid))
            self._typing = False
            self._use(found)

    def use_frames(self, value: object) -> None:
        """Whether base, tool and zeros have to agree."""
        if value not in get_args(Frames):
            raise InputError("agree", value, "fixed or free")
        self._frames = cast(Frames, value)
        self.start()

    def take(self, file: IncomingFile) -> None:
        """A text; raises `kin.KinematicsError`, or `MeshError` if it is too large."""
        text = file.text_or_zip(MOST)
        if not isinstance(text, str):
            file.forget()
            raise InputError("text", file.name, "a robot file (TOML), a URDF or a table; no zip")
        self._use(reference.of_text(file.name, text, self._stage.units, self._stage.now.robot.n))

    def _use(self, other: Reference | None) -> None:
        self._other = other
        self._joint = 0
        self.start()

    # The comparison

    @property
    def due(self) -> float | None:
        """Seconds until the next `tick`; None: nothing is under way."""
        return None if self._reader is None else POLL

    def start(self) -> None:
        """Compare the arm on show as it is now."""
        self.leave()
        self._found, self._stopped = None, False
        self._hide()
        if self._other is not None and "table" not in self._stage.activity.withheld:
            self._reader = self._stage.summaries.comparison(self._other.robot, self._stage.now.robot, self._frames)
        self.refresh()

    def stop(self) -> None:
        """End the search for mistakes; the verdict stays."""
        if self._reader is not None:
            self.leave()
            self._stopped = True
            self.refresh()

    def tick(self) -> None:
        """Show what is known by now."""
        reader = self._reader
        if reader is None:
            return
        if reader.finished:
            self.leave()
            error = reader.future.exception()
            if isinstance(error, KinematicsError):
                self._stage.notify(Notice("error", "These arms cannot be compared", str(error)))
                self._stopped = True
            elif error is not None:
                raise error
            else:
                self._found = reader.future.result()
                self._draw()
            self.refresh()
        elif reader.latest is not self._found:
            self._found = reader.latest
            self._draw()
            self.refresh()

    def leave(self) -> None:
        """Nobody waits for the comparison any more."""
        if self._reader is not None:
            self._reader.leave()
            self._reader = None

    def forget(self) -> None:
        """The visitor has left."""
        self.leave()

    def proposed(self, index: object, own: OwnArm | None) -> OwnArm:
        """The arm on show with the changes of an explanation; raises `EditError`."""
        found = () if self._found is None else self._found.explanations
        place = index_of(index, len(found))
        if place is None:
            raise EditError(None, "The table has changed since; this proposal is no longer for it.")
        return edits.with_table(self._stage.now.robot, own, found[place].robot)

    # The drawing

    def walk(self, value: object) -> None:
        """Mark another joint, counted from 1."""
        if isinstance(value, bool) or not isinstance(value, int | float) or not 1 <= value <= self._most:
            raise InputError("walk", value, f"1 to {self._most}")
        self._joint = int(value) - 1
        self.on_pose(self._stage.now.q)
        self._show_joint()

    @property
    def _most(self) -> int:
        return (
            self._stage.now.robot.n if self._other is None else max(self._stage.now.robot.n, self._other.robot.n)
        )

    def _draw(self) -> None:
        arm = self._stage.now
        found, other = self._found, self._other
        if found is None or other is None:
            return
        if self._overlay is None and found.first is not None:
            self._joint = max(found.first.joints, default=min(arm.robot.n, other.robot.n))
        self._hide()
        self._overlay = Overlay(self._view, other.robot, arm.robot, found)
        self._joint = min(self._joint, self._most - 1)
        self._walk.max = self._most
        assign(self._walk, self._joint + 1)
        self._walk.visible = self._most > 1
        self._stage.see_through(True, gizmo=True)
        self._overlay.show(arm.q, self._joint)

    def _hide(self) -> None:
        if self._overlay is not None:
            self._overlay.remove()
            self._overlay = None
            self._walk.visible = False
            self._stage.see_through(False)

    def on_pose(self, q: Array) -> None:
        """The arm on show moves."""
        if self._overlay is not None:
            self._overlay.show(q, self._joint)

    # Texts

    def refresh(self) -> None:
        """Show everything in the present units."""
        stage, other = self._stage, self._other
        if "table" in stage.activity.withheld:
            for each in (self._form, self._answer, self._about):
                update_html(each, "")
            return
        chosen = TYPED if self._typing else other.kept if other is not None and isinstance(other.kept, str) else ""
        update_html(self._form, views.form(list(reference.choices(stage.store)), chosen, self._frames))
        answer = ""
        if other is not None:
            answer = views.answer(
                self._found, other, stage.now.robot, stage.units, self._reader is not None, self._stopped
            )
        update_html(self._answer, answer)
        self._show_joint()

    def _show_joint(self) -> None:
        words = ""
        if self._overlay is not None and self._found is not None and self._other is not None:
            words = views.joint(
                self._found, self._joint, self._other.robot, self._stage.now.robot, self._stage.units
            )
        update_html(self._about, words)

    # Links

    def state(self) -> dict[str, object]:
        """What a link restores."""
        if self._other is None or self._other.kept is None:
            return {}
        return {"with": self._other.kept, **({"frames": self._frames} if self._frames != "fixed" else {})}

    def restore(self, state: object) -> None:
        """Take what a link has."""
        saved = state if isinstance(state, Mapping) else {}
        other = reference.restored(saved["with"], self._stage.store) if "with" in saved else None
        frames = saved.get("frames")
        self._frames = cast(Frames, frames) if frames in get_args(Frames) else "fixed"
        self._typing = other is not None and not isinstance(other.kept, str)
        self._use(other)
