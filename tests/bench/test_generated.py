"""The benchmark of generated code reads what gcc says about stack."""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
from generated import stack

GRAPH = """graph: { title: "arm.c"
node: { title: "arm_ik" label: "arm_ik\\narm.c:9:5\\n64 bytes (static)\\n0 dynamic objects" }
node: { title: "arm.c:solve" label: "solve\\narm.c:3:5\\n400 bytes (static)\\n0 dynamic objects" }
node: { title: "arm.c:sort" label: "sort\\narm.c:1:5\\n80 bytes (static)\\n0 dynamic objects" }
node: { title: "cos" label: "cos\\n<built-in>" shape : ellipse }
edge: { sourcename: "arm_ik" targetname: "arm.c:sort" label: "arm.c:10:3" }
edge: { sourcename: "arm_ik" targetname: "arm.c:solve" label: "arm.c:11:3" }
edge: { sourcename: "arm.c:solve" targetname: "arm.c:sort" label: "arm.c:4:3" }
edge: { sourcename: "arm.c:solve" targetname: "cos" label: "arm.c:5:3" }
}
"""


def test_stack_is_that_of_the_deepest_chain_of_calls() -> None:
    assert stack(GRAPH, "arm_ik") == 64 + 400 + 80
    assert stack(GRAPH, "arm.c:sort") == 80
