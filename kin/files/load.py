"""Any file of a robot: a robot file, a URDF or an MJCF model, by its path or as text."""

from __future__ import annotations

import os
from codecs import BOM_UTF8
from pathlib import Path

from kin.errors import InputError
from kin.files.read import load_toml, parse_robot
from kin.files.urdf.read import read_urdf
from kin.robot import Robot

XML = (".urdf", ".xml", ".mjcf", ".xacro")  # endings of files that hold a URDF or an MJCF model


def load_robot(source: os.PathLike[str] | str, base: str | None = None, tip: str | None = None) -> Robot:
    """The robot of a robot file (TOML), a URDF or an MJCF model, by path or text.

    `kin.files.read_urdf` reports about a URDF as well. It and `kin.files.parse_robot` take no text for a path, and
    are for texts of strangers.

    Args:
        source: the path of a file, or its text: a `str` with a ``<`` or several lines.
        base: of a URDF or MJCF model the link that the arm stands on; by default the root.
        tip: of a URDF or MJCF model the link that is the tool; needed if several are possible.

    Returns:
        The arm; that of a URDF as a standard DH table.

    Raises:
        RobotFileError: the file is invalid or cannot be read, or describes no serial arm.
        InputError: `source` is neither a path nor a text, or a robot file is given with links.

    Examples:
        >>> import kin, tempfile, pathlib
        >>> file = pathlib.Path(tempfile.mkdtemp()) / "mine.toml"
        >>> kin.save_robot("scara", file)
        >>> kin.load_robot(file) == kin.get_robot("scara")
        True
        >>> kin.load_robot(kin.robot_to_urdf("ur5"), tip="tool").n
        6
    """
    if not isinstance(source, str | os.PathLike):
        raise InputError("source", source, "the path of a file, or the text of a robot file, URDF or MJCF model")
    text = source if isinstance(source, str) and ("<" in source or "\n" in source.strip()) else None
    if text is None and _is_xml(Path(source)):
        return read_urdf(Path(source), base, tip).robot
    if text is not None and (
        text.lstrip("\ufeff \t\r\n").startswith("<")
        or ("[[rows]]" not in text and ("<robot" in text or "<mujoco" in text))
    ):
        return read_urdf(text, base, tip).robot
    for field, link in (("base", base), ("tip", tip)):
        if link is not None:
            raise InputError(field, link, "none: a robot file has no links")
    return load_toml(Path(source)) if text is None else parse_robot(text)


def _is_xml(path: Path) -> bool:
    """Whether a file is a URDF or an MJCF model: by its ending, or where that says nothing by its first letter."""
    ending = path.suffix.lower()
    if ending == ".toml" or ending in XML or not path.is_file():
        return ending in XML
    try:
        with path.open("rb") as file:
            return file.read(1000).removeprefix(BOM_UTF8).lstrip().startswith(b"<")
    except OSError:
        return False  # the reader says why it cannot be read
