#!/bin/sh
# Set everything up in .venv, then run every check. Arguments go to pytest, e.g. tests/kin, or -m browser.
set -eu
root=$(cd "$(dirname "$0")/.." && pwd)
. "$root/scripts/venv.sh"
install_kinboard "[test]"
if [ ! -x "${KINBOARD_TEST_CHROMIUM:-/usr/bin/chromium}" ]; then
  apt_install chromium || fail "the browser tests need Chromium. On Debian: sudo apt-get install chromium"
fi
cd "$root"
PATH="$root/.venv/bin:$PATH"
ruff check .
ruff format --check .
mypy
pytest "$@"
