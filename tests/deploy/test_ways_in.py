"""Every way to install that docs/running.md names, tried as it is written there, in an empty environment."""

from __future__ import annotations

import json
import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import httpx2
import pytest

pytestmark = pytest.mark.full

ROOT = Path(__file__).parents[2]
SECTION = (
    (ROOT / "docs" / "running.md").read_text(encoding="utf-8").split("## As a package\n")[1].split("\n## ")[0]
)
BUILD, *WAYS = [block.strip() for block in re.findall(r"```sh\n(.*?)```", SECTION, re.DOTALL)]
UNTIL = 300  # seconds until all that is needed has been downloaded


def environment(folder: Path) -> dict[str, str]:
    """That of a user who has the tools and nothing of ours: no checkout, no kernels, no virtual environment."""
    tools = folder / "tools"
    tools.mkdir()
    for name in ("uvx", "uv", "pipx"):
        (tools / name).symlink_to(Path(sys.executable).with_name(name))
    (tools / "python3").symlink_to(Path(sys.base_prefix) / "bin" / "python3")
    ours = ("PYTHON", "VIRTUAL_ENV", "KINBOARD_", "COV_")
    kept = {name: value for name, value in os.environ.items() if not name.startswith(ours)}
    return kept | {
        "PATH": f"{tools}:/usr/local/bin:/usr/bin:/bin",
        "PIPX_HOME": str(folder / "pipx"),
        "UV_PYTHON": str(tools / "python3"),
        "PIP_NO_COMPILE": "1",
        "KINBOARD_PORT": "0",
        **network(),
    }


def network() -> dict[str, str]:
    """The index and the certificate in the settings of pip, for uv, which does not read them."""
    words = [sys.executable, "-m", "pip", "config", "list"]
    listed = subprocess.run(words, check=True, capture_output=True, text=True, timeout=UNTIL).stdout
    of_pip = dict(re.findall(r"^\S*\.([\w-]+)='(.*)'$", listed, re.MULTILINE))
    names = {"index-url": "UV_DEFAULT_INDEX", "cert": "SSL_CERT_FILE"}
    return {ours: of_pip[theirs] for theirs, ours in names.items() if theirs in of_pip}


@pytest.fixture(scope="module")
def dist(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel, made by the command of the page in a copy of the checkout."""
    source = tmp_path_factory.mktemp("checkout") / "kinboard"
    unneeded = shutil.ignore_patterns(".*", "__pycache__", "tests", "docs")
    shutil.copytree(ROOT, source, ignore=unneeded)
    command = f"{sys.executable} -m {BUILD}"
    subprocess.run(command, shell=True, cwd=source, check=True, timeout=UNTIL)
    (wheel,) = (source / "dist").glob("kinboard-*.whl")
    return wheel.parent


def test_the_page_names_three_ways():
    assert [re.match(r"(\w+)", way)[0] for way in WAYS] == ["uvx", "pipx", "python3"]


@pytest.mark.parametrize("way", WAYS, ids=lambda way: way.split()[0])
def test_the_service_starts(way, dist, tmp_path):
    shutil.copytree(dist, tmp_path / "dist")
    process = subprocess.Popen(
        ["sh", "-c", way],
        cwd=tmp_path,
        env=environment(tmp_path),
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        start_new_session=True,
    )
    with process:
        try:
            printed = []
            for line in process.stdout:
                printed.append(line)
                if found := re.search(r"http://\S+:\d+", line):
                    break
            else:
                pytest.fail("".join(printed[-30:]))
            with httpx2.Client(base_url=found[0], trust_env=False, timeout=60) as visitor:
                assert "Kinboard" in visitor.get("/").text
                assert len(visitor.get("/api/v1/robots").json()["robots"]) > 40
        finally:
            os.killpg(process.pid, signal.SIGKILL)


def test_the_command_works_with_every_python_that_is_found(dist, tmp_path):
    surroundings = environment(tmp_path)
    words = ["uv", "python", "list", "--only-installed", "--output-format", "json"]
    listed = subprocess.run(words, env=surroundings, check=True, capture_output=True, text=True, timeout=UNTIL)
    pythons = {
        (each["version_parts"]["major"], each["version_parts"]["minor"]): each["path"]
        for each in json.loads(listed.stdout)
        if each["implementation"] == "cpython"
    }
    for path in sorted(Path.home().glob(".pyenv/versions/3.*/bin/python3")):  # uv sees those that are switched on
        version = re.match(r"3\.(\d+)", path.parents[1].name)
        pythons.setdefault((3, int(version[1])), str(path))
    supported = [path for version, path in sorted(pythons.items()) if (3, 11) <= version < (3, 14)]
    assert supported
    (wheel,) = dist.iterdir()
    for python in supported:
        words = shlex.split(f"uvx --python {python} --from {wheel} kinboard fk planar2r 0 90")
        done = subprocess.run(words, env=surroundings, cwd=tmp_path, capture_output=True, text=True, timeout=UNTIL)
        assert done.returncode == 0, f"{python}: {done.stderr}"
        assert re.search(r"tool +1000\.000 +600\.000", done.stdout), f"{python}: {done.stdout}"
