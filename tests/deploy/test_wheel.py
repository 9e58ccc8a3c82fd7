"""What is installed: one package for the service with a name that nobody else has."""

from __future__ import annotations

import ast
import contextlib
import os
import re
import subprocess
import sys
import sysconfig
import types
import venv
import zipfile
from collections.abc import Iterator
from pathlib import Path

import httpx2
import pytest

import app
import kin

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "deploy" / "wheel"))
from renaming import renamed, write_renamed  # noqa: E402

pytestmark = pytest.mark.full

FOREIGN = 'raise ImportError("the package app of another project")\n'


def imported(text: str) -> set[str]:
    """The top-level names of all modules that a source imports."""
    found: set[str] = set()
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            found |= {name.name.split(".")[0] for name in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            found.add(node.module.split(".")[0])
    return found


def test_no_module_of_the_installed_package_imports_the_name_of_the_folder(tmp_path):
    write_renamed(ROOT / "app", tmp_path / "kinboard")
    for file in sorted((ROOT / "app").rglob("*")):
        if file.is_file() and "__pycache__" not in file.parts:
            copy = tmp_path / "kinboard" / file.relative_to(ROOT / "app")
            if file.suffix != ".py":
                assert copy.read_bytes() == file.read_bytes()
                continue
            before, after = imported(file.read_text("utf-8")), imported(copy.read_text("utf-8"))
            assert after == {"kinboard" if name == "app" else name for name in before}, file
    assert (tmp_path / "kinboard" / "py.typed").exists()


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("from app.api import routes", "from kinboard.api import routes"),
        ("from app import api", "from kinboard import api"),
        ("import app.api as api, os", "import kinboard.api as api, os"),
        ("def f():\n    'é'; from app.a import app", "def f():\n    'é'; from kinboard.a import app"),
        ("from  app.a import (\n    app,\n)", "from  kinboard.a import (\n    app,\n)"),
        ("from application import app\napp.run()", "from application import app\napp.run()"),
        ("from .app import x", "from .app import x"),
        ("title = 'app'", "title = 'app'"),
    ],
)
def test_imports_are_renamed_and_nothing_else(before, after):
    assert renamed(before) == after


@pytest.mark.parametrize("text", ["import app.api", "import app", "importlib.import_module('app.api.fk')"])
def test_what_cannot_be_renamed_is_refused(text):
    with pytest.raises(ValueError, match="line 1: "):
        renamed(text)


def test_the_package_offers_the_public_names_of_the_core():
    assert app.__all__ == kin.__all__
    for name in kin.__all__:
        assert getattr(app, name) is getattr(kin, name)
    assert set(kin.__all__) <= set(dir(app))
    rooms = {path.parent.name for path in (ROOT / "app").glob("*/__init__.py")}
    assert not rooms & set(kin.__all__), "a room of the service would hide a name of the core"
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        _ = app.nothing


# -- a real wheel in a real environment -------------------------------------------------------------------------


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("wheel")
    pip("wheel", "--no-deps", "--wheel-dir", str(folder), str(ROOT))
    (built,) = folder.glob("kinboard-*.whl")
    return built


def installed_alone(folder: Path, *what: str) -> Path:
    """Make a virtual environment with a package and nothing else; returns its folder of packages."""
    venv.create(folder)
    pip("--python", str(folder / "bin" / "python"), "install", "--no-deps", *what)
    return Path(sysconfig.get_path("purelib", "venv", {"base": str(folder), "platbase": str(folder)}))


def installed(folder: Path, *what: str) -> Path:
    """The same with our dependencies."""
    packages = installed_alone(folder, *what)
    (packages / "z-dependencies.pth").write_text(sysconfig.get_path("purelib") + "\n")  # after a checkout
    return packages


