"""Arguments of the commands about all that an arm reaches."""

from __future__ import annotations

from argparse import ArgumentParser, BooleanOptionalAction

from app.cli.arguments.options import UNITS_NOTE
from app.cli.arguments.shared import XYZ, add_dask
from app.cli.arguments.values import count, whole_number


def add_workspace(parser: ArgumentParser) -> None:
    """Size of the set of points the tool reaches; with -o a point cloud as a file."""
    parser.add_argument(
        "-o", "--output", metavar="FILE", help="write a point cloud in metres to this file; - is standard output"
    )
    parser.add_argument(
        "--picture", metavar="FILE", help="draw the cloud along the three axes, and the section (SVG)"
    )
    parser.add_argument(
        "--hull", metavar="FILE", help="write the convex hull of the cloud as a solid: stl, ply, obj, off, glb"
    )
    parser.add_argument(
        "--format",
        choices=("csv", "npz", "ply", "ndjson", "bin"),
        help="format of the point cloud (default: by the ending of its name)",
    )
    parser.add_argument("-n", type=count, default=100_000, help="number of points, such as 1e6 (default 100000)")
    parser.add_argument("--seed", type=whole_number, default=0, help="equal seeds give equal clouds (default 0)")
    parser.add_argument(
        "--strategy",
        choices=("uniform", "quasi", "volume", "boundary"),
        default="uniform",
        help="uniform: joints sampled uniformly (default); quasi: more evenly; volume: points even in space; "
        "boundary: points on the envelope",
    )
    parser.add_argument(
        "--measure",
        choices=("manipulability", "limit_margin", "limits"),
        action="append",
        default=[],
        help="add a column: manipulability, or limit_margin (older name: limits), the relative distance to the "
        "nearest joint limit (0 to 1); may be repeated",
    )
    parser.add_argument("--q", action="store_true", help="add the joint values, in radians (metres)")
    parser.add_argument(
        "--progress",
        action=BooleanOptionalAction,
        help="show progress on standard error (default: if that is a terminal)",
    )
    parser.add_argument(
        "--effort", type=whole_number, default=4, help="2 to 64: precision of volume and surface (default 4)"
    )


def add_capability(parser: ArgumentParser) -> None:
    """Capability map: from which directions the tool reaches each place."""
    size = parser.add_mutually_exclusive_group()
    size.add_argument("--voxel", metavar="SIDE", help="side of a voxel, millimetres (--rad: metres)")
    size.add_argument(
        "--resolution",
        type=whole_number,
        default=25,
        metavar="N",
        help="voxels along the longest side (default 25)",
    )
    parser.add_argument(
        "--directions",
        type=whole_number,
        default=48,
        metavar="N",
        help="directions per voxel: 12, 24, 48 (default) or 96",
    )
    add_dask(parser)
    parser.add_argument("-o", "--output", metavar="FILE", help="write the map to a file: .npz, .ply or .csv")


def add_postures(parser: ArgumentParser) -> None:
    """How many postures there are in a section of the task space, or in a plane of two joints."""
    parser.add_argument(
        "--pose",
        nargs="+",
        metavar="TEXT",
        help="the section contains this point, and the tool keeps this orientation (default: home)",
    )
    parser.add_argument(
        "--normal",
        nargs=3,
        type=float,
        metavar=XYZ,
        help="of the section (default: it contains the base's z axis)",
    )
    parser.add_argument("--joints", nargs=2, metavar="JOINT", help="two joints, whose plane is mapped instead")
    parser.add_argument(
        "--q", nargs="+", metavar="Q", help=f"where the other joints are, then (default: home); {UNITS_NOTE}"
    )
    parser.add_argument(
        "--resolution", type=whole_number, default=60, metavar="N", help="nodes along a side (default 60)"
    )
    parser.add_argument("-o", "--output", metavar="FILE", help="write the map to a file: .svg, .png or .csv")
    parser.add_argument("--ignore-limits", action="store_true", help="count postures outside the joint limits too")


def add_cuspidal(parser: ArgumentParser) -> None:
    """Whether the arm can change its posture without meeting a singularity."""
    about = "random poses to solve at most, inside the limits and as many again without (default 256)"
    parser.add_argument("--poses", type=count, default=256, metavar="N", help=about)
    parser.add_argument("--seed", type=whole_number, default=0, help="of the search (default 0)")
