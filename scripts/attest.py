"""Writes what an image contains (CycloneDX) and what it was built from (SLSA provenance), for scripts/image.sh."""

from __future__ import annotations

import argparse
import json
import re
from datetime import UTC, datetime
from pathlib import Path
from typing import Any
from urllib.parse import quote

SOURCE = "kinboard"

Packages = list[tuple[str, str]]  # name and version


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    for name in ("python", "debian", "to"):
        parser.add_argument(f"--{name}", type=Path, required=True)
    for name in ("release", "version", "base", "revision", "digest"):
        parser.add_argument(f"--{name}", required=True)
    given = parser.parse_args()
    found = bill(given.version, given.release, packages(given.python), packages(given.debian))
    write(given.to / "kinboard.cdx.json", found)
    write(given.to / "kinboard.provenance.json", provenance(given.digest, given.base, given.revision))
    print(f"{len(found['components'])} packages in {given.to / 'kinboard.cdx.json'}")


def packages(file: Path) -> Packages:
    """Pairs of name and version, one a line."""
    pairs = {(name, version) for name, version in (line.split() for line in file.read_text().splitlines())}
    return sorted(pairs)


def bill(
    version: str, release: str, python: list[tuple[str, str]], debian: list[tuple[str, str]]
) -> dict[str, Any]:
    """The software bill of materials, https://cyclonedx.org/docs/1.6/json/."""
    parts = [(name, v, f"pkg:deb/debian/{quote(name)}@{quote(v)}?distro={release}") for name, v in debian]
    named = sorted((re.sub(r"[-_.]+", "-", name).lower(), v) for name, v in python)  # as PyPI compares names
    parts += [(name, v, f"pkg:pypi/{name}@{quote(v)}") for name, v in named]
    return {
        "bomFormat": "CycloneDX",
        "specVersion": "1.6",
        "version": 1,
        "metadata": {
            "timestamp": datetime.now(UTC).isoformat(timespec="seconds"),
            "component": {"type": "container", "name": SOURCE, "version": version},
        },
        "components": [
            {"type": "library", "name": name, "version": v, "purl": purl, "bom-ref": purl}
            for name, v, purl in parts
        ],
    }


def provenance(digest: str, base: str, revision: str) -> dict[str, Any]:
    """Where the image comes from, https://slsa.dev/spec/v1.0/provenance, not signed."""
    name, _, of_base = base.partition("@sha256:")
    return {
        "_type": "https://in-toto.io/Statement/v1",
        "subject": [{"name": SOURCE, "digest": {"sha256": digest.removeprefix("sha256:")}}],
        "predicateType": "https://slsa.dev/provenance/v1",
        "predicate": {
            "buildDefinition": {
                "buildType": "https://github.com/containers/buildah",
                "externalParameters": {"dockerfile": "Dockerfile", "base": name},
                "resolvedDependencies": [
                    {"uri": f"docker://{name}", "digest": {"sha256": of_base}},
                    {"uri": f"pkg:generic/{SOURCE}", "digest": {"gitCommit": revision}},
                ],
            },
            "runDetails": {"builder": {"id": "scripts/image.sh"}},
        },
    }


def write(file: Path, content: dict[str, Any]) -> None:
    file.write_text(json.dumps(content, indent=1) + "\n", "utf-8")


if __name__ == "__main__":
    main()
