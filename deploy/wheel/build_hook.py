"""Hatchling's build hook: the service is installed as ``kinboard``.

A wheel gets the renamed package, the static files and the pages of the documentation. An editable installation
uses the checkout, where the package is called ``app``; there ``kinboard`` is another name of it.

With KINBOARD_KERNELS=c a wheel also gets the kernels as an extension, compiled for this machine, or for what
KINBOARD_TARGET names: a system and its levels of processors, as `kin.codegen.extension.build` calls them.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import sysconfig
import tempfile
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

sys.path.insert(0, str(Path(__file__).parent))
from renaming import INSTALLED, SOURCE, write_renamed

ALIAS = f'''"""In an editable installation: the folder {SOURCE} of the checkout."""

import sys

import {SOURCE}

sys.modules[__name__] = {SOURCE}
'''


BUILDER = "kin.codegen.extension.build"
# Where an extension for a system may be installed, by the first word of its levels.
PLATFORMS = {
    "linux-gnu.2.17": {"x86": "manylinux_2_17_x86_64", "aarch64": "manylinux_2_17_aarch64"},
    "macos.11.0": {"x86": "macosx_11_0_x86_64", "aarch64": "macosx_11_0_arm64"},
    "windows-gnu": {"x86": "win_amd64", "aarch64": "win_arm64"},
}


class WheelHook(BuildHookInterface):
    """Adds the package ``kinboard`` to a wheel, and the kernels if they are asked for."""

    def dependencies(self) -> list[str]:
        """What compiling the kernels needs."""
        needed = ["numpy>=2.0,<3", "tomli-w>=1.2,<2", "ziglang>=0.17,<0.18"]
        return needed if os.environ.get("KINBOARD_KERNELS") == "c" else []

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        self._folder = tempfile.TemporaryDirectory(prefix="kinboard-wheel-")
        package = Path(self._folder.name) / INSTALLED
        root = Path(self.root)
        if version == "editable":
            package.mkdir()
            (package / "__init__.py").write_text(ALIAS, "utf-8")
            build_data["force_include_editable"][str(package)] = INSTALLED
        else:
            write_renamed(root / SOURCE, package)
            build_data["force_include"][str(package)] = INSTALLED
            build_data["force_include"][str(root / "static")] = f"{INSTALLED}/_static"
            for page in (root / "docs").glob("*.md"):  # agents read them
                build_data["force_include"][str(page)] = f"{INSTALLED}/_docs/{page.name}"
            if os.environ.get("KINBOARD_KERNELS") == "c":
                self._add_kernels(root, build_data)

    def _add_kernels(self, root: Path, build_data: dict[str, Any]) -> None:
        target = os.environ.get("KINBOARD_TARGET", "")
        system, *levels = target.split() or [""]
        if system and (system not in PLATFORMS or not levels):
            wanted = f"a system ({', '.join(PLATFORMS)}) and one or more levels of its processors"
            raise ValueError(f"KINBOARD_TARGET={target}: it is {wanted}, as linux-gnu.2.17 x86_64_v2 x86_64_v3")
        platform = re.sub(r"\W", "_", sysconfig.get_platform())
        for level in levels or [""]:
            options = ["--system", system, "--level", level] if level else []
            command = [sys.executable, "-m", BUILDER, str(Path(self._folder.name) / "kernels"), *options]
            environment = os.environ | {"KINBOARD_KERNELS": "python", "PYTHONPATH": str(root)}
            built = subprocess.run(command, stdout=subprocess.PIPE, text=True, env=environment, check=True)
            file = Path(built.stdout.strip())
            build_data["force_include"][str(file)] = f"kin/{file.name}"
            platform = PLATFORMS[system][level.split("_")[0]] if level else platform
        build_data["pure_python"], build_data["tag"] = False, f"cp311-abi3-{platform}"

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:
        self._folder.cleanup()
