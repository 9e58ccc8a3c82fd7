"""How to find the DH table of an arm, in nine steps, for each convention."""

from __future__ import annotations

from kin.robot import Convention

NINE_STEPS: dict[Convention, tuple[str, ...]] = {
    "standard": (
        (
            "Draw the axis of every joint: the line it turns about or slides along. The axis of joint 1 is "
            "z₀, of joint 2 z₁, and so on; of the two directions, choose either."
        ),
        ("Place frame 0 anywhere on z₀, with x₀ in any direction perpendicular to it."),
        (
            "Find the common normal of zᵢ₋₁ and zᵢ. Origin i is where it meets zᵢ, the outer axis. If the "
            "axes intersect, take the intersection. If they are parallel, choose one of the normals; best so "
            "that d becomes 0. If they are one line, there is no normal: choose a point of it, best again so "
            "that d becomes 0."
        ),
        (
            "Lay xᵢ along that normal. If the axes intersect, lay it perpendicular to both. If they are one "
            "line, any direction perpendicular to it will do, best the one of xᵢ₋₁. The opposite direction is"
            " right, too: it changes the signs of a and α, and both θ beside it by 180°."
        ),
        ("yᵢ follows from the right-hand rule: from x to y, with the thumb along z."),
        (
            "Place the last frame at the tool point, with x perpendicular to the last joint axis and through "
            "it; best with z in the approach direction. Where one row cannot do that, a fixed row or a tool "
            "transform follows."
        ),
        (
            "Read row i. θ: from xᵢ₋₁ to xᵢ, about zᵢ₋₁. d: from origin i−1 to the normal, along zᵢ₋₁. a: "
            "from zᵢ₋₁ to zᵢ, along xᵢ; negative if that is against xᵢ. α: from zᵢ₋₁ to zᵢ, about xᵢ."
        ),
        ("Write each row as a matrix Aᵢ: its four motions, multiplied in order."),
        ("Multiply the rows, A₁ A₂ … Aₙ: the pose of the last frame in the base frame."),
    ),
    "modified": (
        (
            "Draw the axis of every joint: the line it turns about or slides along. The axis of joint 1 is "
            "z₁, of joint 2 z₂, and so on; of the two directions, choose either."
        ),
        ("Place frame 0 at the base; best where frame 1 is while joint 1 is at 0, so that a₀ and α₀ become 0."),
        (
            "Find the common normal of zᵢ and zᵢ₊₁. Origin i is where it meets zᵢ, the inner axis. If the "
            "axes intersect, take the intersection. If they are parallel, choose one of the normals; best so "
            "that d becomes 0. If they are one line, there is no normal: choose a point of it, best again so "
            "that d becomes 0."
        ),
        (
            "Lay xᵢ along that normal. If the axes intersect, lay it perpendicular to both. If they are one "
            "line, any direction perpendicular to it will do. The opposite direction is right, too: it "
            "changes the signs of a and α of the next row, and both θ beside it by 180°."
        ),
        ("yᵢ follows from the right-hand rule: from x to y, with the thumb along z."),
        (
            "Place the last frame on the axis of the last joint, with x along the one before while that joint"
            " is at 0. The tool follows as a fixed row or a tool transform."
        ),
        (
            "Read row i. α: from zᵢ₋₁ to zᵢ, about xᵢ₋₁. a: from zᵢ₋₁ to zᵢ, along xᵢ₋₁; negative if that is "
            "against xᵢ₋₁. θ: from xᵢ₋₁ to xᵢ, about zᵢ. d: from the normal to origin i, along zᵢ."
        ),
        ("Write each row as a matrix Aᵢ: its four motions, multiplied in order."),
        ("Multiply the rows, A₁ A₂ … Aₙ: the pose of the last frame in the base frame."),
    ),
}
CRAIG_NOTE = "Steps 1, 2, 3, 4, 6 and 7 differ from those of the standard convention."
