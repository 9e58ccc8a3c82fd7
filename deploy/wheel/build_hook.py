"""Hatchling's build hook: the service is installed as ``kinboard``, its kernels as an extension.

A wheel gets the renamed package, the static files, the pages of the documentation, and the kernels, compiled for
this machine or for what KINBOARD_TARGET names: a system and its levels of processors, as
`kin.codegen.extension.build` calls them. An editable installation uses the checkout, where the package is called
``app``; there ``kinboard`` is another name of it. Its kernels are compiled into the user's cache folder, and by an
import again when they have changed.

With KINBOARD_KERNELS=python nothing is compiled.
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
LOADED = "from kin.kernels.ahead import entries; entries()"
WITHOUT = "with KINBOARD_KERNELS=python, here and where it runs, they are plain Python, a thousand times slower"
# Where an extension for a system may be installed, by the first word of its levels.
PLATFORMS = {
    "linux-gnu.2.17": {"x86": "manylinux_2_17_x86_64", "aarch64": "manylinux_2_17_aarch64"},
    "macos.11.0": {"x86": "macosx_11_0_x86_64", "aarch64": "macosx_11_0_arm64"},
    "windows-gnu": {"x86": "win_amd64", "aarch64": "win_arm64"},
}


class WheelHook(BuildHookInterface):
    """Adds the package ``kinboard`` and the kernels to a wheel."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        self._folder = tempfile.TemporaryDirectory(prefix="kinboard-wheel-")
        package = Path(self._folder.name) / INSTALLED
        root = Path(self.root)
        compiled = os.environ.get("KINBOARD_KERNELS") != "python"
        if version == "editable":
            package.mkdir()
            (package / "__init__.py").write_text(ALIAS, "utf-8")
            build_data["force_include_editable"][str(package)] = INSTALLED
            if compiled:
                self._run("c", "-c", LOADED)
        else:
            write_renamed(root / SOURCE, package)
            build_data["force_include"][str(package)] = INSTALLED
            build_data["force_include"][str(root / "static")] = f"{INSTALLED}/_static"
            for page in (root / "docs").glob("*.md"):  # agents read them
                build_data["force_include"][str(page)] = f"{INSTALLED}/_docs/{page.name}"
            if compiled:
                self._add_kernels(build_data)

    def _add_kernels(self, build_data: dict[str, Any]) -> None:
        target = os.environ.get("KINBOARD_TARGET", "")
        system, *levels = target.split() or [""]
        if system and (system not in PLATFORMS or not levels):
            wanted = f"a system ({', '.join(PLATFORMS)}) and one or more levels of its processors"
            raise ValueError(f"KINBOARD_TARGET={target}: it is {wanted}, as linux-gnu.2.17 x86_64_v2 x86_64_v3")
        platform = re.sub(r"\W", "_", sysconfig.get_platform())
        for level in levels or [""]:
            options = ["--system", system, "--level", level] if level else []
            file = Path(self._run("python", "-m", BUILDER, str(Path(self._folder.name) / "kernels"), *options))
            build_data["force_include"][str(file)] = f"kin/{file.name}"
            platform = PLATFORMS[system][level.split("_")[0]] if level else platform
            if sys.platform == "darwin" and not level:  # Python's own may be for both processors
                platform = next(name for word, name in PLATFORMS["macos.11.0"].items() if f"_{word}" in file.name)
        build_data["pure_python"], build_data["tag"] = False, f"cp311-abi3-{platform}"

    def _run(self, kernels: str, *words: str) -> str:
        """What Python prints where kernels are these; what is being compiled goes to the standard error."""
        paths = [str(self.root), *filter(None, [os.environ.get("PYTHONPATH")])]  # pip has what is required there
        environment = os.environ | {"KINBOARD_KERNELS": kernels, "PYTHONPATH": os.pathsep.join(paths)}
        ran = subprocess.run(
            [sys.executable, *words], stdout=subprocess.PIPE, text=True, env=environment, check=False
        )
        if ran.returncode:
            said = ran.stdout.strip() or "kernels cannot be compiled (see above)"
            raise RuntimeError(f"{said}; {WITHOUT}")
        return ran.stdout.strip()

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:
        self._folder.cleanup()
