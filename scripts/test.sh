#!/bin/sh
# Set everything up in .venv, then run every check. Arguments go to pytest, e.g. tests/kin, or -m browser.
# With KINBOARD_TEST_PICTURES=1 the browser tests save pictures of the screens in tests/artifacts.
set -eu
root=$(cd "$(dirname "$0")/.." && pwd)
. "$root/scripts/venv.sh"
unset PYTHONDONTWRITEBYTECODE # hundreds of processes are started, each of which would compile all it imports
chromium=${KINBOARD_TEST_CHROMIUM:-/usr/bin/chromium}
[ -x "$root/.venv/bin/python" ] || make_venv
installing=
if [ ! -x "$chromium" ]; then
  apt_install chromium & # while pip downloads
  installing=$!
fi
install_kinboard "[test]"
[ -z "$installing" ] || wait "$installing" ||
  fail "the browser tests need Chromium. On Debian: sudo apt-get install chromium"
PATH="$root/.venv/bin:$root/.venv/debian/usr/sbin:$root/.venv/debian/usr/bin:$PATH:/usr/sbin"
for proxy in nginx caddy; do
  command -v $proxy >/dev/null || apt_unpack $proxy || fail "the tests of deploy/ need $proxy in the PATH"
done
command -v initdb >/dev/null || ls /usr/lib/postgresql/*/bin/initdb >/dev/null 2>&1 || apt_install postgresql ||
  fail "the tests of classrooms need PostgreSQL. On Debian: sudo apt-get install postgresql"
cd "$root"
if [ $# -gt 0 ]; then
  ruff check .
  ruff format --check .
  mypy
  exec pytest "$@"
fi
# Kernels are compiled before any test, by two processes from both ends: two runs would both compile the same ones.
python -c 'import kin; kin.warm_up(); kin.warm_up_rest()' &
compiling=$!
python -c 'import kin; kin.warm_up_rest(backwards=True)'
ruff check .
ruff format --check .
mypy
wait $compiling
# Browsers and processes that start on a loaded machine can be late: a failure counts if it comes twice. The summary
# names what was run again ("rerun"), which is a fault of the test or of the code all the same.
twice="--reruns 1 -r R"
# The browser tests draw on one core and often wait: the other tests run beside them. What measures time runs alone.
log=$(mktemp)
trap 'rm -f "$log"' EXIT
pytest $twice -m "not slow and browser" >"$log" 2>&1 &
browsing=$!
failed=0
pytest $twice -n 3 --dist loadfile -m "not slow and not browser and not bench" || failed=1
wait $browsing || failed=1
cat "$log"
pytest $twice -m "not slow and bench" || failed=1
exit $failed
