"""``kinboard so101``: an SO-100 or SO-101 beside its model in a page.

The page is one of a service of its own, in another process, so that drawing does not delay the servos. It and this
process each notice the end of the other. The address that the browser is started with holds a ticket that counts
once: the list of processes shows it to everybody on this machine.
"""

from __future__ import annotations

import contextlib
import signal
import sys
import threading
import time
import webbrowser
from argparse import Namespace
from collections.abc import Iterator, Sequence
from queue import SimpleQueue
from typing import Any, Final

import kin
from app.live import invite
from app.notebook.process import ServiceProcess
from app.viewer.session.state import encode, with_arm
from kin.notebook.driving import SLOW

NAME: Final = "kinboard so101"
RATE: Final = 60.0  # configurations of the page a second
OPENING: Final = 300.0  # s for a browser to open the page
# A closed terminal ends it as Ctrl+C does, which holds the arm where it is.
STOPPING: Final = [getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name)]
MISSING: Final = "this needs an extra: pip install 'kinboard[so101]'"


def run(arguments: Namespace, robot: kin.Robot, known: Sequence[kin.Robot]) -> int:
    """Show the arm and drive it until the owner or the page ends it; `known`: the arms of its service.

    Returns 0, 1 after a line that says why it was stopped, or 2 without the extra.
    """
    try:
        from app.servos.bus import Bus
        from app.servos.calibration import Calibration
        from app.servos.ports import find_port
        from app.servos.session import Session
    except ImportError as error:
        if error.name not in ("scservo_sdk", "serial", "serial.tools"):
            raise
        print(f"kinboard: {MISSING}", file=sys.stderr)
        return 2
    if threading.current_thread() is threading.main_thread():
        for each in STOPPING:
            signal.signal(each, signal.default_int_handler)
    try:
        port = arguments.port or find_port()
        calibration = Calibration(arguments.calibration, port)
        if arguments.code is None:
            calibration.applied(robot)  # what is lacking is said before a page is opened
        with contextlib.closing(Bus(port)) as bus, _page(arguments, robot, known) as page:
            print(f"Connected to the page with {page.robot.name}.", flush=True)
            speed = SLOW if arguments.speed is None else arguments.speed
            session = Session(page, bus, calibration.applied, typed(), speed, arguments.seconds)
            session.run(arguments.release)
    except KeyboardInterrupt:
        print("Ended.")
    except (kin.KinematicsError, OSError) as error:
        print(f"{NAME}: {error}", file=sys.stderr)
        return 1
    return 0


def typed() -> SimpleQueue[str]:
    """The lines of standard input, as they come."""
    lines: SimpleQueue[str] = SimpleQueue()

    def read() -> None:
        for line in sys.stdin:
            lines.put(line)

    threading.Thread(target=read, daemon=True).start()
    return lines


@contextlib.contextmanager
def _page(arguments: Namespace, robot: kin.Robot, known: Sequence[kin.Robot]) -> Iterator[Any]:
    """The page with a code, or a new one in the browser."""
    if arguments.code is not None:
        with kin.connect(arguments.address, arguments.code, name=NAME, token=arguments.token, rate=RATE) as page:
            yield page
        return
    with contextlib.closing(ServiceProcess()) as service:
        ticket, code = invite()
        service.send({"ticket": ticket, "code": code})
        address = f"http://localhost:{service.port}/"
        state = encode(with_arm(robot, None, known))
        url = f"{address}viewer/?shown={ticket}#s={state}"
        print(f"Opening {url}", flush=True)
        if not webbrowser.open(url):
            print("No browser was found: open this address yourself.", flush=True)
        with _opened(address, code) as page:
            yield page


def _opened(address: str, code: str) -> Any:
    """The page once it is open in the browser; raises `kin.KinematicsError` if it is not after `OPENING`."""
    end = time.monotonic() + OPENING
    while True:
        try:
            return kin.connect(address, code, name=NAME, rate=RATE)
        except kin.KinematicsError:
            if time.monotonic() > end:
                raise
            time.sleep(0.5)
