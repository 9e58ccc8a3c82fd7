"""One arm in a viser scene: nodes are created once, afterwards only poses are assigned.

`ArmScene` needs only a `viser.SceneApi`, so it works on a visitor's private scene and, in tests, on a server
without browsers.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import viser

from app.viewer.scene.arm.contact import ContactMark
from app.viewer.scene.arm.frames import ArmFrames
from app.viewer.scene.arm.joint_axes import axes
from app.viewer.scene.arm.looks import AxesShown, Look
from app.viewer.scene.bodies.drawing import Drawing, drawing
from app.viewer.scene.bodies.fingers import Finger
from app.viewer.scene.bodies.nodes import GHOST, DrawnBody, LinkColors
from app.viewer.scene.bodies.parts import Part
from app.viewer.scene.chain import turn
from app.viewer.scene.clearance import Contact, clearance_of
from app.viewer.scene.floor import Floor
from app.viewer.scene.gizmo_axes import GizmoAxes
from app.viewer.scene.lights import add_lamp
from app.viewer.scene.meshes import body
from app.viewer.viser_patches import assign, keep_private
from kin import Robot, fk
from kin.transforms import Array, pose_from_position_wxyz, wxyz_from_rotation

# Parts without shadows: these would cost as much as the shadows of the bodies, and are not visible.
NO_SHADOW = ("trim", "axis", "joint-axis", "approach")
STILL, NO_TURN = (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0)
SAME = 1e-9  # rad or m: smaller changes are below the precision of a browser's numbers
GIZMO = 0.26  # length of the gizmo's arrows, in radii of the sphere around the arm
LINE = 4.0  # their thickness, pixels
FOR_FINGERS = 1.6  # how much larger and thicker they are in the small picture of a phone
THROUGH = 0.4  # opacity of the bodies while drawings inside them are shown
GAP_COLOR = (213, 94, 0)


class ArmScene:
    """The nodes of one robot: arm, pedestal, floor, frames, target gizmo.

    Not thread-safe: call it from the visitor's worker, inside ``client.atomic()``.

    Args:
        drawn: the body that looks like the real arm; None: the robot's own, if it has one.
        root: prefix of all node names. Use a new one for each arm of a scene: the browser keeps the pose of a
            removed node and gives it to the next node of that name, whose own pose is not sent if it is zero.

    Attributes:
        gizmo: the transform controls; the visitor drags them, `place_gizmo` moves them. If some rotations are not
            available, the gizmo has only arrows, and each available ring is a child node (`set_gizmo_axes`).
        colors: paints links that touch each other.
        gizmo_in_base: whether `place_gizmo` aligns the gizmo with the base instead of the tool.
    """

    def __init__(
        self,
        scene: viser.SceneApi,
        robot: Robot,
        dark: bool = False,
        root: str = "/arm",
        drawn: Drawing | None = None,
    ) -> None:
        self.robot = robot
        self._root = root
        self.body = body(robot)
        self._look: Look = "body"
        self._scene = scene
        self._joints: list[viser.SceneNodeHandle] = []
        self._bodies: list[viser.MeshHandle] = []
        self._fingers: list[tuple[viser.MeshHandle, Finger]] = []  # of the skeleton's gripper
        self.colors = LinkColors()
        self._nodes: list[str] = []  # names of the nodes of the links, base first
        self._axes: list[viser.MeshHandle] = []
        self._body_axes: list[viser.MeshHandle] = []  # through the drawn body; made when they are first shown
        self._through = False
        self._shown = [math.nan] * len(robot.moving_rows)
        self._top: list[viser.SceneNodeHandle] = []
        self.floor = Floor(scene, root, self.body, robot.T_world_base[:3, 3], dark)
        self._top += [*self.floor.nodes, add_lamp(scene, f"{root}-lamp", self.body)]
        self._build_arm()
        self.gizmo = scene.add_transform_controls(
            f"{root}-target", scale=GIZMO * self.body.radius, line_width=LINE, depth_test=False, opacity=0.95
        )
        keep_private(self.gizmo)
        self._ghost = self._add(f"{root}-target", self.body.gripper[0], opacity=GHOST, visible=False)
        tool, color = self.body.chain.T_last_tool, self.body.gripper[0].color
        self._drawn = DrawnBody(self._add, self._nodes, f"{root}-target", tool, color)
        self._gap = scene.add_line_segments(
            f"{root}-gap",
            np.zeros((1, 2, 3), np.float32),
            GAP_COLOR,
            thickness=3.0,
            thickness_units="screen",
            visible=False,
        )
        self._contact = ContactMark(scene, f"{root}-contact", self.body)
        self._top += [self.gizmo, self._gap, self._contact.node]
        self._rings: list[viser.TransformControlsHandle] = []
        self._ring_sets = 0
        self.gizmo_in_base = False
        self._R_gizmo_target = np.eye(3)
        self.use_drawing(drawn or drawing(robot))
        self.open_gripper(self._drawn.opened)
        self.show(robot.q_home)
        self.place_gizmo(fk(robot, robot.q_home))

    def show(self, q: Array) -> None:
        """Pose every joint node for a configuration ``(n,)``; unchanged joints cost nothing."""
        shown, q = self._shown, self.robot.expand(q)
        for i, (link, node, value) in enumerate(
            zip(self.body.chain.links[1:], self._joints, q.tolist(), strict=True)
        ):
            if abs(value - shown[i]) <= SAME:
                continue
            shown[i] = value
            if link.joint is not None and link.joint.kind == "prismatic":
                assign(node, position=link.pose(value)[0])
            else:
                assign(node, wxyz=turn(link.wxyz, value))

    @property
    def opened(self) -> float | None:
        """How far the gripper is open, from 0 to 1; None without fingers."""
        drawn = self._drawn.drawing
        opens = self._fingers or (drawn is not None and drawn.fingers)
        return self._drawn.opened if opens else None

    def open_gripper(self, share: float) -> None:
        """Open the gripper to a share, from 0 (closed) to 1."""
        self._drawn.open(share)
        for node, finger in self._fingers:
            assign(node, *finger.place(share))

    def place_gizmo(self, T_base_tool: Array, again: bool = False) -> None:
        """Move the gizmo. Never call this while the visitor holds it. `again`: send its pose, changed or not."""
        wxyz = wxyz_from_rotation(T_base_tool[:3, :3])
        if self.gizmo_in_base:
            self._R_gizmo_target = T_base_tool[:3, :3].copy()
            assign(self.gizmo, T_base_tool[:3, 3], NO_TURN, again)
            turned = tuple(wxyz.tolist())
        else:
            self._R_gizmo_target = np.eye(3)
            assign(self.gizmo, T_base_tool[:3, 3], wxyz, again)
            turned = NO_TURN
        for ghost in (self._ghost, *self._drawn.hand):
            assign(ghost, wxyz=turned)
        for ring in self._rings:
            assign(ring, STILL, NO_TURN, again)

    def pulled(self, position: Sequence[float], wxyz: Sequence[float], ring: bool) -> Array:
        """The target ``(4, 4)`` for a pose of the gizmo or, in the gizmo's frame, of one of its rings."""
        T = pose_from_position_wxyz(position, wxyz)
        if ring:  # rings are children of the gizmo, which stays still until the ring is released
            T = self.gizmo_pose @ T
        T[:3, :3] = T[:3, :3] @ self._R_gizmo_target
        return T

    @property
    def gizmo_pose(self) -> Array:
        """The pose ``(4, 4)`` of the gizmo itself, without its rings."""
        return pose_from_position_wxyz(self.gizmo.position, self.gizmo.wxyz)

    def size_gizmo(self, small: bool) -> None:
        """Make the gizmo large enough for fingers in a small picture, or as large as usual."""
        factor = FOR_FINGERS if small else 1.0
        if self.gizmo.line_width == factor * LINE:
            return
        for handle in (self.gizmo, *self._rings):
            handle.scale, handle.line_width = factor * GIZMO * self.body.radius, factor * LINE

    def set_gizmo_axes(self, axes: GizmoAxes) -> list[viser.TransformControlsHandle]:
        """Give the gizmo these arrows and rings; returns the rings that are separate nodes.

        Separate rings are children of the gizmo: their pose is in its frame. One set of controls cannot hide a
        single ring, because viser draws a ring wherever both axes of its plane are active.
        """
        for ring in self._rings:
            ring.remove()
        self._ring_sets += 1
        separate = any(axes.rings) and not (all(axes.rings) and all(axes.arrows))
        self.gizmo.active_axes = axes.arrows
        self.gizmo.disable_rotations = separate or not any(axes.rings)
        self._rings = [
            self._scene.add_transform_controls(
                f"{self.gizmo.name}/ring-{'xyz'[axis]}-{self._ring_sets}",
                scale=self.gizmo.scale,
                line_width=self.gizmo.line_width,
                active_axes=(axis != 0, axis != 1, axis != 2),
                disable_axes=True,
                disable_sliders=True,
                depth_test=False,
                opacity=0.95,
            )
            for axis in range(3)
            if separate and axes.rings[axis]
        ]
        for ring in self._rings:
            keep_private(ring)
        return self._rings

    def show_gap(self, tool: Array, target: Array | None) -> None:
        """Draw a line to an unreached target ``(3,)``, and a ghost gripper there; None hides both.

        The arrow of the approach direction is drawn then, too; otherwise it would cover the gizmo's.
        """
        for node in (self._gap, self._approach):
            if node.visible != (target is not None):
                node.visible = target is not None
        self._show_ghost()
        if target is not None:
            self._gap.points = np.array([[tool, target]], dtype=np.float32)

    def contact_at(self, q: Array) -> Contact | None:
        """Where the arm, as it is drawn, passes through its mount or the floor at a configuration ``(n,)``."""
        return (self._skeleton_clear if self._bare else self._clear).at(q)

    def show_contact(self, contact: Contact | None, target: Array | None = None) -> str:
        """Mark where the arm passes through its mount or the floor; returns the sentence at the mark, or "".

        `target`: a missed target ``(3,)``, whose number the sentence must not cover.
        """
        return self._contact.show(contact, self.robot, target)

    def see_through(self, on: bool, gizmo: bool = False) -> None:
        """Make way for drawings inside the arm: translucent links, no axes at the base, no gizmo unless kept."""
        self.gizmo.visible = gizmo or not on
        self.show_base_axes(not on)
        self._through = on
        self._set_opacity()

    def use_drawing(self, drawn: Drawing | None) -> None:
        """Draw the body that looks like the real arm in this way; None: there is none."""
        self._drawn.use(drawn, self.colors)
        for node in self._body_axes:
            node.remove()
        self._body_axes = []
        self._skeleton_clear = clearance_of(self.robot, None)
        self._clear = clearance_of(self.robot, drawn)
        turned = self._ghost.wxyz
        for ghost in self._drawn.hand:
            assign(ghost, wxyz=turned)
        self.show_as(self._look)

    def show_as(self, look: Look) -> None:
        """Draw the arm as its body, its skeleton or both; an arm without a drawn body stays a skeleton."""
        self._look = look
        for node in self._bodies:
            node.visible = self._bare or look == "both"
        for node in self._drawn.nodes:
            node.visible = not self._bare
        self._frames.base_up.visible = self._bare or look == "both"  # the arrow is inside the body's foot
        self._show_ghost()
        self._set_opacity()

    @property
    def _bare(self) -> bool:
        """Whether only the skeleton is drawn."""
        return self._look == "skeleton" or not self._drawn.nodes

    def show_base_axes(self, visible: bool) -> None:
        """Show or hide the axes of the base frame."""
        self._frames.base.visible = visible

    def show_frames(self, visible: bool) -> None:
        """Show or hide the frame of every DH row."""
        self._frames.show(visible)

    def show_labels(self, visible: bool) -> None:
        """Show or hide the frames' names."""
        self._frames.show_labels(visible)

    def show_axes(self, shown: AxesShown) -> None:
        """Show or hide the joint axes: those of the skeleton, or of a body longer ones that stand out of it."""
        skeleton = self._bare or self._look == "both"
        for node in self._axes:
            node.visible = bool(shown) and skeleton
        through = shown == "every" and not skeleton
        drawn = self._drawn.drawing
        if through and drawn is not None and not self._body_axes:
            for link, part in zip(self._nodes[1:], axes(self.robot, self.body, drawn), strict=True):
                self._body_axes.append(self._add(link, part, name=f"{part.name}-{self._drawn.count}"))
        for node in self._body_axes:
            node.visible = through

    def remove(self) -> None:
        """Remove everything from the scene."""
        for node in self._top:
            node.remove()

    def _show_ghost(self) -> None:
        self._ghost.visible = self._gap.visible and self._bare
        for node in self._drawn.hand:
            node.visible = self._gap.visible and not self._bare

    def _set_opacity(self) -> None:
        for node in (*self._bodies, *self._axes, self._approach):
            node.opacity = THROUGH if self._through else None
        for node in self._drawn.nodes:
            node.opacity = THROUGH if self._through or self._look == "both" else None

    def _build_arm(self) -> None:
        root = self._scene.add_frame(self._root, show_axes=False)
        self._top.append(root)
        self._add(self._root, self.body.mount.part)
        self._frames = ArmFrames(self._scene, self._root, self.robot, self.body, 0.5 * GIZMO * self.body.radius)
        self._frames.add(self._root, -1, self.robot.T_world_base)
        name = self._root
        home = (0.0, *self.robot.expand(self.robot.q_home).tolist())
        for link, parts, q in zip(self.body.chain.links, self.body.parts, home, strict=True):
            parent = name
            if link.joint is not None:
                name = f"{parent}/{link.index + 1}"
                position, wxyz = link.pose(q)
                self._joints.append(self._scene.add_frame(name, show_axes=False, position=position, wxyz=wxyz))
            for part in parts:
                # The parent's node may already have a part of the same name.
                node = (
                    self._add(parent, part, link.T_parent_axis, name=f"{part.name}-{link.index + 1}")
                    if part.fixed_to_parent
                    else self._add(name, part)
                )
                (self._axes if part.name == "axis" else self._bodies).append(node)
                if part.name != "axis":
                    self.colors.add(link.index + (not part.fixed_to_parent), node, part.color)
            self._nodes.append(name)
            for row, T in link.frames:
                self._frames.add(name, row, T)
        tool = self.body.chain.T_last_tool
        gripper, approach = self.body.gripper
        self._bodies.append(self._add(name, self.body.palm if self.body.fingers else gripper, tool))
        for k, finger in enumerate(self.body.fingers):
            self._bodies.append(self._add(name, finger.parts[0], name=f"finger-{k}"))
            self._fingers.append((self._bodies[-1], finger))
        self._approach = self._add(name, approach, tool, visible=False)

    def _add(
        self,
        parent: str,
        part: Part,
        T: Array | None = None,
        opacity: float | None = None,
        visible: bool = True,
        name: str = "",
    ) -> viser.MeshHandle:
        T = np.eye(4) if T is None else T
        return self._scene.add_mesh_simple(
            f"{parent}/{name or part.name}",
            part.mesh.vertices,
            part.mesh.faces,
            color=part.color,
            opacity=opacity,
            side="double" if part.double_sided else "front",
            position=T[:3, 3],
            wxyz=wxyz_from_rotation(T[:3, :3]),
            visible=visible,
            cast_shadow=opacity is None and part.name not in NO_SHADOW,
            receive_shadow=False,  # round parts would shade themselves in stripes
        )
