"""What makes a start fast."""

from __future__ import annotations

import subprocess
import sys

import pytest


@pytest.mark.full
def test_a_service_moves_its_first_arm_without_what_it_does_not_need() -> None:
    """These imports would take a third of the time until a service is ready."""
    unneeded = {"scipy", "trimesh", "cffi", "mcp"}
    program = (
        "import sys; from app.cli.serve import import_service; import_service()\n"
        "import app.viewer.server, kin; kin.fk(arm := kin.get_robot('pioneer5'), arm.q_home)\n"
        f"print(sorted({unneeded} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
