"""The set of points the tool reaches: clouds, sizes, sections, capability maps.

Samples depend on their index alone (:mod:`kin.workspace.clouds.cloud`). All exact results come from one compiled
descent (:mod:`kin.workspace.search.descent`), and whether a point can be reached is decided with one map of
starting configurations for it (:mod:`kin.workspace.search.cells`).
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
from kin.workspace.clouds.cloud import (
    STRATEGIES,
    Strategy,
    sample_workspace,
    workspace_configurations,
    workspace_slice,
)
from kin.workspace.clouds.measures import MEASURES, Measure
from kin.workspace.facts import workspace_facts
from kin.workspace.results import Estimate, Extreme, Section, SectionArc, Span, WorkspaceChunk, WorkspaceFacts
from kin.workspace.sections.cut import workspace_section

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
    "sample_workspace",
    "workspace_configurations",
    "workspace_facts",
    "workspace_section",
    "workspace_slice",
]
