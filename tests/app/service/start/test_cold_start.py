"""A service on a machine where nothing has been compiled yet."""

from __future__ import annotations

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
UR5 = kin.get_robot("ur5")


@pytest.mark.slow
def test_a_visitor_of_a_new_machine_sees_what_is_prepared_and_gets_it_before_the_rest(tmp_path):
    env = os.environ | {
        "PYTHONPATH": str(ROOT),
        "NUMBA_CACHE_DIR": str(tmp_path / "kernels"),
        "KINBOARD_DATA": str(tmp_path / "data"),
        "KINBOARD_PORT": "0",
    }
    (tmp_path / "kernels").mkdir()
    command = [sys.executable, "-m", "app.cli", "serve"]
    with subprocess.Popen(command, cwd=ROOT, env=env, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            found = re.search(r":(\d+)/", process.stdout.readline())
            assert found

            def readyz() -> dict:
                return httpx2.get(f"http://127.0.0.1:{found[1]}/readyz", trust_env=False, timeout=60).json()

            wait_for(lambda: readyz()["status"] == "ready", 300)
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
