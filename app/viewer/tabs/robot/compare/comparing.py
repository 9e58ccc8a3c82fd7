"""The part *Compare with…* of the tab: what is chosen, the comparison in the background, the drawing.

The arm on show is the table in question, the other arm the reference. Every change of either starts a new
comparison, and what is under way for the old one ends.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import cast, get_args

from app.viewer.declared.facts import Facts
from app.viewer.declared.feature import DeclaredFeature
from app.viewer.declared.fields import Settings, memory, slider
from app.viewer.declared.panel import Control, Html
from app.viewer.declared.panel import Node as PanelNode
from app.viewer.declared.scene import Node
from app.viewer.declared.work import Result, Work
from app.viewer.meshes.incoming import IncomingFile
from app.viewer.own_arm import OwnArm
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

POLL = 0.1  # s between two looks at a comparison under way
TYPED = "typed"  # stands for a pasted text in the list of arms
WALK_HINT = "Marks the axis of one joint in both arms, in the scene"


@dataclass(frozen=True)
class CompareSettings(Settings):
    """What is compared, and what is shown of it.

    Attributes:
        joint: the number of the one that is marked.
        other: the arm to compare with.
        frames: whether base, tool and zeros have to agree.
        typing: whether the field for a text is open.
        stopped: what the comparison had come to when it was stopped.
        overlay: the drawing, once there is a verdict.
    """

    joint: int = slider("Joint of both arms", 1, (1, 2), whole=True, names="walk", hint=WALK_HINT, link=False)
    other: Reference | None = memory(renew=False)
    frames: Frames = memory("fixed", renew=False)
    typing: bool = memory(False, renew=False)
    stopped: Result | None = memory()
    overlay: Overlay | None = memory(renew=False)


class CompareFacts(Facts[CompareSettings]):
    """What is known of the comparison."""

    @property
    def comparison(self) -> Result:
        """What comparing has come to."""
        return self.settings.stopped or self.work("comparison")

    @property
    def found(self) -> Comparison | None:
        """The comparison, or the verdict alone."""
        found: Comparison | None = self.comparison.value
        return found

    @property
    def most(self) -> int:
        """Joints of the arm that has more."""
        other = self.settings.other
        return self.robot.n if other is None else max(self.robot.n, other.robot.n)


class Comparing(DeclaredFeature[CompareSettings, CompareFacts]):
    """The comparison of one page."""

    key = "compare"
    title = "Compare with"
    settings_of, facts_of = CompareSettings, CompareFacts

    # What is chosen

    def choose(self, value: object) -> None:
        """Compare with an arm of the service, with a text, or with none."""
        found = None
        if value not in (TYPED, ""):
            found = reference.restored(value, self.stage.services.store) if isinstance(value, str) else None
            if found is None:
                valid = [TYPED, *(key for key, _ in reference.choices(self.stage.services.store))]
                raise InputError("other", value, "one of " + ", ".join(valid))
        self.change(typing=value == TYPED)
        self._use(found)

    def use_frames(self, value: object) -> None:
        """Whether base, tool and zeros have to agree."""
        if value not in get_args(Frames):
            raise InputError("agree", value, "fixed or free")
        self.change(frames=value)
        self.start()

    def take(self, file: IncomingFile) -> None:
        """A text; raises `kin.KinematicsError`, or `MeshError` if it is too large."""
        text = file.text_or_zip(MOST)
        if not isinstance(text, str):
            file.forget()
            raise InputError("text", file.name, "a robot file (TOML), a URDF or a table; no zip")
        self._use(reference.of_text(file.name, text, self.stage.display.units, self.stage.arm.now.robot.n))

    def _use(self, other: Reference | None) -> None:
        self.change(other=other, joint=1)
        self.start()

    # The comparison

    def start(self) -> None:
        """Compare the arm on show as it is now."""
        self._runner.end()
        if self.settings.overlay is not None:
            self.stage.arm.scene.see_through(False)
            self._scene.remove()
        self.change(stopped=None, overlay=None)
        self.schedule()

    def stop(self) -> None:
        """End the search for mistakes; the verdict stays."""
        self.invalidate()
        self.change(stopped=self.facts.comparison)
        self.schedule()

    def started(self) -> None:
        self.start()

    def on_activity(self) -> None:
        if self._withheld != self.stage.activity.withheld:
            self.start()
        super().on_activity()

    def running(self) -> Sequence[Work]:
        s = self.settings
        if s.other is None or s.stopped is not None or self.hides("table"):
            return ()
        arms = s.other.robot, self.facts.robot, s.frames
        return [Work("comparison", self.stage.services.summaries.comparison, arms, poll=POLL)]

    def worked(self, key: str) -> None:
        f, s = self.facts, self.settings
        if isinstance(f.comparison.error, KinematicsError):
            words = str(f.comparison.error)
            self.stage.status.show(Notice("error", "These arms cannot be compared", words))
            self.change(stopped=f.comparison)
        else:
            super().worked(key)
        found, before, other = f.found, s.overlay, s.other
        if other is None or found is None or (before is not None and before.found is found):
            return
        if before is None and found.first is not None:
            ends = min(f.robot.n, other.robot.n)
            self.change(joint=min(max(found.first.joints, default=ends), f.most - 1) + 1)
        self.change(overlay=Overlay(other.robot, f.robot, found))
        self.stage.arm.scene.see_through(True, gizmo=True)

    def proposed(self, index: object, own: OwnArm | None) -> OwnArm:
        """The arm on show with the changes of an explanation; raises `EditError`."""
        found = () if self.facts.found is None else self.facts.found.explanations
        place = index_of(index, len(found))
        if place is None:
            raise EditError(None, "The table has changed since; this proposal is no longer for it.")
        return edits.with_table(self.stage.arm.now.robot, own, found[place].robot)

    # What is shown

    def panel(self) -> Sequence[PanelNode]:
        f, s, store = self.read, self.settings, self.stage.services.store
        if self.hides("table"):
            return ()
        other, drawn = s.other, s.overlay is not None
        chosen = TYPED if s.typing else other.kept if other is not None and isinstance(other.kept, str) else ""
        ends = 1, max(f.most, 2)
        spec = replace(self.spec("joint"), limits=ends, slider=ends)
        nodes: list[PanelNode] = [Html(views.form, (list(reference.choices(store)), chosen, s.frames), key="form")]
        if other is not None:
            busy = s.stopped is None and not f.comparison.finished
            args = f.found, other, f.robot, f.units, busy, s.stopped is not None
            nodes.append(Html(views.answer, args, key="answer"))
        nodes.append(Control("joint", spec=spec, visible=drawn and f.most > 1))
        if drawn and f.found is not None and other is not None:
            marked = f.found, s.joint - 1, other.robot, f.robot, f.units
            nodes.append(Html(views.joint, marked, key="joint"))
        return nodes

    def scene(self) -> Sequence[Node]:
        overlay = self.settings.overlay
        return [] if overlay is None else overlay.nodes(self.facts.q, self.settings.joint - 1)

    # Links

    def state(self) -> dict[str, object]:
        s = self.settings
        if s.other is None or s.other.kept is None:
            return {}
        return {"with": s.other.kept, **({"frames": s.frames} if s.frames != "fixed" else {})}

    def restore(self, state: object) -> None:
        saved = state if isinstance(state, Mapping) else {}
        if saved == self.state():
            return
        other = reference.restored(saved["with"], self.stage.services.store) if "with" in saved else None
        frames = saved.get("frames")
        self.change(
            frames=cast(Frames, frames) if frames in get_args(Frames) else "fixed",
            typing=other is not None and not isinstance(other.kept, str),
        )
        self._use(other)
