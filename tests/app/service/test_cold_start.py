"""A service and a program in a checkout whose kernels have not been compiled yet."""

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

ROOT = Path(__file__).parents[3]
README = (ROOT / "README.md").read_text(encoding="utf-8")
EXAMPLE = re.compile(r"^curl -s http://127\.0\.0\.1:8000(/api/\S+) -H '[^']+' -d '(\{.*\})'$", re.MULTILINE)
UR5 = kin.get_robot("ur5")


@pytest.mark.slow
def test_kernels_are_compiled_before_the_service_answers_and_a_program_then_has_them(tmp_path):
    """The examples of the README, and a page with another arm."""
    env = os.environ | {"PYTHONPATH": str(ROOT), "KINBOARD_CACHE": str(tmp_path), "KINBOARD_KERNELS": "c"}
    service = [sys.executable, "-m", "app.cli", "serve", "--port", "0"]
    data = {"KINBOARD_DATA": str(tmp_path / "data")}
    with subprocess.Popen(service, cwd=ROOT, env=env | data, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            found = re.search(r":(\d+)/", process.stdout.readline())
            assert found
            ((path, body),) = EXAMPLE.findall(README)
            url = f"http://127.0.0.1:{found[1]}"
            answer = httpx2.post(f"{url}{path}", json=json.loads(body), trust_env=False, timeout=10)
            assert (answer.status_code, answer.json()["status"]) == (200, "solved"), answer.text
            wait_for(lambda: httpx2.get(f"{url}/viewer/", trust_env=False, timeout=10).status_code == 200, 120)
            with FakeBrowser(int(found[1])) as tab:
                tab.set("Robot", UR5.name)
                tab.wait(lambda: np.allclose(tab.tool_pose(), kin.fk(UR5, UR5.q_home)))
        finally:
            process.terminate()
            process.wait(30)
    code = README.split("```python\n")[1].split("```")[0]
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, env=env, capture_output=True, text=True, timeout=60, check=True)
    count = len(kin.solve_ik(UR5, kin.fk(UR5, UR5.q_home), q_seed=UR5.q_home).solutions)
    assert (done.stdout.split()[0], done.stdout.count("["), done.stderr) == ("solved", count, "")
