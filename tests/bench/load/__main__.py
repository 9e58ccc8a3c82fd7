"""``python tests/bench/load MODE``: figures of a service under load."""

from __future__ import annotations

import argparse
import importlib
import json
import os
import sys
from pathlib import Path

ROOT = Path(__file__).parents[3]
sys.path[:0] = [str(ROOT), str(ROOT / "tests"), str(ROOT / "tests" / "bench")]

from app.bench.run import machine  # noqa: E402

MODES = {
    "rest": "requests a second beside an empty endpoint",
    "drag": "until the picture answers a drag, for 1, 10, 30 and 100 visitors",
    "beside": "the same for 10 and 30 visitors beside programs that have batches and equations computed",
    "live": "until the picture shows what a program sends, in turn with drags: 1, 10, 30 and 100 visitors",
    "play": "pictures of 1, 10 and 30 visitors who play a program, beside as many who drag",
    "lesson": "a teacher whom 30 students follow, a wall of their arms, 60 who join",
    "storm": "200 visitors at once",
    "cloud": "points a second: kernel and its steps, generator, REST, viewer",
    "soak": "visitors who come, drag, draw and go, over and over",
    "siege": "all attacks at once beside visitors who drag, in turn with quiet minutes",
    "attacks": "each attack of the siege alone beside visitors who drag",
}


def main() -> int:
    """0, or 1 if the soak found something left behind, or the siege something wrong."""
    parser = argparse.ArgumentParser(prog="python tests/bench/load", description=__doc__)
    parser.add_argument("mode", choices=(*MODES, "all"), help="; ".join(f"{k}: {v}" for k, v in MODES.items()))
    parser.add_argument("--quick", action="store_true", help="seconds instead of minutes, to try it")
    parser.add_argument("--compute", metavar="N", help="processes of the service that compute for REST")
    parser.add_argument(
        "--only",
        nargs="+",
        help="numbers of visitors, of points, of rounds; names of requests, of attacks",
    )
    parser.add_argument(
        "--minutes",
        type=int,
        help="how long the siege lasts, four at least; the soak: of a steady load, which stays",
    )
    parser.add_argument("--json", type=Path, metavar="FILE", help="write everything measured to this file")
    arguments = parser.parse_args()
    if arguments.compute is not None:
        os.environ["KINBOARD_COMPUTE"] = arguments.compute  # see `load.service.serve`
    found = {"machine": machine(), "compute": arguments.compute}
    failed = False
    if arguments.only and arguments.mode == "all":
        parser.error("--only goes with one mode")
    for mode in MODES if arguments.mode == "all" else [arguments.mode]:
        only, long = arguments.only, {}
        if arguments.minutes and mode == "siege":
            only = [arguments.minutes]
        elif arguments.minutes and mode == "soak":
            long = {"minutes": arguments.minutes}
        if only and mode not in ("rest", "attacks"):
            only = [int(value) for value in only]
        found[mode] = importlib.import_module(f"load.{mode}").run(arguments.quick, only, **long)
        failed |= bool(found[mode].get("left behind"))
        print(flush=True)
    if arguments.json is not None:
        arguments.json.write_text(json.dumps(found, indent=1) + "\n", "utf-8")
    return int(failed)


sys.exit(main())
