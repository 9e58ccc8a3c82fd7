"""Zips of a small robot with meshes, and hostile ones."""

from __future__ import annotations

import io
import struct
import zipfile
from collections.abc import Mapping

import trimesh

TWO_JOINTS = """<robot name="two">
<material name="blue"><color rgba="0 0 1 1"/></material>
<link name="base"><visual><geometry><box size="0.2 0.2 0.1"/></geometry></visual></link>
<link name="upper"><visual><origin xyz="0 0 0.2"/><geometry>
<mesh filename="package://two_description/meshes/upper.stl" scale="0.001 0.001 0.001"/></geometry>
<material name="blue"/></visual></link>
<link name="fore"><visual><origin xyz="0 0 0.15" rpy="0 1.5707963267948966 0"/><geometry>
<mesh filename="../meshes/fore.obj"/></geometry><material name="blue"/></visual>
<visual><geometry><cylinder radius="0.03" length="0.1"/></geometry></visual></link>
<joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/><origin xyz="0 0 0.05"/>
<axis xyz="0 1 0"/><limit lower="-2" upper="2" effort="1" velocity="1"/></joint>
<joint name="elbow" type="revolute"><parent link="upper"/><child link="fore"/><origin xyz="0 0 0.4"/>
<axis xyz="0 1 0"/><limit lower="-2" upper="2" effort="1" velocity="1"/></joint>
</robot>"""


def _with_body(urdf: str, link: str, shape: str, xyz: str = "0 0 0", rpy: str = "0 0 0") -> str:
    """A URDF with a collision body in a link."""
    body = f'<collision><origin xyz="{xyz}" rpy="{rpy}"/><geometry>{shape}</geometry></collision>'
    return urdf.replace(f'<link name="{link}">', f'<link name="{link}">{body}')


UPPER = '<mesh filename="package://two_description/meshes/upper.stl" scale="0.001 0.001 0.001"/>'
# The meshes of two links, or of one, as collision bodies too.
MESH_AND_BOX = _with_body(
    _with_body(TWO_JOINTS, "upper", UPPER, "0 0 0.2"), "fore", '<box size="0.06 0.06 0.3"/>', "0 0 0.15"
)
COLLISIONS = _with_body(
    _with_body(_with_body(TWO_JOINTS, "upper", UPPER, "0 0 0.2"), "base", '<sphere radius="0.1"/>'),
    *("fore", '<mesh filename="../meshes/fore.obj"/>', "0 0 0.15", "0 1.5708 0"),
)


def stl() -> bytes:
    """A box of 80 × 80 × 400 mm."""
    return bytes(trimesh.creation.box((80.0, 80.0, 400.0)).export(file_type="stl"))


def obj() -> bytes:
    """A red and white bar of 60 × 60 × 300 mm, with its materials in bar.mtl."""
    corners = [(x, y, z) for x in (-0.03, 0.03) for y in (-0.03, 0.03) for z in (-0.15, 0.15)]
    lines = ["mtllib bar.mtl", *(f"v {x} {y} {z}" for x, y, z in corners), "usemtl red"]
    lines += ["f 1 2 4 3", "f 5 7 8 6", "f 1 5 6 2", "usemtl white", "f 3 4 8 7", "f 1 3 7 5", "f 2 6 8 4"]
    return "\n".join(lines).encode()


MTL = b"newmtl red\nKd 1 0 0\nmap_Kd ../../../../etc/hostname\nnewmtl white\nKd 1 1 1\n"


def robot_files(urdf: str = TWO_JOINTS) -> dict[str, str | bytes]:
    return {
        "two/urdf/two.urdf": urdf,
        "two/meshes/upper.stl": stl(),
        "two/meshes/fore.obj": obj(),
        "two/meshes/bar.mtl": MTL,
        "two/README.md": "a robot",
    }


def packed(files: Mapping[str, str | bytes]) -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            archive.writestr(name, content)
    return stream.getvalue()


def link(target: str) -> bytes:
    """A zip with a symbolic link."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        entry = zipfile.ZipInfo("two/meshes/upper.stl")
        entry.external_attr = 0o120777 << 16
        archive.writestr(entry, target)
    return stream.getvalue()


def with_byte(data: bytes, mark: bytes, offset: int, value: bytes) -> bytes:
    """The data with bytes replaced at an offset from each occurrence of a mark."""
    found = bytearray(data)
    at = data.find(mark)
    while at >= 0:
        found[at + offset : at + offset + len(value)] = value
        at = data.find(mark, at + 1)
    return bytes(found)


def announced(triangles: int) -> bytes:
    """The head of a binary STL with this many triangles, and no triangle."""
    return bytes(80) + struct.pack("<I", triangles)
