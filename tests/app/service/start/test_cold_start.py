"""A service and a program on a machine where nothing has been compiled yet."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import httpx2
import numpy as np
import pytest
from fake_browser import FakeBrowser
from live_server import wait_for

import kin
from kin.solvers import family_of
from kin.warmup import first_family

ROOT = Path(__file__).parents[4]
README = (ROOT / "README.md").read_text(encoding="utf-8")
EXAMPLE = re.compile(r"^curl -s http://127\.0\.0\.1:8000(/api/\S+) -H '[^']+' -d '(\{.*\})'$", re.MULTILINE)
UR5 = kin.get_robot("ur5")


def new_machine(tmp_path: Path) -> dict[str, str]:
    """The variables of a user who has started nothing of Kinboard before."""
    return os.environ | {"PYTHONPATH": str(ROOT), "KINBOARD_CACHE": str(tmp_path), "NUMBA_CACHE_DIR": ""}


@pytest.mark.slow
def test_on_a_new_machine_the_example_in_python_prints_the_solutions(tmp_path):
    code = README.split("```python\n")[1].split("```")[0]
    command, env = [sys.executable, "-c", code], new_machine(tmp_path)
    done = subprocess.run(command, env=env, capture_output=True, text=True, timeout=300, check=True)
    count = len(kin.solve_ik(UR5, kin.fk(UR5, UR5.q_home), q_seed=UR5.q_home).solutions)
    assert (done.stdout.split()[0], done.stdout.count("["), done.stderr) == ("solved", count, "")


@pytest.mark.slow
def test_on_a_new_machine_the_first_request_is_answered_and_a_visitor_sees_what_is_prepared(tmp_path):
    """The example of the README, when the service is ready; then a page, which gets its arm before the rest."""
    ((path, body),) = EXAMPLE.findall(README)
    env = new_machine(tmp_path) | {
        "KINBOARD_DATA": str(tmp_path / "data"),
        "KINBOARD_PORT": "0",
        "KINBOARD_TIME_BUDGET": "300",  # s; by default 30, of which the example takes half on an idle machine
    }
    command = [sys.executable, "-m", "app.cli", "serve"]
    with subprocess.Popen(command, cwd=ROOT, env=env, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            found = re.search(r":(\d+)/", process.stdout.readline())
            assert found

            def readyz() -> dict:
                return httpx2.get(f"http://127.0.0.1:{found[1]}/readyz", trust_env=False, timeout=60).json()

            wait_for(lambda: readyz()["status"] == "ready", 300)
            answer = httpx2.post(
                f"http://127.0.0.1:{found[1]}{path}", json=json.loads(body), trust_env=False, timeout=600
            )
            assert (answer.status_code, answer.json()["status"]) == (200, "solved"), answer.text
            wait_for(lambda: readyz()["kernels"] is not None, 60)
            assert readyz()["kernels"]["ready"] == [first_family()]
            with FakeBrowser(int(found[1])) as tab:
                tab.set("Robot", UR5.name)
                tab.wait(lambda: "Preparing the UR5 for the first time" in tab.html, 60)
                tab.wait(lambda: "Preparing" not in tab.html, 300)
                tab.settle()
                assert np.allclose(tab.tool_pose(), kin.fk(UR5, UR5.q_home))
            kernels = readyz()["kernels"]
            assert family_of(UR5) in kernels["ready"]
            assert len(kernels["waiting"]) > len(kernels["ready"])
        finally:
            process.terminate()
            process.wait(30)
