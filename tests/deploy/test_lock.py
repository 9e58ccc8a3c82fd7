"""The exact dependencies of the image against what pyproject.toml asks for; `sh scripts/lock.sh` renews them."""

from __future__ import annotations

import importlib.metadata
import re
import tomllib
from pathlib import Path

import pytest
from packaging.markers import default_environment
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).parents[2]
DOCKERFILE = (ROOT / "Dockerfile").read_text(encoding="utf-8")
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
PYTHON = re.search(r"^ARG BASE=\S*python:(\d+\.\d+)-slim", DOCKERFILE, re.MULTILINE).group(1)
WANTED = {
    "requirements.lock": PROJECT["project"]["dependencies"],
    "requirements-build.lock": PROJECT["build-system"]["requires"],
}
LOCKS = list(WANTED)
MACHINES = ["x86_64", "aarch64"]


def entries(lock: str) -> list[str]:
    """One string per package: requirement, marker, hashes."""
    text = (ROOT / lock).read_text(encoding="utf-8")
    return [line for line in text.replace("\\\n", " ").splitlines() if line.strip() and not line.startswith("#")]


def requirements(lock: str) -> list[Requirement]:
    return [Requirement(entry.split("--hash")[0].strip()) for entry in entries(lock)]


def image_environment(machine: str) -> dict[str, str]:
    return {
        **default_environment(),
        "python_version": PYTHON,
        "python_full_version": f"{PYTHON}.0",
        "platform_machine": machine,
        "platform_system": "Linux",
        "sys_platform": "linux",
        "os_name": "posix",
    }


def applies(requirement: Requirement, machine: str) -> bool:
    return requirement.marker is None or requirement.marker.evaluate(image_environment(machine))


def pinned(lock: str, machine: str) -> dict[str, str]:
    """Package to version, as pip in the image reads it."""
    found = [requirement for requirement in requirements(lock) if applies(requirement, machine)]
    versions = {canonicalize_name(r.name): next(iter(r.specifier)).version for r in found}
    assert len(versions) == len(found), "a package is pinned twice"
    return versions


@pytest.mark.parametrize("lock", LOCKS)
def test_every_line_is_one_version_with_hashes(lock):
    assert entries(lock)
    for entry, requirement in zip(entries(lock), requirements(lock), strict=True):
        assert [specifier.operator for specifier in requirement.specifier] == ["=="], entry
        assert re.findall(r"--hash=sha256:[0-9a-f]{64}(?=\s|$)", entry), entry
        assert requirement.url is None


@pytest.mark.parametrize("machine", MACHINES)
@pytest.mark.parametrize("lock", LOCKS)
def test_everything_asked_for_is_pinned_inside_its_range(lock, machine):
    versions = pinned(lock, machine)
    for wanted in map(Requirement, WANTED[lock]):
        if applies(wanted, machine):
            name = canonicalize_name(wanted.name)
            assert name in versions, f"{name} is missing: sh scripts/lock.sh"
            assert wanted.specifier.contains(versions[name]), (
                f"{wanted}, pinned {versions[name]}: sh scripts/lock.sh"
            )


def test_what_the_pinned_packages_need_is_pinned_too():
    """By the metadata of those installed here in the very same version."""
    versions = pinned("requirements.lock", "x86_64")
    looked_at = 0
    for name, version in versions.items():
        try:
            here = importlib.metadata.distribution(name)
        except importlib.metadata.PackageNotFoundError:
            continue
        if here.version != version:
            continue
        looked_at += 1
        for text in here.requires or ():
            needed = Requirement(text)
            environment = {**image_environment("x86_64"), "extra": ""}
            if needed.marker is None or needed.marker.evaluate(environment):
                assert needed.specifier.contains(versions[canonicalize_name(needed.name)]), (
                    f"{name} needs {needed}"
                )
    assert looked_at > 0


def test_the_image_installs_only_what_is_pinned():
    installs = re.findall(r"pip --python [^&\n]*", DOCKERFILE)
    assert len(installs) == 3
    options = re.search(r'install="(install .*)"', DOCKERFILE).group(1)
    assert "--require-hashes" in options
    assert "--only-binary :all:" in options
    for command in installs:
        assert "$install -r requirements" in command or "--no-deps --no-index" in command, command
    for lock in LOCKS:
        assert f"-r {lock}" in DOCKERFILE
