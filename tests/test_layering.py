"""Which modules a folder may import, checked on the syntax tree of every module."""

from __future__ import annotations

import ast
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]

# One row per folder, and per module that needs more than its folder: what it may import besides the standard
# library. The longest matching row counts. A name allows what is below it too.
MODEL = {
    "kin.angles",
    "kin.axes",
    "kin.differential",
    "kin.errors",
    "kin.explained",
    "kin.fk",
    "kin.joint",
    "kin.motor",
    "kin.named",
    "kin.parsing",
    "kin.robot",
    "kin.singularity",
    "kin.tolerances",
    "kin.transforms",
    "kin.units",
}
RULES: dict[str, set[str]] = {
    "kin": {"kin", "numpy"},
    "kin/parsing.py": {"tomli_w", "kin.errors"},
    "kin/kernels": {"numpy", "kin.kernels", "kin.tolerances", "kin.transforms"},
    # Only `kin.generate`, when it is called, imports it: no service does.
    "kin/codegen": {"numpy", "kin._version", "kin.codegen", "kin.ik", "kin.kernels", "kin.solvers", *MODEL},
    "kin/calibration": {"numpy", "kin.calibration", "kin.collision", "kin.ik", *MODEL},
    "kin/comparison": {"numpy", "kin.comparison", "kin.dh", *MODEL},
    "kin/differential": {"numpy", "kin.axes", "kin.differential", "kin.fk", "kin.robot", "kin.transforms"},
    "kin/files": {
        *("numpy", "kin.collision", "kin.dh", "kin.files", "kin.fitting", "kin.frames", "kin.later", "kin.typed"),
        *MODEL,
    },
    "kin/escape": {"numpy", "kin.collision", "kin.escape", "kin.ik", "kin.solvers", "kin.way", *MODEL},
    "kin/doctor": {"numpy", "kin.doctor", "kin.files", "kin.typed", *MODEL},
    "kin/fitting": {"numpy", "kin.fitting", "kin.joint", "kin.robot", "kin.transforms"},
    "kin/motors": {"numpy", "kin.collision", "kin.motors", *MODEL},
    "kin/solvers": {"numpy", "kin.dh", "kin.kernels", "kin.solvers", *MODEL - {"kin.singularity"}},
    "kin/ik": {"numpy", "kin.collision", "kin.kernels", "kin.solvers", "kin.ik", *MODEL},
    "kin/collision": {"numpy", "kin.fitting", "kin.frames", "kin.kernels", "kin.collision", *MODEL},
    "kin/path": {"numpy", "kin.collision", "kin.kernels", "kin.solvers", "kin.ik", "kin.path", *MODEL},
    "kin/motion": {
        *("numpy", "kin.collision", "kin.files", "kin.kernels", "kin.solvers", "kin.ik", "kin.path", "kin.motion"),
        *("kin.frames", "kin.poses", "kin.typed", *MODEL),
    },
    "kin/poses": {"numpy", "kin.dh", "kin.frames", "kin.poses", "kin.typed", *MODEL},
    "kin/postures": {"numpy", "kin.ik", "kin.postures", "kin.solvers", "kin.workspace", *MODEL},
    "kin/way": {"numpy", "ompl", "kin.collision", "kin.ik", "kin.motion", "kin.way", *MODEL},
    # It looks the service up by name when it is called.
    "kin/notebook": {"numpy", "kin.collision", "kin.errors", "kin.motion", "kin.robot", "kin.transforms"},
    "kin/workspace": {"numpy", "kin.kernels", "kin.solvers", "kin.ik", "kin.workspace", *MODEL},
    "app": {"app", "kin"},
    "app/shared": {
        *("kin", "numpy", "app.shared", "pydantic", "pydantic_settings", "prometheus_client", "starlette"),
        *("typing_extensions", "distributed", "platformdirs", "msgspec"),
    },
    "app/exports": {
        "kin",
        "markupsafe",
        "mcap",
        "numpy",
        "scipy",
        "tqdm",
        "trimesh",
        "PIL",
        "app.exports",
        "app.shared",
    },
    "app/equations": {"kin", "numpy", "sympy", "app.equations", "app.shared.computations"},
    "app/exercises": {"kin", "numpy", "app.exercises"},
    "app/mcp": {
        *("mcp", "fastapi", "pydantic_core", "starlette", "websockets", "kin"),
        *("app.api", "app.classroom.tokens", "app.live.client.connection", "app.mcp", "app.shared"),
    },
    "app/classroom/courses": {"kin", "app.exercises", "app.classroom.courses"},
    "app/classroom": {"sqlalchemy", "alembic", "itsdangerous", "app.classroom", "app.shared"},
    "app/classroom/lti": {"jwt", "cryptography", "sqlalchemy", "itsdangerous", "app.classroom", "kin.parsing"},
    "app/classroom/results": {
        *("kin", "sqlalchemy", "app.classroom", "app.exercises.questions", "app.shared.spreadsheets"),
    },
    "app/live": {"kin", "app.classroom.tokens", "app.live", "app.shared.problems"},
    # A program's end of the line needs nothing of the service.
    "app/live/client": {"kin", "numpy", "websockets", "app.live.client", "app.live.recording"},
    "app/live/recording": {"kin", "lz4", "mcap", "numpy", "zstandard", "app.live.recording"},
    "app/bench": {"kin", "numpy", "app.bench"},
    # A page of a recorded run needs neither the core nor other libraries.
    "app/bench/board": {"jinja2", "markupsafe", "app.bench.board"},
    "app/bench/contestants": {
        *("kin", "numpy", "app.bench"),
        *(
            "coal",
            "eaik",
            "ik_geo",
            "ikpy",
            "pinocchio",
            "py_opw_kinematics",
            "roboticstoolbox",
            "ruckig",
            "scipy",
        ),
        *("roboplan", "spatialmath", "ssik", "toppra", "vamp"),
    },
    "app/api": {
        *("fastapi", "starlette", "pydantic", "pydantic_core", "msgspec", "numpy", "kin"),
        *("app.api", "app.classroom", "app.equations", "app.exports", "app.live", "app.shared"),
    },
    "app/viewer": {
        *("viser", "trimesh", "numpy", "jinja2", "markupsafe", "kin"),
        *(
            "app.viewer",
            "app.classroom",
            "app.equations",
            "app.exercises",
            "app.exports",
            "app.live",
            "app.shared",
        ),
    },
    "app/viewer/viser_names.py": {"app.shared.private_names"},
    "app/viewer/viser_patches.py": {"msgspec", "numpy", "viser", "app.viewer.viser_names", "kin.transforms"},
    "app/viewer/viser_outbox.py": {
        "msgspec",
        "viser",
        "zstandard",
        "app.shared.connection",
        "app.viewer.viser_names",
    },
    "app/viewer/meshes": {
        *("fast_simplification", "trimesh", "numpy", "kin", "app.shared", "app.viewer.meshes", "app.viewer.scene"),
        "app.viewer.own_arm",
    },
    # The process that parses meshes starts without the core, which would take it a second.
    "app/viewer/meshes/archive.py": set(),
    "app/viewer/meshes/child.py": {"app.shared.threads.confined", "app.viewer.meshes"},
    "app/viewer/meshes/loading.py": {"fast_simplification", "trimesh", "numpy", "app.viewer.meshes"},
    "app/viewer/meshes/placing.py": {"numpy", "app.viewer.meshes"},
    "app/viewer/meshes/surface.py": {"numpy"},
    "app/service": {
        *("kin", "fastapi", "starlette", "pydantic", "pydantic_core", "uvicorn", "httptools", "websockets"),
        *("app.api", "app.classroom", "app.exercises", "app.live", "app.service", "app.shared", "app.viewer"),
    },
    "app/service/web/rooms": {
        *("kin", "starlette", "jinja2", "segno", "app.api.problems", "app.classroom", "app.service.web.access"),
        *("app.exercises", "app.service.web.rate_limit", "app.service.web.rooms", "app.shared"),
    },
    "app/service/web": {
        *("anyio", "starlette", "msgspec", "itsdangerous", "jinja2", "kin"),
        *("app.api.problems", "app.bench.board", "app.classroom", "app.service.web", "app.shared"),
    },
    "app/service/web/agents.py": {
        *("fastapi", "mcp", "starlette", "app.api.body", "app.mcp", "app.service.web.hosts", "app.shared"),
    },
    "app/servos": {"kin", "numpy", "scservo_sdk", "serial", "app.servos"},
    "app/notebook": {
        *("kin", "numpy", "app.classroom.tokens", "app.live.client", "app.notebook"),
        "app.viewer.session.state",
    },
    "app/notebook/child.py": {"app.live", "app.service.main", "app.shared.settings", "app.viewer.shown"},
    "app/cli": {
        "kin",
        "numpy",
        "pyarrow",
        "pydantic",
        "typing_extensions",
        "app.classroom",
        "app.cli",
        "app.exercises",
        "app.exports",
        "app.shared",
    },
    "app/cli/parser.py": {"kin", "app.cli"},
    "app/cli/arguments/completion.py": {"kin", "shtab"},
    "app/cli/arguments": {"app.cli.arguments", "app.shared.options"},
    "app/cli/bodies.py": {"kin", "app.viewer.meshes"},
    "app/cli/page.py": {"kin", "app.cli", "app.exports", "app.viewer.scene.bodies", "app.viewer.takehome"},
    "app/cli/classroom": {"kin", "app.classroom", "app.cli", "app.exercises", "app.shared"},
    "app/cli/classroom/lessons.py": {"kin", "app.cli", "app.exercises", "app.viewer.lessons"},
    "app/cli/classroom/arguments.py": set(),
    "app/cli/xacro": {"kin", "app.cli.xacro"},
    "app/cli/xacro/expansion.py": {"xacro", "xacrodoc", "yaml", "app.shared.threads.confined", "app.cli.xacro"},
    "app/cli/xacro/expressions.py": {"xacro"},
    "app/cli/startup.py": set(),
    # Programs that users copy: what they need of Kinboard is public.
    "examples": {
        "kin",
        "numpy",
        "connecting",
        "recording",
        "mujoco",
        "roslibpy",
    },
    "app/cli/serve.py": {"pydantic", "app.cli.startup", "app.mcp", "app.service.main", "app.shared"},
    "app/servos/command.py": {
        *("kin", "app.live", "app.notebook.process", "app.servos", "app.viewer.session.state"),
    },
    "app/cli/open.py": {
        *("app.classroom.tokens", "app.cli", "app.live", "app.servos.command", "app.viewer.session.state"),
    },
}

