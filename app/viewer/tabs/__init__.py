"""Tabs of the panel that are features of their own, between the arm's controls and the view's.

Adding one is one module with a :class:`~app.viewer.feature.Feature` and one row here.
"""

from __future__ import annotations

from app.viewer.feature import Feature
from app.viewer.tabs.program.tab import ProgramTab
from app.viewer.tabs.robot.tab import RobotTab
from app.viewer.tabs.workspace.tab import Workspace

TABS: tuple[type[Feature], ...] = (RobotTab, ProgramTab, Workspace)
