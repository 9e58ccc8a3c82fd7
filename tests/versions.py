"""What the tests leave out on some versions of Python."""

from __future__ import annotations

import sys

import pytest

# `tests/deploy/test_find_python.py` fails if pyproject.toml asks for ompl on other versions.
needs_ompl = pytest.mark.skipif(sys.version_info >= (3, 14), reason="ompl has no wheels for Python 3.14")
