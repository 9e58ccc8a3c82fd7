"""What an arm in the scene is made of: meshes of one colour each, and the colours of the joints."""

from __future__ import annotations

from dataclasses import dataclass

from app.viewer.scene.shapes import Solid

Color = tuple[int, int, int]

# Okabe and Ito's palette, which stays distinguishable with any colour vision; ordered for contrast between
# neighbours along the arm.
JOINT_COLORS: tuple[Color, ...] = (
    (0, 114, 178),
    (230, 159, 0),
    (0, 158, 115),
    (204, 121, 167),
    (86, 180, 233),
    (213, 94, 0),
    (240, 228, 66),
)


@dataclass(frozen=True, eq=False)
class Part:
    """One mesh of one colour, in the coordinates of its node.

    `fixed_to_parent` attaches it to the previous link, in this joint's axis frame: a sleeve that a bar slides
    through. A `double_sided` mesh is seen from inside too: those in files may be open, or turned inside out.
    """

    name: str
    mesh: Solid
    color: Color
    fixed_to_parent: bool = False
    double_sided: bool = False


def joint_color(index: int) -> Color:
    """The colour of a moving joint, by its index."""
    return JOINT_COLORS[index % len(JOINT_COLORS)]
