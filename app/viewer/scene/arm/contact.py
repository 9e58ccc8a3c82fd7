"""The mark where the arm passes through what it is mounted on, or through the floor."""

from __future__ import annotations

import viser

from app.viewer.labels import add_label
from app.viewer.scene.clearance import Contact
from app.viewer.scene.key_number import place_beside
from app.viewer.scene.meshes import Body
from app.viewer.viser_patches import assign
from kin import Robot
from kin.transforms import Array

COLOR = (204, 20, 60)


class ContactMark:
    """A ball with a sentence, hidden at first; `node` is their parent."""

    def __init__(self, scene: viser.SceneApi, name: str, body: Body) -> None:
        self._body = body
        self.node = scene.add_frame(name, show_axes=False, visible=False)
        scene.add_icosphere(
            f"{name}/mark",
            2.4 * body.size,
            COLOR,
            subdivisions=2,
            opacity=0.5,
            cast_shadow=False,
            receive_shadow=False,
        )
        self._label = add_label(scene, f"{name}/text", "", anchor="bottom-center")

    def show(self, contact: Contact | None, robot: Robot, target: Array | None) -> str:
        """Mark a contact; None hides the mark. Returns the sentence, or "".

        `target`: a missed target ``(3,)``, whose number the sentence must not cover.
        """
        self.node.visible = contact is not None
        if contact is None:
            return ""
        assign(self.node, contact.point)
        height, anchor = place_beside(contact.point, 3.6 * self._body.size, target, self._body.radius)
        assign(self._label, (0.0, 0.0, height))
        if anchor != self._label.anchor:
            self._label.anchor = anchor
        text = contact.text(robot)
        if text != self._label.text:
            self._label.text = text
        return text
