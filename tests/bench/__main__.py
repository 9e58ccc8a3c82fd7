"""``python tests/bench`` from a checkout: the same as ``kinboard bench``, with the same options."""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

from app.cli.parser import main

sys.exit(main(["bench", *sys.argv[1:]]))
