"""A service that is killed or hangs is started again; processes of a few lines stand for it."""

from __future__ import annotations

import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
BEGIN = """
import os, signal, sys, time
sys.path.insert(0, {root!r})
from app.service import restarts

def stop_all():
    os.kill(os.getppid(), signal.SIGTERM)
    time.sleep(60)

def serve(first, say):
{body}

if __name__ == "__main__":
    {before}
    restarts.LONGEST_PAUSE = 0.01
    sys.exit(restarts.restarted(serve, {grace}))
"""

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="Linux only")


def run(body: str, grace: float = 20.0, before: str = "") -> subprocess.CompletedProcess[str]:
    """What becomes of a service that does this each time it is started; the first process begins with `before`."""
    lines = "\n".join(f"    {line}" for line in body.splitlines())
    code = BEGIN.format(root=str(ROOT), body=lines, grace=grace, before=before)
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=False)


def test_one_that_cannot_start_is_not_started_again():
    done = run("print('begins', flush=True)\nreturn 3")
    assert (done.returncode, done.stdout, done.stderr) == (3, "begins\n", "")


@pytest.mark.parametrize(
    ("act", "code"),
    [
        ("os.kill(os.getpid(), signal.SIGKILL)", -signal.SIGKILL),
        ("os.abort()", -signal.SIGABRT),
        ("os._exit(0)", 0),
        ("os._exit(1)", 1),
        ("raise SystemExit('a fault')", 1),
    ],
)
def test_one_that_has_served_is_started_again_however_it_ends(act, code):
    done = run(f"print(first, flush=True)\nsay()\nif first:\n    {act}\nstop_all()")
    assert (done.returncode, done.stdout) == (0, "True\nFalse\n")
    assert f"the service has ended with code {int(code)} and is started again now" in done.stderr


def test_what_the_first_process_does_at_its_end_is_not_done_by_those_that_it_starts():
    done = run(
        "say()\nif not first:\n    stop_all()\nreturn 0",
        before="import atexit; atexit.register(print, 'at the end')",
    )
    assert (done.returncode, done.stdout) == (0, "at the end\n")


def test_one_that_ends_soon_again_and_again_is_started_more_and_more_slowly(tmp_path):
    file = tmp_path / "lives"
    done = run(
        f"say()\nwith open({str(file)!r}, 'a+') as file:\n    file.write('.')\n"
        f"    if file.tell() == 5:\n        file.flush()\n        stop_all()\nreturn 1"
    )
    assert done.returncode == 0
    assert re.findall(r"is started again (now|in \S+ s)", done.stderr) == ["now", "now", "in 0.01 s", "in 0.01 s"]


def test_one_that_does_not_stop_is_killed():
    done = run("say()\nsignal.signal(signal.SIGTERM, signal.SIG_IGN)\nstop_all()", grace=0.05)
    assert done.returncode == 0
    assert "the service did not end within 0.05 s and is killed" in done.stderr


def test_a_service_knows_when_the_process_that_started_it_is_killed():
    done = run(
        "say()\nassert not restarts.is_orphan()\nos.kill(os.getppid(), signal.SIGKILL)\n"
        "while not restarts.is_orphan():\n    time.sleep(0.01)\nprint('alone', flush=True)\nreturn 0"
    )
    assert done.stdout == "alone\n"


@pytest.mark.parametrize(
    "hang",
    [
        pytest.param("time.sleep(60)", id="without the interpreter"),
        pytest.param("import ctypes; ctypes.PyDLL(None).sleep(60)", id="and never gives the interpreter back"),
    ],
)
def test_one_that_hangs_ends_itself_and_says_where(hang):
    done = run(
        "say()\nif not first:\n    stop_all()\nfor _ in range(3):\n"
        f"    restarts.end_after(0.1)\n    time.sleep(0.05)\n{hang}"
    )
    assert done.returncode == 0
    assert "has ended with code 1 and is started again now" in done.stderr
    assert re.search(r'File "<string>", line \d+ in serve', done.stderr)
