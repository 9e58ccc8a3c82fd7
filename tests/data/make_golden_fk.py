"""Writes golden-fk.json: poses of the built-in arms, computed by other people's libraries.

Run by hand, in an environment of its own; nothing of `kin` is imported::

    pip install "numpy<2" roboticstoolbox-python pin
    python tests/data/make_golden_fk.py

Two sources, independent of the DH tables in ``kin/robots`` wherever that is possible:

- **pinocchio**, from joint origins (xyz, rpy, axis) as a URDF states them: numbers of the maker's or the ROS
  description, or, for the three arms that have none, read off a drawing of the zero pose. No DH row is in them.
- **Robotics Toolbox for Python** (P. Corke), its own DH models, where it has the arm. Where its frames differ
  from ours, the difference is written out below.

An arm that both know must come out the same from both, else nothing is written. The planar arms come from the
formulas on the first pages of every textbook.
"""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pinocchio
import roboticstoolbox as rtb
from spatialmath import SE3

H = math.pi / 2
CASES = 20
TOLERANCE = 1e-9  # the toolbox's own URDF and DH numbers are typed with as many digits

# Joint: (kind, xyz, rpy, axis) in the frame of the joint before it; "fixed" has no axis. Metres and radians.
ORIGINS = {
    "puma560": (
        "drawing of the zero pose: upper arm forward, forearm up, shoulder offset to the right (−y)",
        [
            ("revolute", (0, 0, 0), (0, 0, 0), (0, 0, 1)),
            ("revolute", (0, 0, 0.67183), (0, 0, 0), (0, -1, 0)),
            ("revolute", (0.4318, 0, 0), (0, 0, 0), (0, -1, 0)),
            ("revolute", (0.0203, -0.15005, 0), (0, 0, 0), (0, 0, 1)),
            ("revolute", (0, 0, 0.4318), (0, 0, 0), (0, -1, 0)),
            ("revolute", (0, 0, 0), (0, 0, 0), (0, 0, 1)),
            ("fixed", (0, 0, 0.05625), (0, 0, 0)),
        ],
    ),
    "ur5": (
        "ROS-Industrial universal_robot, ur_description/urdf/ur5.urdf.xacro; frames base → tool0",
        [
            # The maker's base frame, which the DH table starts from, is turned by half a turn from base_link.
            ("fixed", (0, 0, 0), (0, 0, math.pi)),
            ("revolute", (0, 0, 0.089159), (0, 0, 0), (0, 0, 1)),
            ("revolute", (0, 0.13585, 0), (0, H, 0), (0, 1, 0)),
            ("revolute", (0, -0.1197, 0.425), (0, 0, 0), (0, 1, 0)),
            ("revolute", (0, 0, 0.39225), (0, H, 0), (0, 1, 0)),
            ("revolute", (0, 0.093, 0), (0, 0, 0), (0, 0, 1)),
            ("revolute", (0, 0, 0.09465), (0, 0, 0), (0, 1, 0)),
            ("fixed", (0, 0.0823, 0), (-H, 0, 0)),
        ],
    ),
    "irb120": (
        "ROS-Industrial abb, abb_irb120_support/urdf/irb120_3_58_macro.xacro; frames base → tool0",
        [
            ("revolute", (0, 0, 0), (0, 0, 0), (0, 0, 1)),
            ("revolute", (0, 0, 0.29), (0, 0, 0), (0, 1, 0)),
            ("revolute", (0, 0, 0.27), (0, 0, 0), (0, 1, 0)),
            ("revolute", (0, 0, 0.07), (0, 0, 0), (1, 0, 0)),
            ("revolute", (0.302, 0, 0), (0, 0, 0), (0, 1, 0)),
            ("revolute", (0.072, 0, 0), (0, 0, 0), (1, 0, 0)),
            ("fixed", (0, 0, 0), (0, H, 0)),
        ],
    ),
    "panda": (
        "Franka Emika, franka_description/robots/panda_arm.xacro; frames link0 → link8",
        [
            ("revolute", (0, 0, 0.333), (0, 0, 0), (0, 0, 1)),
            ("revolute", (0, 0, 0), (-H, 0, 0), (0, 0, 1)),
            ("revolute", (0, -0.316, 0), (H, 0, 0), (0, 0, 1)),
            ("revolute", (0.0825, 0, 0), (H, 0, 0), (0, 0, 1)),
            ("revolute", (-0.0825, 0.384, 0), (-H, 0, 0), (0, 0, 1)),
            ("revolute", (0, 0, 0), (H, 0, 0), (0, 0, 1)),
            ("revolute", (0.088, 0, 0), (H, 0, 0), (0, 0, 1)),
            ("fixed", (0, 0, 0.107), (0, 0, 0)),
        ],
    ),
    "iiwa14": (
        "KUKA, kuka_lbr_iiwa_support/urdf/lbr_iiwa_14_r820 (without its 0.4 mm of drawing offset); base → tool0",
        [
            ("revolute", (0, 0, 0), (0, 0, 0), (0, 0, 1)),
            ("revolute", (0, 0, 0.36), (0, 0, 0), (0, 1, 0)),
            ("revolute", (0, 0, 0), (0, 0, 0), (0, 0, 1)),
            ("revolute", (0, 0, 0.42), (0, 0, 0), (0, -1, 0)),
            ("revolute", (0, 0, 0), (0, 0, 0), (0, 0, 1)),
            ("revolute", (0, 0, 0.4), (0, 0, 0), (0, 1, 0)),
            ("revolute", (0, 0, 0), (0, 0, 0), (0, 0, 1)),
            ("fixed", (0, 0, 0.126), (0, 0, 0)),
        ],
    ),
    "scara": (
        "drawing of the zero pose: both links along x, the quill going down",
        [
            ("revolute", (0, 0, 0.387), (0, 0, 0), (0, 0, 1)),
            ("revolute", (0.325, 0, 0), (0, 0, 0), (0, 0, 1)),
            ("prismatic", (0.275, 0, 0), (0, 0, 0), (0, 0, -1)),
            ("revolute", (0, 0, 0), (math.pi, 0, 0), (0, 0, 1)),
        ],
    ),
    "stanford": (
        "drawing of the zero pose: boom upright, set 154 mm beside the column",
        [
            ("revolute", (0, 0, 0), (0, 0, 0), (0, 0, 1)),
            ("revolute", (0, 0, 0.412), (0, 0, 0), (0, 1, 0)),
            ("prismatic", (0, 0.154, 0), (0, 0, 0), (0, 0, 1)),
            ("revolute", (0, 0, 0), (0, 0, 0), (0, 0, 1)),
            ("revolute", (0, 0, 0), (0, 0, 0), (0, 1, 0)),
            ("revolute", (0, 0, 0), (0, 0, 0), (0, 0, 1)),
            ("fixed", (0, 0, 0.263), (0, 0, 0)),
        ],
    ),
}


