"""Which file goes where is decided in static/upload.js: its limits are those of the features."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from app.viewer.live.feature import OPENED, Connect
from app.viewer.meshes.archive import MOST_BYTES
from app.viewer.tabs.program import program as programs
from app.viewer.tabs.program.tab import ProgramTab
from app.viewer.tabs.robot import files as arms
from app.viewer.tabs.robot.motors import feature as motors
from app.viewer.tabs.robot.tab import RobotTab

SCRIPT = Path(__file__).parents[3] / "static/upload.js"
ROW = re.compile(r'^ +(\w+): \{ feature: "(\w+)", tab: "(\w+)", most: ([\d_]+) \},$', re.MULTILINE)


def test_the_script_knows_the_features_and_their_limits():
    found = {
        kind: (feature, tab, int(most)) for kind, feature, tab, most in ROW.findall(SCRIPT.read_text("utf-8"))
    }
    assert found == {
        "arm": (RobotTab.key, RobotTab.title, arms.MOST),
        "zip": (RobotTab.key, RobotTab.title, MOST_BYTES),
        "calibration": (motors.Motors.key, RobotTab.title, motors.LARGEST),
        "program": (ProgramTab.key, ProgramTab.title, programs.LARGEST),
        "recording": (Connect.key, ProgramTab.title, OPENED.size),
    }


@pytest.mark.parametrize("feature", [RobotTab, motors.Motors, ProgramTab, Connect])
def test_each_of_them_takes_files(feature):
    assert "upload" in feature.messages
