"""The set of points the tool reaches: clouds, sizes, sections.

Draws depend on nothing but their number (:mod:`kin.workspace.clouds.cloud`). Everything exact rests on one
compiled descent (:mod:`kin.workspace.facts.descent`), and everything that asks whether a point can be reached on
one map
of where descents may begin (:mod:`kin.workspace.facts.atlas`).
"""

from kin.workspace.capability.blocks import (
    CapabilityBlock,
    CapabilityGrid,
    CapabilityMap,
    capability_block,
    capability_grid,
    capability_join,
    capability_map,
)
from kin.workspace.clouds.cloud import STRATEGIES, Strategy, configuration_at, sample_workspace, workspace_slice
from kin.workspace.clouds.measures import MEASURES, Measure
from kin.workspace.facts.summary import workspace_facts
from kin.workspace.results import Estimate, Extreme, Section, SectionArc, Span, WorkspaceChunk, WorkspaceFacts
from kin.workspace.sections.cut import section

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
