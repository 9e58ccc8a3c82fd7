# Sourced by serve.sh and test.sh, with $root set: makes $root/.venv and installs Kinboard into it, once.

fail() { echo "kinboard: $*" >&2; exit 1; }

# Another apt may hold the lock, such as that of automatic updates: it is waited for.
locked="-o DPkg::Lock::Timeout=300"

# Once per run.
apt_update() {
  [ -n "${apt_updated:-}" ] || apt-get $locked update -qq || return 1
  apt_updated=yes
}

# Debian packages may only be installed by root; anybody else is told what to ask for.
apt_install() {
  if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
    echo "Installing $* with apt…"
    apt_update && DEBIAN_FRONTEND=noninteractive apt-get $locked install -y -qq --no-install-recommends "$@" >/dev/null
  else
    return 1
  fi
}

# A Debian package's files in .venv/debian: no root needed, and no service is started on its usual port.
apt_unpack() {
  command -v apt-get >/dev/null || return 1
  echo "Unpacking $1 from Debian into .venv…"
  [ "$(id -u)" != 0 ] || apt_update || return 1
  mkdir -p "$root/.venv/debian" && (
    cd "$root/.venv/debian" &&
      apt-get download -qq -o APT::Sandbox::User=root "$1" &&
      dpkg -x "$1"_*.deb . && rm "$1"_*.deb
  )
}

# Whether $1 is Python 3.11 or newer and, with a second argument, older than Python 3.$2.
fits() {
  command -v "$1" >/dev/null && "$1" -c 'import sys
sys.exit(not (3, 11) <= sys.version_info < (3, int(sys.argv[1])))' "${2:-99}" 2>/dev/null
}

has_venv() { "$1" -c 'import venv, ensurepip' 2>/dev/null; }

# The one that $PYTHON names, else the newest that works: one that has the module venv before one that lacks it.
# 3.15 is not among them yet: it waits for wheels of zstandard, which viser needs.
find_python() {
  if [ -n "${PYTHON:-}" ]; then
    fits "$PYTHON" || fail "PYTHON=$PYTHON is no Python 3.11 or newer"
    echo "$PYTHON"
    return
  fi
  found= others=
  for candidate in python3.14 python3.13 python3.12 python3.11 python3 python; do
    if fits "$candidate" 15; then
      has_venv "$candidate" && echo "$candidate" && return
      found=${found:-$candidate}
    elif version=$("$candidate" -c 'import sys; print("%d.%d" % sys.version_info[:2])' 2>/dev/null); then
      others="${others:+$others, }$candidate is $version"
    fi
  done
  [ -n "$found" ] || fail "needs Python 3.11 to 3.14 and found none${others:+ ($others)}." \
    "Install one, or name it: PYTHON=/path/to/python3.13 sh $0"
  echo "$found"
}

make_venv() {
  python=$(find_python) || exit 1
  if ! has_venv "$python"; then
    version=$("$python" -c 'import sys; print("%d.%d" % sys.version_info[:2])')
    apt_install "python$version-venv" ||
      fail "$python lacks the module venv. On Debian or Ubuntu: sudo apt-get install python$version-venv"
  fi
  "$python" -m venv "$root/.venv" || fail "$python could not make $root/.venv"
}

# uv needs a sixth of pip's time. It knows nothing of an index that pip is set up for.
uv_install() {
  python="$root/.venv/bin/python"
  ! "$python" -m pip config list | grep -q "\.index-url=" || return 1
  "$python" -m pip install -q --disable-pip-version-check "uv>=0.9" || return 1
  "$python" -m uv pip install -q --python "$python" "$@" || { echo "uv could not install it: pip tries…"; return 1; }
}

# $1: what to install, "" or an extra such as "[test]". Done again only when pyproject.toml has changed.
install_kinboard() {
  stamp="$root/.venv/installed$1"
  [ -x "$root/.venv/bin/python" ] || make_venv
  if [ ! -e "$stamp" ] || [ "$root/pyproject.toml" -nt "$stamp" ]; then
    echo "Installing Kinboard into .venv and compiling its kernels (once: half a minute, or some minutes where the network is slow)…"
    # Few of the modules that are installed are ever imported: each is compiled then, if that may be kept.
    pip_compile=--no-compile uv_compile=
    [ -z "${PYTHONDONTWRITEBYTECODE:-}" ] || pip_compile=--compile uv_compile=--compile-bytecode
    uv_install $uv_compile -e "$root$1" ||
      "$root/.venv/bin/python" -m pip install -q $pip_compile --disable-pip-version-check -e "$root$1" ||
      fail "the installation failed; its message is above. Remove .venv to begin afresh."
    touch "$stamp"
  fi
}
