#!/bin/sh
# Set everything up in .venv, then check: linters, types, and the tests that a change needs (some minutes).
#   sh scripts/test.sh --all       all tests but those marked slow (half an hour)
#   sh scripts/test.sh tests/kin   other arguments go to pytest
# With KINBOARD_TEST_PICTURES=1 the browser tests save pictures of the screens in tests/artifacts.
set -eu
root=$(cd "$(dirname "$0")/.." && pwd)
. "$root/scripts/venv.sh"
unset PYTHONDONTWRITEBYTECODE # hundreds of processes are started, each of which would compile all it imports
chromium=${KINBOARD_TEST_CHROMIUM:-/usr/bin/chromium}
work=$(mktemp -d)
started= # processes in the background that may be ended at any time
programs= # the one that installs Debian's packages, which may not

# However this script ends, nothing goes on behind it.
end() {
  status=$?
  trap - EXIT INT TERM HUP
  for each in $started; do kill "$each" 2>/dev/null || :; done
  [ -z "$programs" ] || wait "$programs" || :
  for each in $started; do wait "$each" 2>/dev/null || :; done
  rm -rf "$work"
  exit "$status"
}
trap end EXIT
trap 'exit 130' INT TERM HUP

# The package of WebKitWebDriver: its name since Debian 14, if apt knows it, else that of older releases.
webkit_driver() {
  [ "$(id -u)" != 0 ] || apt_update >&2 || :
  for package in webkitgtk-webdriver webkit2gtk-driver; do
    # A name that other packages only mention shows nothing, and is no error.
    if apt-cache show $package 2>/dev/null | grep -q .; then
      echo $package
      return
    fi
  done
  echo webkit2gtk-driver
}

# Three browsers, a screen for two of them, PostgreSQL, shells, a C++ compiler, curl and the two proxies, if they are missing.
install_programs() {
  missing=
  [ -x "$chromium" ] || missing=chromium
  command -v firefox-esr >/dev/null || missing="${missing:+$missing }firefox-esr"
  command -v WebKitWebDriver >/dev/null || missing="${missing:+$missing }$(webkit_driver)"
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

# $1: what it is for people; the rest: the command.
step() {
  name=$1
  shift
  "$@" || fail "$name failed: its message is above."
}

# The same in the background; `finish` waits for it and shows what it printed.
start() {
  name=$1
  shift
  "$@" >"$work/$name" 2>&1 &
  started="$started $!"
  eval "pid_$name=$!"
}
finish() {
  eval "pid=\$pid_$1"
  wait "$pid" && result=0 || result=$?
  cat "$work/$1"
  return $result
}

cd "$root"
[ -x .venv/bin/python ] || make_venv
PATH="$root/.venv/bin:$root/.venv/debian/usr/sbin:$root/.venv/debian/usr/bin:$PATH:/usr/sbin"
install_programs & # while pip downloads
programs=$!
install_kinboard "[test]"

case ${1:-} in
  --all) selected="not slow" ;;
  "") selected="not slow and not full" ;;
  *) selected= ;;
esac
# Kernels that have changed since the installation are compiled before any test: all would wait for it.
start kernels python -c "from kin.kernels.ahead import entries; entries()"
step "ruff check" ruff check .
step "ruff format" ruff format --check .
step "the check of the scripts of pages (ESLint)" sh scripts/lint.sh
start mypy mypy
wait $programs && programs= || { programs=; fail "what the tests need could not be installed: the message is above."; }
finish kernels || fail "kernels could not be compiled."
if [ -z "$selected" ]; then
  finish mypy || fail "mypy failed."
  trap - EXIT
  rm -rf "$work"
  exec pytest "$@"
fi

# The files with tests of a marker: collecting all others takes longer than some of these run.
files_of() {
  grep -rl "pytest\.mark\.$1\b" tests --include="test_*.py"
}
# Pages draw for as long as they wait: beside other work, browsers take twice as much of the processors. They come first,
# then the others, in six processes, as most tests of the page wait for arms that move: with four, two processors were
# idle for a third of the time. Then alone what measures time.
# The first process that collects all tests compiles their modules, which takes twice as long as the rest of it. Six that
# begin together would each do so.
start collected nice pytest --collect-only -qq
failed=
in_processes="--dist loadfile --no-loadscope-reorder"
pytest -n 3 $in_processes -m "$selected and browser" $(files_of browser) || failed="$failed browsers"
finish collected >/dev/null || : # what cannot be collected is said by the run
pytest -n 6 $in_processes -m "$selected and not browser and not bench" || failed="$failed tests"
finish mypy || failed="$failed mypy"
[ "$selected" = "not slow and not full" ] || pytest -m "$selected and bench" $(files_of bench) || failed="$failed measurements"
[ -z "$failed" ] || fail "failed:$failed. The messages are above."
