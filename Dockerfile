# Kinboard: one port, no root, nothing fetched at run time.
#   docker build -t kinboard .
#   docker run --rm -p 8000:8000 kinboard

FROM python:3.12-slim AS build
ENV PIP_DISABLE_PIP_VERSION_CHECK=1 PIP_NO_CACHE_DIR=1
WORKDIR /src
# The environment has no pip of its own: the image never installs anything later.
RUN python -m venv --without-pip /opt/kinboard
# Dependencies first: they change seldom, so a change of code rebuilds in seconds.
COPY pyproject.toml ./
RUN python -c "import tomllib; print(*tomllib.load(open('pyproject.toml', 'rb'))['project']['dependencies'], sep='\n')" \
      > requirements.txt \
    && pip --python /opt/kinboard/bin/python install -r requirements.txt
COPY README.md LICENSE ./
COPY static static
COPY kin kin
COPY app app
RUN pip --python /opt/kinboard/bin/python install --no-deps .


FROM python:3.12-slim
LABEL org.opencontainers.image.title="Kinboard" \
      org.opencontainers.image.description="An interactive robot-arm kinematics dashboard for the browser." \
      org.opencontainers.image.version="0.1.0" \
      org.opencontainers.image.licenses="MIT"
COPY --from=build /opt/kinboard /opt/kinboard
# Machine code cached on one CPU model is ignored on any other, and compiling takes about a minute. So kernels are
# compiled here for a fixed level that every 64-bit x86 machine of the last decade has, emulators included; the
# empty feature list means "what the level has" instead of "what the building machine has". On ARM LLVM does not know
# the level and falls back to its generic one.
ARG CPU_LEVEL=x86-64-v2
ENV PATH=/opt/kinboard/bin:$PATH \
    PYTHONUNBUFFERED=1 \
    PYTHONDONTWRITEBYTECODE=1 \
    NUMBA_CPU_NAME=$CPU_LEVEL \
    NUMBA_CPU_FEATURES="" \
    NUMBA_CACHE_DIR=/var/cache/kinboard \
    KINBOARD_HOST=0.0.0.0 \
    KINBOARD_PORT=8000
RUN useradd --system --uid 10001 --no-create-home --shell /usr/sbin/nologin kinboard \
    && install -d -o kinboard -g kinboard /var/cache/kinboard
USER kinboard
WORKDIR /tmp
RUN python -c "import kin; kin.warm_up(); kin.warm_up_rest()"
# numba insists on a cache it can write to: a volume stays writable under `docker run --read-only`, and starts as a
# copy of what was compiled above.
VOLUME /var/cache/kinboard
EXPOSE 8000
HEALTHCHECK --interval=15s --timeout=5s --start-period=60s --retries=3 \
    CMD ["python", "-c", "import os, urllib.request as r; r.build_opener(r.ProxyHandler({})).open('http://127.0.0.1:' + os.environ['KINBOARD_PORT'] + '/readyz', timeout=4)"]
CMD ["kinboard", "serve"]
