"""The check at the end of the lesson "Rotations and frames"; it is the same for all arms."""

from __future__ import annotations

from app.viewer.lessons.guide.outline import PLAIN, Choice, Mistake, Number, count, one_right
from app.viewer.lessons.rotations.conventions import CONVENTIONS

CHECK: tuple[Number | Choice, ...] = (
    count(
        "How many conventions of three angles are there, with fixed and with moving axes?",
        len(CONVENTIONS),
        "3 · 2 · 2 sequences without the same axis twice in a row, each about fixed or about moving axes.",
        [
            (12, "That many sequences; each of them about fixed or about moving axes."),
            (27, "The same axis twice in a row is one turn, not two."),
        ],
    ),
    one_right(
        "A frame turns about its own z, then shifts along its own x. Which product is it?",
        ("Rz(θ) Tx(a)", "Own axes: each motion multiplies from the right."),
        (
            ("Tx(a) Rz(θ)", "That shifts along the fixed x: the frame would turn where it stands."),
            ("Tx(a) + Rz(θ)", "Motions are multiplied, not added."),
        ),
        0,
    ),
    one_right(
        "Two programs show roll pitch yaw = (10°, 20°, 30°) for different orientations. Why?",
        (
            "They have different conventions.",
            "Order of axes, fixed or moving: say which, or send R or a quaternion.",
        ),
        (
            (
                "One of them has a wrong R.",
                "Both may be right: the numbers mean nothing without a convention.",
            ),
            ("One of them is in gimbal lock.", "With a pitch of 20°, neither is."),
        ),
        1,
    ),
    Number(
        "A quaternion has w = 0. By which angle does it turn, in degrees?",
        180.0,
        PLAIN,
        1.0,
        "w = cos(θ/2) = 0: θ/2 is 90°.",
        (
            Mistake(90.0, "That is θ/2."),
            Mistake(0.0, "No turn has w = 1."),
        ),
    ),
)
