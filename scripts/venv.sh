# Sourced by serve.sh and test.sh, with $root set: makes $root/.venv and installs Kinboard into it, once.

fail() { echo "kinboard: $*" >&2; exit 1; }

# Only root can install Debian packages; the caller prints a hint for other users.
apt_install() {
  if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
    echo "Installing $* with apt…"
    apt-get update -qq && DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "$@" >/dev/null
  else
    return 1
  fi
}

# Unpack a Debian package into .venv/debian: needs no root and starts no service.
apt_unpack() {
  command -v apt-get >/dev/null || return 1
  echo "Unpacking $1 from Debian into .venv…"
  mkdir -p "$root/.venv/debian" && (
    cd "$root/.venv/debian" &&
      { [ "$(id -u)" != 0 ] || apt-get update -qq; } &&
      apt-get download -qq -o APT::Sandbox::User=root "$1" &&
      dpkg -x "$1"_*.deb . && rm "$1"_*.deb
  )
}

find_python() {
  for candidate in ${PYTHON:-} python3 python3.13 python3.12 python3.11 python; do
    if command -v "$candidate" >/dev/null && "$candidate" -c \
      'import sys; sys.exit(not (3, 11) <= sys.version_info < (3, 14))' 2>/dev/null; then
      echo "$candidate"
      return
    fi
  done
  fail "needs Python 3.11, 3.12 or 3.13 and found none. Install one or set PYTHON: PYTHON=/path/to/python3.12 sh $0"
}

make_venv() {
  python=$(find_python) || exit 1
  if ! "$python" -c 'import venv, ensurepip' 2>/dev/null; then
    version=$("$python" -c 'import sys; print("%d.%d" % sys.version_info[:2])')
    apt_install "python$version-venv" ||
      fail "$python lacks the venv module. On Debian or Ubuntu: sudo apt-get install python$version-venv"
  fi
  "$python" -m venv "$root/.venv" || fail "$python could not create $root/.venv"
}

# $1: an extra such as "[test]", or "". Repeated only when pyproject.toml has changed.
install_kinboard() {
  stamp="$root/.venv/installed$1"
  [ -x "$root/.venv/bin/python" ] || make_venv
  if [ ! -e "$stamp" ] || [ "$root/pyproject.toml" -nt "$stamp" ]; then
    echo "Installing Kinboard$1 into .venv (a minute or two, once)…"
    # Few of the installed modules are ever imported; those are compiled on import, if bytecode may be written.
    compile=--no-compile
    [ -z "${PYTHONDONTWRITEBYTECODE:-}" ] || compile=--compile
    "$root/.venv/bin/python" -m pip install -q $compile --disable-pip-version-check -e "$root$1" ||
      fail "the installation failed, see the message above. To start over, delete .venv."
    touch "$stamp"
  fi
}
