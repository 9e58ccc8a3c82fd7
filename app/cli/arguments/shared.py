"""Arguments that several commands share."""

from __future__ import annotations

from argparse import ArgumentParser
from functools import cached_property

from app.cli.arguments.options import UNITS_NOTE, add_options
from app.cli.arguments.values import frame, workpiece

ROBOT_HELP = "id of the robot (`kinboard robots` lists them), or a robot file (*.toml, *.urdf)"
XYZ = ("X", "Y", "Z")


class Parents:
    """Arguments that several commands share, as parent parsers.

    Attributes:
        arm: the robot.
        robots: ``--robots``, the folder of further robot files.
        output: ``--json`` and the units.
        joints: ``--lock`` and ``--limit``.
        pendant: ``--pendant``.
        mounts: ``--base`` and ``--tool``.
        frames: these and ``--workpiece``.
    """

    def __init__(self) -> None:
        self.arm = ArgumentParser(add_help=False)
        self.arm.add_argument("robot", metavar="ROBOT", help=ROBOT_HELP)
        self.robots = ArgumentParser(add_help=False)
        self.robots.add_argument("--robots", metavar="FOLDER", help="folder with further robot files (*.toml)")
        self.output = ArgumentParser(add_help=False)
        self.output.add_argument(
            "--json", action="store_true", help="print the result as JSON, in radians and metres"
        )
        unit = self.output.add_mutually_exclusive_group()
        unit.add_argument(
            "--deg", dest="rad", action="store_false", default=False, help="degrees and millimetres (default)"
        )
        unit.add_argument(
            "--rad",
            dest="rad",
            action="store_true",
            default=False,
            help="read and print radians and metres",
        )
        self.pendant = ArgumentParser(add_help=False)
        self.pendant.add_argument(
            "--pendant",
            action="store_true",
            help="read and print joint values as the arm's pendant shows them (pendant in its file)",
        )
        self.mounts = ArgumentParser(add_help=False)
        for flag, about in (
            (
                "--tool",
                "your tool (TCP), in the tool frame of the arm on which it is mounted: poses are its own",
            ),
            ("--base", "where the arm stands in a world frame of your own: poses are in that frame"),
        ):
            self.mounts.add_argument(
                flag, type=frame, metavar="X:Y:Z[:ROLL:PITCH:YAW]", help=f"{about}; {UNITS_NOTE}"
            )
        self.frames = ArgumentParser(add_help=False, parents=[self.mounts])
        self.frames.add_argument(
            "--workpiece",
            type=workpiece,
            action="append",
            metavar="NAME=X:Y:Z[:ROLL:PITCH:YAW]",
            default=[],
            help="a frame of your own, such as a table, with its pose in the world frame; --frame may name it; "
            f"{UNITS_NOTE}; may be repeated",
        )

    @cached_property
    def joints(self) -> ArgumentParser:
        """``--lock`` and ``--limit``; options of inverse kinematics, for which the core is imported."""
        parser = ArgumentParser(add_help=False)
        add_options(parser, ["limits", "locked", "wider_limits"])
        return parser


def add_dask(parser: ArgumentParser) -> None:
    """The argument of the commands whose work a cluster can do."""
    parser.add_argument(
        "--dask",
        metavar="ADDRESS",
        help="compute on the workers of this Dask scheduler, such as tcp://host:8786; "
        "`pip install 'kinboard[cluster]'` installs what that needs",
    )