@pytest.fixture(scope="module")
def environment(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An environment with the wheel and another project's package `app`."""
    folder = tmp_path_factory.mktemp("environment")
    packages = installed(folder, "--no-index", str(wheel))
    (packages / "app").mkdir()
    (packages / "app" / "__init__.py").write_text(FOREIGN)
    return folder


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """The folder of another project, with a package `app`, in which our command is called."""
    (tmp_path / "app").mkdir()
    (tmp_path / "app" / "__init__.py").write_text(FOREIGN)
    return tmp_path


def pip(*words: str) -> None:
    subprocess.run([sys.executable, "-m", "pip", "-q", *words], check=True, timeout=300)


def run(environment: Path, project: Path, *words: str) -> str:
    done = subprocess.run(
        [environment / "bin" / words[0], *words[1:]],
        cwd=project,
        env=os.environ | {"PYTHONPATH": "."},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


@pytest.mark.slow
def test_the_wheel_has_two_packages_and_no_other_names(wheel):
    names = {name.split("/")[0] for name in zipfile.ZipFile(wheel).namelist()}
    assert names == {"kin", "kinboard", f"kinboard-{kin.__version__}.dist-info"}
    inside = set(zipfile.ZipFile(wheel).namelist())
    assert {
        "kinboard/_static/index.html",
        "kinboard/py.typed",
        "kinboard/viewer/views/templates/macros.html",
    } <= inside


@pytest.mark.slow
def test_the_command_works_beside_a_foreign_package_app(environment, project):
    assert run(environment, project, "kinboard", "--version") == f"kinboard {kin.__version__}"
    assert "mm" in run(environment, project, "kinboard", "fk", "pioneer5", "90", "30", "60", "30", "30")
    assert run(environment, project, "python", "-m", "kinboard.cli", "--version") == f"kinboard {kin.__version__}"
    program = "import kinboard, kin; from kinboard import *; print(kinboard.fk is kin.fk is fk, kinboard.__file__)"
    same, where = run(environment, project, "python", "-c", program).split()
    assert same == "True"
    assert where.startswith(str(environment))


@pytest.mark.slow
def test_the_core_works_with_numpy_alone(wheel, tmp_path, project):
    packages = installed_alone(tmp_path / "environment", "--no-index", str(wheel))
    for each in Path(sysconfig.get_path("purelib")).iterdir():
        if re.match(r"numpy\b", each.name):
            (packages / each.name).symlink_to(each)
    program = "import kin; print(kin.fk('planar2r', [0.0, 0.0])[0, 3].round(9))"
    assert run(tmp_path / "environment", project, "python", "-c", program) == "1.6"


@pytest.mark.slow
def test_an_editable_installation_uses_the_checkout(tmp_path):
    installed(tmp_path / "environment", "--editable", str(ROOT))
    (tmp_path / "empty").mkdir()
    environment, elsewhere = tmp_path / "environment", tmp_path / "empty"
    assert run(environment, elsewhere, "kinboard", "--version") == f"kinboard {kin.__version__}"
    program = "import kinboard, app, kin; print(kinboard is app, kinboard.fk is kin.fk, app.__file__)"
    assert run(environment, elsewhere, "python", "-c", program) == f"True True {ROOT / 'app' / '__init__.py'}"


@pytest.mark.slow
def test_the_service_starts_beside_a_foreign_package_app(environment, project):
    with (
        serving(environment, project) as base,
        httpx2.Client(base_url=base, trust_env=False, timeout=30) as visitor,
    ):
        assert visitor.get("/").status_code == 200
        assert visitor.get("/static/landing.css").status_code == 200
        assert visitor.get("/api/v1/robots").json()
        page = visitor.get("/viewer/")
        while page.status_code == 503:  # viser is being imported
            page = visitor.get("/viewer/")
        assert "Kinboard viewer" in page.text
        assert visitor.get("/readyz").json()["status"] != "failed"


@contextlib.contextmanager
def serving(environment: Path, project: Path) -> Iterator[str]:
    with subprocess.Popen(
        [environment / "bin" / "kinboard", "serve", "--port", "0"],
        cwd=project,
        env=os.environ | {"PYTHONPATH": "."},
        stdout=subprocess.PIPE,
        text=True,
    ) as process:
        try:
            found = re.search(r"http://\S+:\d+", process.stdout.readline())
            assert found
            yield found[0]
        finally:
            process.kill()


@pytest.fixture
def hook(tmp_path, monkeypatch):
    """The build hook, without hatchling, which only calls it, and with files in place of extensions."""
    interface = types.ModuleType("hatchling.builders.hooks.plugin.interface")
    interface.BuildHookInterface = object
    monkeypatch.setitem(sys.modules, interface.__name__, interface)
    monkeypatch.delenv("KINBOARD_KERNELS", raising=False)
    monkeypatch.delenv("KINBOARD_TARGET", raising=False)
    import build_hook

    ran = []

    def run(command, env, **options):
        ran.append((env["KINBOARD_KERNELS"], *command[1:3]))
        given = dict(zip(command[4::2], command[5::2], strict=True))
        name = f"_kernels_{given.get('--level', 'own')}.{given.get('--system', 'own')}"
        return types.SimpleNamespace(stdout=f"{tmp_path / name}\n", returncode=0)

    monkeypatch.setattr(build_hook.subprocess, "run", run)
    monkeypatch.setattr(build_hook, "write_renamed", lambda source, target: None)
    made = build_hook.WheelHook()
    made.root, made.ran = str(ROOT), ran
    return made


@pytest.mark.parametrize(
    ("target", "files", "platform"),
    [
        ("", ["_kernels_own.own"], re.sub(r"\W", "_", sysconfig.get_platform())),
        (
            "linux-gnu.2.17 x86_64_v2 x86_64_v3",
            ["_kernels_x86_64_v2.linux-gnu.2.17", "_kernels_x86_64_v3.linux-gnu.2.17"],
            "manylinux_2_17_x86_64",
        ),
        ("macos.11.0 aarch64", ["_kernels_aarch64.macos.11.0"], "macosx_11_0_arm64"),
    ],
)
def test_kernels_are_compiled_for_what_is_named(hook, monkeypatch, target, files, platform):
    monkeypatch.setenv("KINBOARD_TARGET", target)
    data = {"force_include": {}}
    hook.initialize("standard", data)
    hook.finalize("standard", data, "")
    assert [Path(place).name for place in data["force_include"].values() if place.startswith("kin/")] == files
    assert (data["tag"], data["pure_python"]) == (f"cp311-abi3-{platform}", False)


@pytest.mark.parametrize("target", ["windows-gnu", "x86_64_v3", "linux x86_64_v3"])
def test_a_target_without_a_system_or_a_level_is_refused(hook, monkeypatch, target):
    """They would be compiled for this machine, or for nothing."""
    monkeypatch.setenv("KINBOARD_TARGET", target)
    with pytest.raises(ValueError, match=f"KINBOARD_TARGET={target}: it is a system .*macos.* level"):
        hook.initialize("standard", {"force_include": {}})
    hook.finalize("standard", {}, "")


def test_an_editable_installation_compiles_kernels_where_an_import_finds_them(hook, monkeypatch):
    hook.initialize("editable", {"force_include_editable": {}})
    hook.finalize("editable", {}, "")
    ((kernels, _, program),) = hook.ran
    assert kernels == "c"
    monkeypatch.undo()
    subprocess.run([sys.executable, "-c", program], cwd=ROOT, check=True)


@pytest.mark.parametrize("version", ["standard", "editable"])
def test_nothing_is_compiled_where_kernels_are_plain_python(hook, monkeypatch, version):
    monkeypatch.setenv("KINBOARD_KERNELS", "python")
    data = {"force_include": {}, "force_include_editable": {}}
    hook.initialize(version, data)
    hook.finalize(version, data, "")
    assert hook.ran == []
    assert "tag" not in data
    assert not any(place.startswith("kin/") for place in data["force_include"].values())


@pytest.mark.parametrize("version", ["standard", "editable"])
def test_where_kernels_cannot_be_compiled_the_installation_says_what_to_set(hook, monkeypatch, version):
    failed = types.SimpleNamespace(returncode=1, stdout="")
    monkeypatch.setattr(sys.modules["build_hook"].subprocess, "run", lambda *_, **__: failed)
    with pytest.raises(RuntimeError, match=r"cannot be compiled .*KINBOARD_KERNELS=python"):
        hook.initialize(version, {"force_include": {}, "force_include_editable": {}})
    hook.finalize(version, {}, "")