def by_pinocchio(origins, q):
    """Pose of the last frame, the joints composed by pinocchio's forward kinematics."""
    model, parent, placement, low = pinocchio.Model(), 0, pinocchio.SE3.Identity(), 0
    for kind, xyz, rpy, *axis in origins:
        step = pinocchio.SE3(pinocchio.rpy.rpyToMatrix(*map(float, rpy)), np.array(xyz, dtype=float))
        placement = placement * step
        if kind == "fixed":
            continue
        along = np.array(axis[0], dtype=float)
        joint = (
            pinocchio.JointModelRevoluteUnaligned(along)
            if kind == "revolute"
            else pinocchio.JointModelPrismaticUnaligned(along)
        )
        parent = model.addJoint(parent, joint, placement, f"joint {low}")
        placement, low = pinocchio.SE3.Identity(), low + 1
    data = model.createData()
    pinocchio.forwardKinematics(model, data, np.array(q))
    return (data.oMi[parent] * placement).homogeneous


def puma560(q):
    # The toolbox ends at the wrist's centre; the flange is 56.25 mm further.
    return (rtb.models.DH.Puma560().fkine(q) * SE3.Tz(0.05625)).A


def ur5(q):
    arm = rtb.models.DH.UR5()
    arm.links[0].d = 0.089159  # the toolbox has 0.089459, a slip: the maker and ROS say 0.089159
    return arm.fkine(q).A


