#!/bin/sh
# Set everything up in .venv, then run every check. Arguments go to pytest, e.g. tests/kin, or -m browser.
# With KINBOARD_TEST_PICTURES=1 the browser tests save pictures of the screens in tests/artifacts.
set -eu
root=$(cd "$(dirname "$0")/.." && pwd)
. "$root/scripts/venv.sh"
unset PYTHONDONTWRITEBYTECODE # hundreds of processes are started, each of which would compile all it imports
chromium=${KINBOARD_TEST_CHROMIUM:-/usr/bin/chromium}

# Three browsers, a screen for two of them, PostgreSQL, shells, a C++ compiler, curl and the two proxies, if they are missing.
install_programs() {
  missing=
  [ -x "$chromium" ] || missing=chromium
  command -v firefox-esr >/dev/null || missing="${missing:+$missing }firefox-esr"
  command -v WebKitWebDriver >/dev/null || missing="${missing:+$missing }webkit2gtk-driver"
  command -v Xvfb >/dev/null || missing="${missing:+$missing }xvfb"
  command -v initdb >/dev/null || ls /usr/lib/postgresql/*/bin/initdb >/dev/null 2>&1 || \
    missing="${missing:+$missing }postgresql"
  for program in zsh fish curl g++; do # of the same names in Debian
    command -v $program >/dev/null || missing="${missing:+$missing }$program"
  done
  # shellcheck disable=SC2086 # several words
  [ -z "$missing" ] || apt_install $missing || fail "the tests of pages and classrooms need browsers and a database." \
    "On Debian: sudo apt-get install $missing"
  for proxy in nginx caddy; do
    command -v $proxy >/dev/null || apt_unpack $proxy || fail "the tests of deploy/ need $proxy in the PATH"
  done
}

compile_kernels() {
  python -c 'import kin; kin.warm_up(everything=True)'
}

cd "$root"
[ -x .venv/bin/python ] || make_venv
PATH="$root/.venv/bin:$root/.venv/debian/usr/sbin:$root/.venv/debian/usr/bin:$PATH:/usr/sbin"
install_programs & # while pip downloads
programs=$!
if [ $# -gt 0 ]; then
  install_kinboard "[test]"
  wait $programs
  ruff check .
  ruff format --check .
  sh scripts/lint.sh
  mypy
  exec pytest "$@"
fi
# Kernels are compiled before any test, by two processes from both ends: two runs would both compile the same ones.
# They need no more than Kinboard itself does; what the tests need is downloaded meanwhile.
install_kinboard ""
compile_kernels &
compiling=$!
python -c 'from kin.warmup import warm_up_rest; warm_up_rest(backwards=True)' &
backwards=$!
install_kinboard "[test]"
ruff check .
ruff format --check .
sh scripts/lint.sh
wait $programs
# If the second installation replaced a library in use, a compiling process may have failed: once more then.
wait $compiling && wait $backwards || compile_kernels
# Browsers and processes that start on a loaded machine can be late: a failure counts if it comes twice, in a browser
# three times. The summary names what was run again ("rerun"), which is a fault of the test or of the code all the same.
twice="--reruns 1 -r R"
# The files with tests of a marker: collecting all others takes longer than some of these run.
files_of() {
  grep -rl "pytest\.mark\.$1\b" tests --include="test_*.py"
}
# Pages draw for as long as they wait: beside other work, browsers take twice as much of the processors. They come first,
# then what computes, in four processes, as many tests wait for arms that move; then alone what measures time.
failed=0
pytest --reruns 2 -r R -n 3 --dist loadfile --no-loadscope-reorder -m "not slow and browser" $(files_of browser) || failed=1
types=$(mktemp)
trap 'rm -f "$types"' EXIT
mypy >"$types" 2>&1 &
typing=$!
# The first process that collects all tests compiles their modules, which takes twice as long as the rest of it. Four that
# begin together would each do so. What cannot be collected is said by the run.
pytest --collect-only -qq >/dev/null 2>&1 || :
pytest $twice -n 4 --dist loadfile --no-loadscope-reorder -m "not slow and not browser and not bench" || failed=1
wait $typing || failed=1
cat "$types"
pytest $twice -m "not slow and bench" $(files_of bench) || failed=1
exit $failed
