"""What can be said of the image without building it; `sh scripts/image.sh` builds and visits it."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from kin.codegen.extension.build import LEVELS

pytestmark = pytest.mark.full

ROOT = Path(__file__).parents[2]
DOCKERFILE = (ROOT / "Dockerfile").read_text(encoding="utf-8")
COMPOSE = (ROOT / "compose.yaml").read_text(encoding="utf-8")


def test_the_image_has_kernels_for_all_processors_of_its_kind() -> None:
    names = {level for level in LEVELS if level.startswith("x86")}
    assert set(re.findall(r"\bx86_64_v\d", DOCKERFILE)) == names


def test_the_image_is_prepared_by_the_program_it_contains() -> None:
    folder = re.search(r"^COPY deploy/image (\S+)$", DOCKERFILE, re.MULTILINE).group(1)
    assert f"python {folder}/prepare.py" in DOCKERFILE


def test_both_stages_have_the_same_base_and_the_label_names_it() -> None:
    assert set(re.findall(r"^FROM (\S+)", DOCKERFILE, re.MULTILINE)) == {"${BASE}"}
    assert "image.base.name=$BASE" in DOCKERFILE


def test_packages_of_the_distribution_are_pinned() -> None:
    (packages,) = re.findall(r"apt-get install (.+)", DOCKERFILE)
    named = [word for word in packages.split() if not word.startswith("-")]
    assert named
    assert all(re.fullmatch(r"[a-z0-9.+-]+=\S+", word) for word in named)


def test_what_an_image_contains_and_was_built_from_is_written_down(tmp_path: Path) -> None:
    (tmp_path / "python.txt").write_text("kinboard 0.2.0\nTyping_Extensions 4.15.0\n")
    (tmp_path / "debian.txt").write_text("libc6 2.41-12\nlibstdc++6 14.2.0-19\n")
    digest, base = f"sha256:{'a' * 64}", f"docker.io/library/python:3.13-slim-trixie@sha256:{'b' * 64}"
    words = ("--python", tmp_path / "python.txt", "--debian", tmp_path / "debian.txt", "--release", "trixie")
    words += ("--version", "0.2.0", "--base", base, "--revision", "c" * 40, "--digest", digest, "--to", tmp_path)
    subprocess.run([sys.executable, ROOT / "scripts" / "attest.py", *words], check=True, capture_output=True)
    bill = json.loads((tmp_path / "kinboard.cdx.json").read_text())
    assert (bill["bomFormat"], bill["specVersion"]) == ("CycloneDX", "1.6")
    assert [part["purl"] for part in bill["components"]] == [
        "pkg:deb/debian/libc6@2.41-12?distro=trixie",
        "pkg:deb/debian/libstdc%2B%2B6@14.2.0-19?distro=trixie",
        "pkg:pypi/kinboard@0.2.0",
        "pkg:pypi/typing-extensions@4.15.0",
    ]
    origin = json.loads((tmp_path / "kinboard.provenance.json").read_text())
    assert origin["predicateType"] == "https://slsa.dev/provenance/v1"
    assert origin["subject"] == [{"name": "kinboard", "digest": {"sha256": "a" * 64}}]
    (base_found, source) = origin["predicate"]["buildDefinition"]["resolvedDependencies"]
    assert base_found["digest"] == {"sha256": "b" * 64}
    assert source["digest"] == {"gitCommit": "c" * 40}


def test_the_health_check_asks_the_port_and_tells_by_its_exit_code() -> None:
    """Nobody listens: it must fail, and because of that."""
    program = re.search(r'CMD \["python", "-ISc", "(.+)"\]', DOCKERFILE).group(1)
    done = subprocess.run(
        [sys.executable, "-ISc", program],
        env={**os.environ, "KINBOARD_PORT": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 1
    assert "ConnectionRefusedError" in done.stderr


@pytest.mark.parametrize(
    "line",
    [
        "read_only: true",
        "cap_drop:\n      - ALL",
        "no-new-privileges:true",
        'cpus: "2"',
        "memory: 2560m",
        "pids: 512",
        '"127.0.0.1:8000:8000"',
    ],
)
def test_compose_keeps_the_container_small_and_to_itself(line: str) -> None:
    assert line in COMPOSE


def test_https_of_compose_is_trusted_by_its_network_alone() -> None:
    overlay = yaml.safe_load((ROOT / "deploy" / "compose.https.yaml").read_text(encoding="utf-8"))
    (pool,) = overlay["networks"]["default"]["ipam"]["config"]
    trusted = json.loads(overlay["services"]["kinboard"]["environment"]["KINBOARD_TRUSTED_PROXIES"])
    assert trusted == [pool["subnet"]]
    ports = overlay["services"]["https"]["ports"]
    assert ports == ["80:80", "443:443"]
    mounted = overlay["services"]["https"]["volumes"][0].split(":")[0]
    assert (ROOT / mounted).is_file()