def panda(q):
    arm = rtb.models.DH.Panda()
    arm.tool = SE3()  # the toolbox adds its hand, 103 mm and −45°; ours ends at the flange
    return arm.fkine(q).A


def scara(q):
    return rtb.models.DH.Cobra600().fkine(q).A


def stanford(q):
    arm = rtb.models.DH.Stanford()
    arm.links[2].a = 0.0  # 20.3 mm of boom offset that the textbook's arm has not
    turned = np.add(q, [0, 0, 0, H, 0, 0])  # the toolbox turns the boom by −90°, so its wrist roll starts there
    return (arm.fkine(turned) * SE3.Tz(0.263)).A  # it ends at the wrist's centre


# Lengths of the links of planar arms, in metres.
PLANAR = {"planar2r": (1.0, 0.6), "planar3r": (1.0, 0.6, 0.3)}


def by_hand(lengths, q):
    """x = l₁ cos θ₁ + l₂ cos(θ₁ + θ₂) + …, y with sines; the tool is turned by the sum of all angles."""
    turned = np.cumsum(q)
    T = np.eye(4)
    c, s = np.cos(turned[-1]), np.sin(turned[-1])
    T[:2, :2] = [[c, -s], [s, c]]
    T[:2, 3] = np.dot(lengths, np.cos(turned)), np.dot(lengths, np.sin(turned))
    return T


TOOLBOX = {"puma560": puma560, "ur5": ur5, "panda": panda, "scara": scara, "stanford": stanford}


def main() -> None:
    golden = {}
    for seed, (robot_id, (source, origins)) in enumerate(ORIGINS.items()):
        rng = np.random.default_rng(seed)
        kinds = [kind for kind, *_ in origins if kind != "fixed"]
        low = [-math.pi if kind == "revolute" else 0.0 for kind in kinds]
        high = [math.pi if kind == "revolute" else 1.0 for kind in kinds]
        configurations = [np.zeros(len(kinds)), *rng.uniform(low, high, (CASES - 1, len(kinds)))]
        cases = []
        for q in configurations:
            q = np.round(q, 6)
            T = by_pinocchio(origins, q)
            if robot_id in TOOLBOX:
                assert np.abs(TOOLBOX[robot_id](q) - T).max() < TOLERANCE, (robot_id, q)
            cases.append({"q": q.tolist(), "T": (np.round(T, 12) + 0.0).tolist()})
        also = f"; roboticstoolbox {rtb.__version__} agrees" if robot_id in TOOLBOX else ""
        golden[robot_id] = {"source": f"pinocchio {pinocchio.__version__}: {source}{also}", "cases": cases}
    for seed, (robot_id, lengths) in enumerate(PLANAR.items(), len(ORIGINS)):
        rng = np.random.default_rng(seed)
        drawn = rng.uniform(-math.pi, math.pi, (CASES - 1, len(lengths)))
        configurations = np.round([np.zeros(len(lengths)), *drawn], 6)
        poses = [np.round(by_hand(lengths, q), 12) + 0.0 for q in configurations]
        cases = [{"q": q.tolist(), "T": T.tolist()} for q, T in zip(configurations, poses, strict=True)]
        golden[robot_id] = {"source": "sums of cosines and sines, by hand", "cases": cases}
    lines = ",\n".join(
        f'"{robot_id}": {{"source": {json.dumps(arm["source"], ensure_ascii=False)}, "cases": [\n'
        + ",\n".join(json.dumps(case) for case in arm["cases"])
        + "\n]}"
        for robot_id, arm in golden.items()
    )
    path = Path(__file__).with_name("golden-fk.json")
    path.write_text("{\n" + lines + "\n}\n", encoding="utf-8")
    print(f"{path}: {len(golden)} arms, {CASES} poses each")


if __name__ == "__main__":
    main()