MODULES = sorted(
    path.relative_to(ROOT).as_posix()
    for package in ("kin", "app", "examples")
    for path in (ROOT / package).rglob("*.py")
)


NEIGHBOURS = ("kin.comparison", "kin.doctor", "kin.motors")


def imports(source: str) -> set[str]:
    """Every module a source imports, at the top or inside a function, as dotted names."""
    found: set[str] = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"line {node.lineno}: relative imports hide which module is meant"
            # `from app.shared import store` may import the module app.shared.store.
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


@pytest.mark.parametrize(
    "module",
    [
        each
        for each in MODULES
        if each.startswith("kin/")
        and each != "kin/__init__.py"
        and not each.replace("/", ".").startswith(NEIGHBOURS)
    ],
)
def test_nothing_in_the_core_imports_its_neighbours(module):
    """Comparing arms, readings of motors and the doctor of URDFs are made of the core, and no part of it."""
    found = imports((ROOT / module).read_text(encoding="utf-8"))
    assert not {name for name in found if name.startswith(NEIGHBOURS)}


@pytest.mark.parametrize("row", RULES)
def test_every_row_of_the_table_has_its_module(row):
    assert (ROOT / row).exists()


@pytest.mark.parametrize(
    ("module", "source"),
    [
        ("kin/fk.py", "from app.shared.store import Store"),
        ("kin/solvers/new.py", "import scipy"),
        ("kin/kernels/fk.py", "from kin.robot import Robot"),
        ("app/viewer/scene.py", "import fastapi"),
        ("app/viewer/panel/new.py", "def late():\n    from app.api.schemas import Pose"),
        ("app/viewer/new.py", "from app import api"),
        ("app/api/routes.py", "import viser"),
        ("app/api/routes.py", "from app.viewer.server import ViewerServer"),
        ("app/cli/fk.py", "from app.viewer import server"),
        ("app/service/web/viewer_proxy.py", "import viser"),
        ("kin/solvers/srs7/batch.py", "from kin.ik.results import IKResult"),
        ("kin/ik/problem.py", "from kin.path import solve_path"),
        ("app/shared/store.py", "from app.api import schemas"),
        ("app/bench/run.py", "import pinocchio"),
        ("app/shared/new.py", "import requests"),
        ("app/exercises/kinds/new.py", "from app.viewer.feature import Feature"),
        ("app/exercises/new.py", "from app.shared.store import Store"),
    ],
)
def test_the_table_has_teeth(module, source):
    assert breaches(module, source)


def test_what_is_allowed_passes():
    assert not breaches("app/service/main.py", "import json\nfrom app.api import api_routes\nimport uvicorn")
    assert not breaches("kin/fk.py", "import numpy as np\nfrom kin import kernels")
