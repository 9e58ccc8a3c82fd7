#!/bin/sh
# Set everything up in .venv, then run every check. Arguments go to pytest, e.g. tests/kin, or -m browser.
set -eu
root=$(cd "$(dirname "$0")/.." && pwd)
. "$root/scripts/venv.sh"
unset PYTHONDONTWRITEBYTECODE # hundreds of processes are started, each of which would compile all it imports
install_kinboard "[test]"
if [ ! -x "${KINBOARD_TEST_CHROMIUM:-/usr/bin/chromium}" ]; then
  apt_install chromium || fail "the browser tests need Chromium. On Debian: sudo apt-get install chromium"
fi
PATH="$root/.venv/bin:$root/.venv/debian/usr/sbin:$root/.venv/debian/usr/bin:$PATH:/usr/sbin"
for proxy in nginx caddy; do
  command -v $proxy >/dev/null || apt_unpack $proxy || fail "the tests of deploy/ need $proxy in the PATH"
done
cd "$root"
if [ $# -eq 0 ]; then
  # Kernels are compiled beside the checks of the code; two rows of tests would both compile the same ones.
  python -c 'import kin; kin.warm_up(); kin.warm_up_rest()' &
  compiling=$!
fi
ruff check .
ruff format --check .
mypy
if [ $# -gt 0 ]; then
  exec pytest "$@"
fi
wait $compiling
# Four at a time, as they often wait; but what draws pictures or measures time wants the machine for itself.
pytest -n 4 --dist loadfile -m "not slow and not browser and not bench"
pytest -m "not slow and (browser or bench)"
