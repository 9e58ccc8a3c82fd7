"""The set of points the tool reaches: clouds, sizes, sections.

Draws depend on nothing but their number (:mod:`kin.workspace.cloud`). Everything exact rests on one compiled
descent (:mod:`kin.workspace.settle`), and everything that asks whether a point can be reached on one map of where
descents may begin (:mod:`kin.workspace.atlas`).
"""

from kin.workspace.capability import (
    CapabilityBlock,
    CapabilityGrid,
    CapabilityMap,
    capability_block,
    capability_grid,
    capability_join,
    capability_map,
)
from kin.workspace.cloud import STRATEGIES, Strategy, configuration_at, sample_workspace, workspace_slice
from kin.workspace.cut import section
from kin.workspace.facts import workspace_facts
from kin.workspace.measures import MEASURES, Measure
from kin.workspace.results import Estimate, Extreme, Section, SectionArc, Span, WorkspaceChunk, WorkspaceFacts

__all__ = [
    "MEASURES",
    "STRATEGIES",
    "CapabilityBlock",
    "CapabilityGrid",
    "CapabilityMap",
    "Estimate",
    "Extreme",
    "Measure",
    "Section",
    "SectionArc",
    "Span",
    "Strategy",
    "WorkspaceChunk",
    "WorkspaceFacts",
    "capability_block",
    "capability_grid",
    "capability_join",
    "capability_map",
    "configuration_at",
    "sample_workspace",
    "section",
    "workspace_facts",
    "workspace_slice",
]
