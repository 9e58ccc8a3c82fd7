#!/bin/sh
# Renew the exact dependencies of the image: requirements.lock and requirements-build.lock, for every platform at once.
# Without arguments only what pyproject.toml no longer allows changes; --upgrade takes the newest of everything, and
# --upgrade-package NAME of one.
set -eu
root=$(cd "$(dirname "$0")/.." && pwd)
. "$root/scripts/venv.sh"
[ -x "$root/.venv/bin/python" ] || make_venv
"$root/.venv/bin/python" -m pip install -q --disable-pip-version-check 'uv>=0.9'
cd "$root"
version=$(sed -n 's/^ARG BASE=.*python:\([0-9.]*\)-slim.*/\1/p' Dockerfile | head -n 1)
lock() { # $1: the list to write; on standard input: what is wanted
  "$root/.venv/bin/uv" pip compile -q --universal --python-version "$version" --generate-hashes --no-header \
    --no-annotate "$@"
}
lock pyproject.toml --extra postgres -o requirements.lock "$@"
"$root/.venv/bin/python" -c \
  "import tomllib; print(*tomllib.load(open('pyproject.toml', 'rb'))['build-system']['requires'], sep='\n')" |
  lock - -o requirements-build.lock "$@"
echo "requirements.lock and requirements-build.lock are up to date; commit them."
