"""``kinboard open``: a page with an arm in the browser, and the code with which a program connects to it.

The code is drawn here and printed. The address that the browser is started with has a ticket instead, which counts
once: the list of processes shows it to everybody on this machine.
"""

from __future__ import annotations

import gc
from argparse import Namespace

from app.cli.serve import import_service, read_settings

WORDS = """A program connects to the page that opens:

    import kin
    page = kin.connect("{url}", "CODE")
"""


def run(arguments: Namespace) -> int:
    """Serve until Ctrl-C; 2 for an unknown robot or an invalid setting."""
    settings = read_settings({} if arguments.robots is None else {"robots": arguments.robots})
    if settings is None:
        return 2
    run_service = import_service()  # before what follows, which would import more
    from app.classroom.tokens import show_code
    from app.cli.terminal import robot_of, store_of
    from app.live import invite
    from app.viewer.session.state import encode, with_arm

    try:
        state = ""
        if arguments.robot is not None:
            state = f"#s={encode(with_arm(robot_of(arguments), None, store_of(arguments).robots))}"
        ticket, code = invite()
        page, words = f"viewer/?shown={ticket}{state}", WORDS.replace("CODE", show_code(code))
        return run_service(settings.on_this_machine(), open_browser=True, page=page, words=words)
    finally:
        gc.unfreeze()


def run_so101(arguments: Namespace) -> int:
    """``kinboard so101``; see `app.servos.command.run`."""
    from app.cli.terminal import robot_of, store_of
    from app.servos.command import run

    return run(arguments, robot_of(arguments), store_of(arguments).robots)
