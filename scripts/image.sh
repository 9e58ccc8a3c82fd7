#!/bin/sh
# Build the image and check what docs/running.md says about it: on Debian, as root, without Docker.
#
# The base image is a stand-in made here from Debian's packages: the same Debian release and Python version as the
# Dockerfile's, and like that one without bytecode. Everything is kept in one folder, apart from the machine's own
# images; delete it when done:
#   KINBOARD_IMAGE_WORK    that folder (default /var/tmp/kinboard-image)
# A package index or CA bundle of your own is used while building and does not get into the image:
#   PIP_INDEX_URL, PIP_EXTRA_INDEX_URL, SSL_CERT_FILE, and the proxies http_proxy, https_proxy, no_proxy
set -eu
root=$(cd "$(dirname "$0")/.." && pwd)
. "$root/scripts/venv.sh"

[ "$(id -u)" = 0 ] || fail "building without Docker needs root: sudo sh scripts/image.sh"
work=${KINBOARD_IMAGE_WORK:-/var/tmp/kinboard-image}
base=$(sed -n 's/^ARG BASE=//p' "$root/Dockerfile")
python_version=$(echo "$base" | sed -n 's/.*python:\([0-9.]*\)-slim.*/\1/p')
release=$(echo "$base" | sed -n 's/.*-slim-\([a-z]*\).*/\1/p')
image=localhost/kinboard:latest
version=$(sed -n 's/^__version__ = "\(.*\)"/\1/p' "$root/kin/_version.py")
container=kinboard-check
limits="--ulimit nofile=4096:4096 --ulimit nproc=4096:4096"
emulator=/usr/bin/qemu-x86_64-static
mkdir -p "$work"

say() { printf '\n== %s\n' "$*"; }
now() { date +%s.%N; }
since() { echo "$1 $(now)" | awk '{ printf "%.1f", $2 - $1 }'; }

# The tools' own settings, so that neither the machine's configuration nor its images are touched.
configure() {
  printf '[engine]\ncgroup_manager = "cgroupfs"\nruntime = "runc"\n[network]\nnetwork_backend = "netavark"\n' \
    >"$work/containers.conf"
  printf '[storage]\ndriver = "overlay"\ngraphroot = "%s"\nrunroot = "%s"\n' "$work/storage" "$work/run" \
    >"$work/storage.conf"
  export CONTAINERS_CONF="$work/containers.conf" CONTAINERS_STORAGE_CONF="$work/storage.conf"
}

install_tools() {
  missing=
  for package in buildah podman runc conmon netavark aardvark-dns iptables debootstrap qemu-user-static curl; do
    dpkg -s "$package" >/dev/null 2>&1 || missing="$missing $package"
  done
  # shellcheck disable=SC2086 # a list of words
  [ -z "$missing" ] || apt_install $missing || fail "needs Debian's packages$missing"
  install_kinboard "[test]"
  [ -x "${KINBOARD_TEST_CHROMIUM:-/usr/bin/chromium}" ] || apt_install chromium || fail "needs Chromium"
}

