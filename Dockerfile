# Kinboard: one port, no root, nothing written but classrooms in /data, nothing fetched at run time.
#   docker build -t kinboard .
#   docker run --rm -p 127.0.0.1:8000:8000 kinboard
# scripts/image.sh builds it without Docker and checks what docs/running.md says about it.

# A tag may name other bytes tomorrow. To fix them, add the digest that `docker buildx imagetools inspect` prints:
#   --build-arg BASE=docker.io/library/python:3.13-slim-trixie@sha256:…
ARG BASE=docker.io/library/python:3.13-slim-trixie
# Checked against the wheel, and the image's label.
ARG VERSION=1.0.0

FROM ${BASE} AS build
ENV PIP_DISABLE_PIP_VERSION_CHECK=1 PIP_NO_CACHE_DIR=1 PIP_ROOT_USER_ACTION=ignore
# An index of your own: --build-arg PIP_INDEX_URL=…, or a mounted file and its place. Neither gets into the image.
ARG PIP_INDEX_URL
ARG PIP_CONFIG_FILE
RUN apt-get update -qq && apt-get install -y -qq --no-install-recommends binutils=2.44-3
WORKDIR /src
# The environment has no pip of its own: the image never installs anything later.
RUN python -m venv --without-pip /opt/kinboard && python -m venv --system-site-packages /opt/tools
# Dependencies first: they change seldom, so a change of code rebuilds quickly. Both lists are exact, with hashes.
COPY requirements.lock requirements-build.lock ./
RUN install="install --no-compile --require-hashes --only-binary :all:" \
    && pip --python /opt/kinboard/bin/python $install -r requirements.lock \
    && pip --python /opt/tools/bin/python $install -r requirements-build.lock
# What only developers of these packages need: their tests, headers, debugging symbols, and the viewer's sources (its
# built page stays). Nor is pillow's largest library needed, for AVIF, which nothing here reads or writes. Libraries in
# *.libs are left alone: they were patched in a way that strip may break.
RUN cd /opt/kinboard/lib/python*/site-packages \
    && find . -type d -name tests -prune -exec rm -r {} + \
    && find . -type f \( -name '_simd.*.so' -o -name '*_tests.*.so' \) -delete \
    && find . -type f \( -name '_avif.*.so' -o -name 'libavif-*' \) -delete \
    && find . -type f \( -name '*.pyi' -o -name '*.h' -o -name '*.pxd' -o -name '*.lib' -o -name '*.a' \) -delete \
    && find viser/client -mindepth 1 -maxdepth 1 ! -name build ! -name '*.py' -exec rm -r {} + \
    && find . -name '*.so' ! -path '*.libs/*' -exec strip --strip-unneeded {} +
COPY pyproject.toml README.md LICENSE ./
COPY deploy/wheel deploy/wheel
COPY static static
COPY docs docs
COPY kin kin
COPY app app
ARG VERSION
# Kernels for all processors of this kind: the best that the machine has are chosen when they are loaded.
RUN levels=$(uname -m | sed "s/x86_64/x86_64_v2 x86_64_v3 x86_64_v4/") \
    && KINBOARD_TARGET="linux-gnu.2.17 $levels" /opt/tools/bin/python -m hatchling build -t wheel \
    && { ls dist/kinboard-"$VERSION"-*.whl || { echo "built $(ls dist), not $VERSION" >&2; exit 1; }; } \
    && pip --python /opt/kinboard/bin/python install --no-compile --no-deps --no-index dist/*.whl
COPY deploy/image /opt/kinboard/image


FROM ${BASE}
COPY --from=build /opt/kinboard /opt/kinboard
ENV PATH=/opt/kinboard/bin:$PATH \
    PYTHONUNBUFFERED=1 \
    KINBOARD_DATA=/data \
    KINBOARD_HOST=0.0.0.0 \
    KINBOARD_PORT=8000
RUN groupadd --gid 10001 kinboard \
    && useradd --uid 10001 --gid 10001 --no-create-home --home-dir /nonexistent --shell /usr/sbin/nologin kinboard \
    && python /opt/kinboard/image/prepare.py \
    && install --directory --owner=10001 --group=10001 --mode=700 /data
# From here on all of this is only read.
ENV PYTHONDONTWRITEBYTECODE=1
# The user kinboard, as a number: Kubernetes' runAsNonRoot does not look names up.
USER 10001:10001
WORKDIR /
EXPOSE 8000
# The database of classrooms, made with the first room; all else is only read.
VOLUME ["/data"]
HEALTHCHECK --interval=15s --timeout=5s --start-period=30s --retries=3 \
    CMD ["python", "-ISc", "import http.client as h, os, sys; c = h.HTTPConnection('127.0.0.1', int(os.environ['KINBOARD_PORT']), timeout=4); c.request('GET', '/readyz'); sys.exit(c.getresponse().status != 200)"]
CMD ["kinboard", "serve"]
ARG BASE
ARG VERSION
ARG REVISION=unknown
LABEL org.opencontainers.image.title="Kinboard" \
      org.opencontainers.image.description="An interactive robot-arm kinematics dashboard for the browser." \
      org.opencontainers.image.version=$VERSION \
      org.opencontainers.image.revision=$REVISION \
      org.opencontainers.image.licenses="MIT" \
      org.opencontainers.image.vendor="The Kinboard authors" \
      org.opencontainers.image.base.name=$BASE
