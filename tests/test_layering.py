"""Who may import whom, held by a walk over the syntax tree of every module."""

from __future__ import annotations

import ast
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]

# A folder or module, and what it may import besides the standard library. The longest matching row counts.
# A name allows what is below it too; "app.viewer" allows app.viewer.session.
RULES: dict[str, set[str]] = {
    "kin": {"kin", "numpy", "numba"},
    "kin/compiled.py": {"numba"},
    "kin/simd.py": {"numba", "kin.compiled"},
    "kin/kernels.py": {"numpy", "kin.compiled", "kin.simd", "kin.transforms"},
    "app": {"kin", "app.answers", "app.clouds", "app.settings", "app.store"},
    "app/processor.py": set(),
    "app/clouds.py": {"kin", "app.processor"},
    "app/maps.py": {"kin", "app.clouds", "app.mapreduce"},
    "app/formats.py": {"kin", "numpy", "app.clouds"},
    "app/save.py": {"kin", "app.clouds", "app.formats"},
    "app/bench": {"kin", "numpy", "numba", "app.bench"},
    "app/bench/contestants.py": {
        *(
            "kin",
            "numpy",
            "numba",
            "scipy",
            "app.bench",
            "eaik",
            "ik_geo",
            "ikpy",
            "pinocchio",
            "py_opw_kinematics",
        ),
        *("roboticstoolbox", "spatialmath", "ssik"),
    },
    "app/settings.py": {"pydantic", "pydantic_settings"},
    "app/store.py": {"kin"},
    "app/answers.py": {"kin", "numpy", "typing_extensions"},
    "app/cli.py": {
        "kin",
        "app.bench.command",
        "app.commands",
        "app.main",
        "app.mapping",
        "app.settings",
        "pydantic",
    },
    "app/equations": {"kin", "numpy", "sympy", "app.equations"},
    "app/check.py": {"kin", "numpy", "typing_extensions", "app.answers"},
    "app/mapreduce.py": {"kin", "distributed"},
    "app/terminal.py": {"kin", "app.store"},
    "app/mapping.py": {"kin", "numpy", "app.answers", "app.mapreduce", "app.terminal"},
    "app/commands.py": {
        *("kin", "numpy", "app.answers", "app.check", "app.clouds", "app.formats", "app.hull", "app.picture"),
        *("app.save", "app.terminal"),
    },
    "app/prefix.py": {"starlette"},
    "app/security.py": {"starlette"},
    "app/pages.py": {"starlette", "kin"},
    "app/access.py": {"starlette", "app.api.problems"},
    "app/metrics.py": {"prometheus_client"},
    "app/inspection.py": {"msgspec"},
    "app/hull.py": {"kin", "numpy", "scipy", "trimesh"},
    "app/picture.py": {"kin", "numpy"},
    "app/workers.py": set(),
    "app/snippets.py": {"kin", "numpy"},
    "app/observe.py": {"starlette", "app.access", "app.metrics"},
    "app/bridge.py": {"starlette", "websockets", "app.access", "app.inspection", "app.metrics", "app.security"},
    "app/startup.py": {"kin", "app.bridge", "app.clouds", "app.maps", "app.settings", "app.store", "app.viewer"},
    "app/main.py": {
        *("kin", "fastapi", "starlette", "pydantic", "uvicorn", "app.access", "app.api", "app.clouds"),
        "app.processor",
        *("app.inspection", "app.maps", "app.metrics", "app.observe", "app.workers"),
        *("app.bridge", "app.pages", "app.prefix", "app.security", "app.settings", "app.startup", "app.store"),
    },
    "app/api": {
        *("fastapi", "starlette", "pydantic", "pydantic_core", "typing_extensions", "numpy", "kin"),
        *("app.api", "app.answers", "app.clouds", "app.equations", "app.formats", "app.maps", "app.processor"),
        *("app.metrics", "app.security", "app.settings", "app.store"),
    },
    "app/viewer": {
        *("viser", "trimesh", "numpy", "uvloop", "kin"),
        *("app.viewer", "app.clouds", "app.equations", "app.maps", "app.metrics", "app.picture", "app.settings"),
        *("app.snippets", "app.store"),
    },
}

MODULES = sorted(
    path.relative_to(ROOT).as_posix() for package in ("kin", "app") for path in (ROOT / package).rglob("*.py")
)


def imports(source: str) -> set[str]:
    """Every module a source imports, at the top or inside a function, as dotted names."""
    found: set[str] = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"line {node.lineno}: relative imports hide who is meant"
            # `from app import bridge` imports app.bridge; `from kin import fk` is within kin either way.
            found |= {f"{node.module}.{alias.name}" for alias in node.names}
    return found


def rule_of(module: str) -> set[str]:
    rows = [row for row in RULES if module == row or module.startswith(row + "/")]
    return RULES[max(rows, key=len)]


def breaches(module: str, source: str) -> set[str]:
    allowed = rule_of(module)
    return {
        name
        for name in imports(source)
        if name.split(".")[0] not in sys.stdlib_module_names
        and not any(name == entry or name.startswith(entry + ".") for entry in allowed)
    }


@pytest.mark.parametrize("module", MODULES)
def test_a_module_imports_only_what_its_layer_may(module):
    assert not breaches(module, (ROOT / module).read_text(encoding="utf-8"))


@pytest.mark.parametrize("row", RULES)
def test_every_row_of_the_table_has_its_module(row):
    assert (ROOT / row).exists()


@pytest.mark.parametrize(
    ("module", "source"),
    [
        ("kin/fk.py", "from app.store import Store"),
        ("kin/solvers/new.py", "import scipy"),
        ("kin/kernels.py", "from kin.robot import Robot"),
        ("app/viewer/scene.py", "import fastapi"),
        ("app/viewer/panel/new.py", "def late():\n    from app.api.schemas import Pose"),
        ("app/viewer/new.py", "from app import api"),
        ("app/api/routes.py", "import viser"),
        ("app/api/routes.py", "from app.viewer.server import ViewerServer"),
        ("app/cli.py", "from app.viewer import server"),
        ("app/bridge.py", "import viser"),
        ("app/bench/run.py", "import pinocchio"),
        ("app/new.py", "import requests"),
    ],
)
def test_the_table_has_teeth(module, source):
    assert breaches(module, source)


def test_what_is_allowed_passes():
    assert not breaches("app/main.py", "import json\nfrom app.api import api_routes\nimport uvicorn")
    assert not breaches("kin/fk.py", "import numpy as np\nfrom kin import kernels")
