"""Profiles of hypothesis: new random examples in every local run, always the same ones in CI.

A test that fails in CI then fails because of a change, not by chance.
"""

from __future__ import annotations

import os

from hypothesis import settings

settings.register_profile("local", deadline=None)
settings.register_profile("ci", deadline=None, derandomize=True)
settings.load_profile("ci" if os.environ.get("CI") else "local")
