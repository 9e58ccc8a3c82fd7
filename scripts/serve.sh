#!/bin/sh
# Set everything up in .venv, then serve the dashboard. Arguments go to `kinboard serve`, e.g. --port 9000 --open.
set -eu
root=$(cd "$(dirname "$0")/.." && pwd)
. "$root/scripts/venv.sh"
install_kinboard "[compiler]"
exec "$root/.venv/bin/kinboard" serve "$@"
