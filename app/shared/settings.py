"""Settings of the service: command-line flags override ``KINBOARD_…`` variables, which override the defaults."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Final

import platformdirs
from pydantic import BeforeValidator, Field, SecretStr, field_validator
from pydantic_settings import BaseSettings, NoDecode, SettingsConfigDict

from app.shared.clients import Proxies
from app.shared.security import frame_ancestor
from app.shared.threads import background_threads


def _listed(value: object) -> object:
    """``a, b`` and ``["a", "b"]`` in an environment variable are the same list."""
    if not isinstance(value, str):
        return value
    if not value.strip().startswith("["):
        return tuple(part.strip() for part in value.split(",") if part.strip())
    try:
        return json.loads(value)
    except json.JSONDecodeError as error:
        raise ValueError(f"not a list in JSON ({error.msg}); write values with commas between them") from None


# Settings of earlier versions that do nothing any more, by their variables, and why.
OBSOLETE: Final[Mapping[str, str]] = MappingProxyType(
    dict.fromkeys(
        ("KINBOARD_WORKERS", "KINBOARD_REST_WORKERS"),
        "the service is one process, and KINBOARD_COMPUTE says how many compute for it",
    )
    | {
        "KINBOARD_BENCH": "visitors start no benchmark; kinboard bench --html FILE makes a scoreboard",
        "KINBOARD_PIN": "one process serves all, on any processor",
    }
    | dict.fromkeys(
        ("NUMBA_CACHE_DIR", "NUMBA_DISABLE_JIT"),
        "kernels are compiled before the program begins",
    )
)

Names = Annotated[tuple[str, ...], NoDecode, BeforeValidator(_listed)]


class Settings(BaseSettings):
    """Settings for operators. Each field is also an environment variable, e.g. ``KINBOARD_PORT``."""

    model_config = SettingsConfigDict(env_prefix="KINBOARD_", frozen=True)

    host: str = Field("127.0.0.1", description="Address to listen on.")
    port: int = Field(8000, ge=0, le=65535, description="Port to listen on; 0 takes any free port.")
    root_path: str = Field("", description="Path prefix that a reverse proxy adds, e.g. /kinboard.")
    robots: Path | None = Field(None, description="Folder with further robot files (*.toml).")
    exercises: Path | None = Field(None, description="Folder with further exercises (*.toml).")
    courses: Path | None = Field(None, description="Folder with further courses (*.toml).")
    lessons: Path | None = Field(
        None,
        description="Folder with files that replace a lesson's words and questions (velocity.toml) or translate "
        "its words (velocity.de.toml).",
    )
    language: str = Field(
        "en", description="Language of the lessons' words in pages that choose none: en, or one of that folder."
    )
    data: Path | None = Field(
        None,
        description="Folder for the database of classrooms, created when needed. "
        "Unset: the user's own data folder.",
    )
    database_url: SecretStr | None = Field(
        None,
        description="Database of classrooms instead of a file, for several machines: "
        "postgresql://user:password@host/name.",
    )
    lti: Path | None = Field(
        None, description="File with the learning platforms that may launch Kinboard (*.toml), see LTI."
    )
    max_rooms: int = Field(100, ge=0, description="Maximum number of classrooms at a time; 0: none may be opened.")
    max_batch: int = Field(10_000, ge=1, description="Maximum number of configurations or targets in a request.")
    max_path: int = Field(1000, ge=1, description="Maximum number of waypoints in a path.")
    max_points: int = Field(100_000_000, ge=1, description="Maximum number of points in a workspace cloud.")
    max_streams: int = Field(
        8, ge=1, description="Maximum number of clouds and capability maps that are sent at a time."
    )
    max_voxels: int = Field(
        40, ge=1, le=256, description="Maximum number of voxels along one side of a capability map."
    )
    max_body: int = Field(8 * 1024 * 1024, ge=1024, description="Maximum size of a request body in bytes.")
    upload_memory: int = Field(
        64 * 1024 * 1024,
        ge=1024,
        description="Maximum size in bytes of all request bodies held at a time.",
    )
    max_answer: int = Field(
        128 * 1024 * 1024, ge=1 << 16, description="Maximum size of the answer to one request in bytes."
    )
    answer_memory: int = Field(
        256 * 1024 * 1024,
        ge=1 << 16,
        description="Maximum size in bytes of all answers that the service holds until they are read.",
    )
    max_requests: int = Field(
        16,
        ge=1,
        le=32,
        description="Maximum number of requests that threads of the service compute at a time; others wait.",
    )
    time_budget: float = Field(
        30.0,
        ge=0.1,
        le=3600,
        description="Seconds that a request may compute, and seconds that it may wait before.",
    )
    map_memory: int = Field(
        64 * 1024 * 1024, ge=0, description="Maximum size in bytes of the cache of capability maps."
    )
    mesh_memory: int = Field(
        128 * 1024 * 1024,
        ge=0,
        description="Maximum size in bytes of the meshes of visitors' own arms that the service holds.",
    )
    map_time: float = Field(
        600.0, ge=1, le=86400, description="Seconds that one capability map of the viewer may be computed."
    )
    token: SecretStr | None = Field(
        None, min_length=8, description="Access token, of at least 8 characters. Unset: no authentication."
    )
    read_only: bool = Field(False, description="Visitors without the access token may look but not move anything.")
    rate_limit: float = Field(
        0.0,
        ge=0,
        allow_inf_nan=False,
        description="Maximum rate of requests per second of one client; 0: no limit.",
    )
    cors_origins: Names = Field(
        (), description="Origins whose pages may read REST answers, by `fetch`; others are refused by name."
    )
    compute: int | None = Field(
        None,
        ge=0,
        le=64,
        description="Number of processes that compute for REST, so that visitors do not wait for programs. "
        "0: threads of the service compute. Unset: one fewer than there are processors, at least 1.",
    )
    worker_timeout: float = Field(
        30.0,
        ge=2,
        le=3600,
        description="Seconds without a step of the event loop after which the service ends and is started again.",
    )
    drain: float = Field(
        5.0, ge=1, le=300, description="Seconds that running requests may take after the service is asked to stop."
    )
    max_connections: int = Field(1000, ge=1, description="Maximum number of open connections.")
    client_share: float = Field(
        0.75,
        gt=0,
        le=1,
        description="Share of connections, places and upload memory that one client may take, of each kind.",
    )
    receive_timeout: float = Field(
        20.0,
        ge=0.1,
        le=3600,
        description="Seconds within which the head of a request must arrive, and that its body may pause.",
    )
    send_timeout: float = Field(
        60.0, ge=0.1, le=3600, description="Seconds after which a client that reads nothing is disconnected."
    )
    max_visitors: int = Field(200, ge=1, description="Maximum number of open viewer tabs.")
    access_log: bool = Field(False, description="Log each request to stderr, one JSON object per line.")
    mcp: bool = Field(
        False,
        description="Whether agents may use the tools at /mcp (Model Context Protocol); needs the extra "
        "kinboard[mcp].",
    )
    cloud_memory: int = Field(
        512 * 1024 * 1024, ge=0, description="Maximum size in bytes of the cache of workspace clouds."
    )
    allowed_origins: Names = Field((), description="Further origins whose pages may open the viewer's websocket.")
    frame_ancestors: Names = Field(
        (),
        description="Origins whose pages may embed the viewer in a frame, e.g. https://moodle.school.example; "
        "`*`: any. Unset: only pages of this service.",
    )
    allowed_hosts: Names = Field(
        (),
        description="Host names of the service; `*`: any. IP addresses are always accepted. Unset: any, but on a "
        "loopback address without a token only localhost.",
    )
    trusted_proxies: Names = Field(
        (),
        description="Addresses and networks of the reverse proxies whose X-Forwarded-For and X-Forwarded-Proto "
        "are believed.",
    )

    @field_validator("frame_ancestors")
    @classmethod
    def _are_origins(cls, values: tuple[str, ...]) -> tuple[str, ...]:
        return tuple(frame_ancestor(value) for value in values)

    @field_validator("database_url")
    @classmethod
    def _is_postgresql(cls, value: SecretStr | None) -> SecretStr | None:
        if value is not None and not value.get_secret_value().startswith(("postgresql://", "postgres://")):
            raise ValueError("must begin with postgresql://; for SQLite, set KINBOARD_DATA to a folder")
        return value

    @field_validator("trusted_proxies")
    @classmethod
    def _are_networks(cls, values: tuple[str, ...]) -> tuple[str, ...]:
        Proxies(values)  # raises ValueError
        return values

    def on_this_machine(self) -> Settings:
        """These settings for one process on a free port that only this machine reaches: no token, no rates."""
        return self.model_copy(
            update={
                "host": "127.0.0.1",
                "port": 0,
                "compute": 0,
                "token": None,
                "read_only": False,
                "rate_limit": 0.0,
                "root_path": "",
            }
        )

    @property
    def processes(self) -> int:
        """How many processes compute for REST."""
        return background_threads() if self.compute is None else self.compute

    @property
    def data_folder(self) -> Path:
        """The folder for the database of classrooms, whether or not it exists."""
        return self.data or Path(platformdirs.user_data_dir("kinboard", appauthor=False))


def static_folder() -> Path:
    """The folder of the pages' static files: next to the package in a checkout, inside it when installed."""
    package = Path(__file__).parents[1]
    installed = package / "_static"
    return installed if installed.is_dir() else package.parent / "static"


def docs_folder() -> Path:
    """The folder of the documentation: next to the package in a checkout, its pages inside it when installed."""
    package = Path(__file__).parents[1]
    installed = package / "_docs"
    return installed if installed.is_dir() else package.parent / "docs"