make_base() {
  if podman image exists "$base"; then return; fi
  say "Base image: Debian $release with Python $python_version"
  rm -rf "$work/base"
  debootstrap --variant=minbase --include=ca-certificates,python3,python3-pip,python3-venv \
    "$release" "$work/base" >"$work/debootstrap.log" 2>&1 || fail "debootstrap failed: see $work/debootstrap.log"
  (
    cd "$work/base"
    [ -x "usr/bin/python$python_version" ] || fail "Debian $release has no Python $python_version"
    for name in python python3 "python$python_version"; do
      ln -s "/usr/bin/python$python_version" usr/local/bin/$name
    done
    rm -rf var/cache/apt/* var/lib/apt/lists/* var/log/* usr/share/doc/* usr/share/man/* usr/share/locale/*
    find usr -name __pycache__ -prune -exec rm -r {} +
    tar -c --numeric-owner .
  ) | podman import -q --change 'CMD ["python3"]' --change 'ENV PATH=/usr/local/bin:/usr/local/sbin:/usr/sbin:/usr/bin:/sbin:/bin' - "$base"
  rm -rf "$work/base"
}

build() {
  say "Build"
  # Mounted on the empty /mnt while commands of the Dockerfile run, never copied.
  mkdir -p "$work/mnt"
  cp "${SSL_CERT_FILE:-/etc/ssl/certs/ca-certificates.crt}" "$work/mnt/ca.crt"
  {
    echo "[global]"
    echo "cert = /mnt/ca.crt"
    [ -z "${PIP_INDEX_URL:-}" ] || echo "index-url = $PIP_INDEX_URL"
    [ -z "${PIP_EXTRA_INDEX_URL:-}" ] || echo "extra-index-url = $PIP_EXTRA_INDEX_URL"
  } >"$work/mnt/pip.conf"
  began=$(now)
  buildah bud --isolation chroot --network host --pull-never --layers \
    --volume "$work/mnt:/mnt:ro" --build-arg PIP_CONFIG_FILE=/mnt/pip.conf \
    --format docker --build-arg "VERSION=$version" --build-arg "REVISION=$(git -C "$root" rev-parse HEAD 2>/dev/null || echo unknown)" \
    --tag "$image" "$root" >"$work/build.log" 2>&1 || { tail -n 40 "$work/build.log"; fail "see $work/build.log"; }
  echo "built in $(since "$began") s"
}

bytes() { podman image inspect --format '{{.Size}}' "$1" | awk '{ printf "%.0f", $1 / 1e6 }'; }

weigh() {
  say "Size"
  rm -rf "$work/oci" && podman save -q --format oci-dir -o "$work/oci" "$image" >/dev/null
  echo "$(bytes "$image") MB, of which the base $(bytes "$base") MB; to download $(du -sm "$work/oci" | cut -f 1) MiB"
  rm -rf "$work/oci"
  podman history --format '{{.Size}}  {{.CreatedBy}}' "$image" | cut -c 1-100 | grep -v '^0 B'
}

inside() { # $1: a program of the image, $@: its arguments
  program=$1
  shift
  # podman's own defaults for ulimits may be more than this machine allows; its health checks need systemd.
  # shellcheck disable=SC2086 # a list of words
  podman run --rm --no-healthcheck $limits --entrypoint "$program" "$image" "$@"
}

# What is in the image and what it was built from: $work/kinboard.cdx.json and $work/kinboard.provenance.json.
attest() {
  say "SBOM and provenance"
  inside python -c 'import importlib.metadata as m
for d in m.distributions(): print(d.name, d.version)' >"$work/python.txt"
  inside dpkg-query -W -f '${Package} ${Version}\n' >"$work/debian.txt"
  "$root/.venv/bin/python" "$root/scripts/attest.py" --python "$work/python.txt" --debian "$work/debian.txt" \
    --release "$release" --version "$version" --base "$base@$(podman image inspect --format '{{.Digest}}' "$base")" \
    --revision "$(git -C "$root" rev-parse HEAD 2>/dev/null || echo unknown)" \
    --digest "$(podman image inspect --format '{{.Digest}}' "$image")" --to "$work" || fail "see above"
}

# Stricter than compose.yaml: not even /tmp can be written to.
# shellcheck disable=SC2086 # a list of words
run() {
  podman run --detach --replace --name "$container" --publish 127.0.0.1::8000 \
    --read-only --read-only-tmpfs=false --cap-drop all --security-opt no-new-privileges \
    --pids-limit 256 --memory 1g --cpus 2 $limits \
    --health-interval disable "$@"
}

# Once more if it ended by itself between being told to and being killed.
stop_container() {
  podman rm --force --ignore --time 10 "$container" >/dev/null || podman rm --force --ignore "$container" >/dev/null
}

wait_until_ready() { # $1: seconds at most
  end=$(($(date +%s) + $1))
  until [ "$(curl -s --noproxy '*' -o "$work/readyz" -w '%{http_code}' "$url/readyz")" = 200 ]; do
    [ "$(date +%s)" -lt "$end" ] || { podman logs "$container"; fail "not ready after $1 s"; }
    sleep 0.05
  done
}

start() { # $@: of `run`
  began=$(now)
  run "$@" >/dev/null
  url=http://$(podman port "$container" 8000/tcp)
}

# $1: a level of processors, or a pattern of some, for which kernels have been loaded. Processes that an emulated one starts
# are not emulated.
has_loaded() {
  loaded=$(podman exec "$container" sh -c "cat /proc/[0-9]*/maps 2>/dev/null" | grep -o "_kernels_[a-z0-9_]*" | sort -u)
  echo "$loaded" | grep -Eqx "_kernels_($1)" || fail "kernels loaded: ${loaded:-none}, not $1"
  echo "kernels: $loaded"
}

check() {
  say "Start"
  sync
  [ ! -w /proc/sys/vm/drop_caches ] || echo 3 >/proc/sys/vm/drop_caches
  start "$image"
  wait_until_ready 60
  echo "ready after $(since "$began") s, nothing of the image in memory before"
  has_loaded "[a-z0-9_]*"
  stop_container
  start "$image"
  wait_until_ready 60
  echo "ready after $(since "$began") s, the second time"

  say "Who and where"
  [ "$(podman exec "$container" id -u)" = 10001 ] || fail "runs as root"
  if podman exec "$container" sh -c 'echo x >/probe || echo x >/tmp/probe || echo x >/opt/kinboard/probe' 2>/dev/null; then
    fail "the root filesystem can be written to"
  fi
  [ "$(podman exec "$container" sh -c 'grep -c ":1F40 .* 0A " /proc/net/tcp')" = 1 ] || fail "does not listen on port 8000"
  if podman exec "$container" python -c 'import pip, hatchling' 2>/dev/null; then fail "pip is in the environment"; fi
  echo "user 10001, nothing writable, $(podman exec "$container" sh -c 'grep VmRSS /proc/1/status' | tr -s '\t ' ' ')"
  podman healthcheck run "$container" || fail "HEALTHCHECK"
  echo "HEALTHCHECK passes"

  say "REST and viewer"
  KINBOARD_KERNELS=python "$root/.venv/bin/python" "$root/scripts/image_check.py" "$url" "$work/viewer.png" || fail "see above"
  echo "the viewer's picture is $work/viewer.png"

  say "Stop"
  began=$(now)
  podman stop --time 10 "$container" >/dev/null
  [ "$(podman inspect --format '{{.State.ExitCode}}' "$container")" = 0 ] || { podman logs "$container"; fail "exit code"; }
  echo "SIGTERM: ended after $(since "$began") s with exit code 0"
  stop_container
}

# Twelve years apart, and neither is the machine that built the image. Emulation costs a factor of ten or more.
check_other_cpus() {
  for cpu in Nehalem:x86_64_v2 Haswell:x86_64_v3; do
    say "Start on an emulated ${cpu%:*}"
    start --volume "$emulator:/emulator:ro" "$image" /emulator -cpu "${cpu%:*}" /opt/kinboard/bin/python -m kinboard.cli serve
    wait_until_ready 300
    echo "ready after $(since "$began") s of emulation"
    has_loaded "${cpu#*:}"
    stop_container
  done
}

install_tools
configure
trap stop_container EXIT
make_base
build
weigh
attest
check
[ "$(uname -m)" != x86_64 ] || check_other_cpus
say "Everything is as docs/running.md says"
