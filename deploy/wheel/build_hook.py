"""Hatchling's build hook: the service is installed as ``kinboard``.

A wheel gets the renamed package and the static files. An editable installation uses the checkout, where the
package is called ``app``; there ``kinboard`` is another name of it.
"""

from __future__ import annotations

import sys
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


class WheelHook(BuildHookInterface):
    """Adds the package ``kinboard`` to a wheel."""

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

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:
        self._folder.cleanup()
