"""Write a page that shows and drives an SO-101 by itself, over the serial port of the browser.

    python examples/so101_webserial/write_page.py -o my_arm.html

Open the file in Chromium, Chrome or Edge. `docs/examples/webserial.md` says what the page can do and cannot.
"""

from __future__ import annotations

import json
import sys
from argparse import ArgumentParser
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import kin

FOLDER: Final = Path(__file__).parent
SCRIPTS: Final = ("servos.js", "panel.js")


def servo_data(robot: kin.Robot) -> list[dict[str, Any]]:
    """The motors of an arm as the scripts take them, in the order of its joints; last those that move none.

    Raises:
        InputError: a joint without a motor of its own, or a motor whose unit is not degrees.
    """
    speeds = kin.motion.motion_limits(robot).velocity.tolist()
    found = []
    for j, joint in enumerate(robot.joints):
        motors = [motor for motor in robot.motors if motor.joint == joint.name and motor.unit == "deg"]
        if len(motors) != 1 or joint.limits is None:
            raise kin.InputError("motors", robot.id, f"one motor in degrees, and limits, of {joint.name}")
        lower, upper = joint.limits
        motor = {"id": motors[0].id, "name": motors[0].name, "sign": motors[0].sign, "offset": motors[0].offset}
        found.append(motor | {"joint": joint.name, "lower": lower, "upper": upper, "velocity": speeds[j]})
    return [*found, *({"id": each.id, "name": each.name, "joint": ""} for each in robot.motors if not each.joint)]


def write_page(robot: kin.Robot, path: Path) -> Path:
    """Write the saved page of an arm with the scripts for its servos."""
    data = json.dumps(servo_data(robot)).replace("<", "\\u003c")
    page, _, end = kin.save_page(robot, path).read_text(encoding="utf-8").rpartition("</body>")
    scripts = [(FOLDER / name).read_text(encoding="utf-8") for name in SCRIPTS]
    parts = [f'<script type="application/json" id="servo-data">{data}</script>']
    parts += [f"<script>{script}</script>" for script in scripts]
    path.write_text("\n".join([page, *parts, f"</body>{end}"]), encoding="utf-8")
    return path


def main(words: Sequence[str] | None = None) -> int:
    """Write the page, and say where."""
    parser = ArgumentParser(description=__doc__.partition("\n")[0] if __doc__ else None)
    parser.add_argument("robot", nargs="?", default="so101", help="built-in arm or robot file (default: so101)")
    parser.add_argument("-o", "--output", type=Path, help="the file (default: the arm's id, and -webserial.html)")
    arguments = parser.parse_args(words)
    named = Path(arguments.robot)
    try:
        robot = kin.load_robot(named) if named.is_file() else kin.get_robot(arguments.robot)
        path = write_page(robot, arguments.output or Path(f"{robot.id}-webserial.html"))
    except (kin.KinematicsError, OSError) as error:
        print(f"write_page.py: {error}", file=sys.stderr)
        return 1
    print(f"{path}: {path.stat().st_size / 1000:.0f} kB. Open it in Chromium, Chrome or Edge.")
    return 0


if __name__ == "__main__":
    sys.exit(main())
