"""The C++ program of docs/integrate.md, compiled and run against a server."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import numpy as np
from live_server import serve, without_viewer

import kin

PAGE = Path(__file__).parents[4] / "docs" / "integrate.md"


def test_the_program_reads_a_motion(app, tmp_path):
    (code,) = re.findall(r"^```cpp\n(.*?)^```$", PAGE.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)
    source, program = tmp_path / "motion.cpp", tmp_path / "motion"
    source.write_text(code)
    subprocess.run(["g++", "-std=c++17", "-Wall", "-Wextra", "-Werror", source, "-o", program], check=True)
    with serve(without_viewer(app)) as port:
        done = subprocess.run(
            [program, f"http://127.0.0.1:{port}"], capture_output=True, text=True, timeout=60, check=True
        )
        refused = subprocess.run([program, f"http://127.0.0.1:{port}/nowhere"], capture_output=True, text=True)
    rows = np.array(
        [[float(word) for word in re.findall(r"-?\d[\d.e-]*", line)] for line in done.stdout.splitlines()]
    )
    assert len(rows) > 20
    assert np.allclose(np.diff(rows[:-1, 0]), 0.02)
    T = kin.fk("ur5", rows[-1, 1:])
    assert np.abs(T[:3, 3] - [-0.5, -0.3, 0.4]).max() < 1e-4
    assert refused.returncode != 0
    assert "not-found" in refused.stderr
