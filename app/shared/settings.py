"""Settings of the service: command-line flags over ``KINBOARD_…`` environment variables over these defaults."""

from __future__ import annotations

from pathlib import Path

from pydantic import Field, SecretStr
from pydantic_settings import BaseSettings, SettingsConfigDict


class Settings(BaseSettings):
    """Everything an operator can set. Each field is also an environment variable, e.g. ``KINBOARD_PORT``."""

    model_config = SettingsConfigDict(env_prefix="KINBOARD_", frozen=True)

    host: str = Field("127.0.0.1", description="Address to listen on.")
    port: int = Field(8000, ge=0, le=65535, description="Port to listen on; 0 takes any free one.")
    root_path: str = Field("", description="Path prefix a reverse proxy serves us under, e.g. /kinboard.")
    robots: Path | None = Field(None, description="Folder with further robot files (*.toml).")
    max_batch: int = Field(10_000, ge=1, description="Most configurations or targets one request may hold.")
    max_path: int = Field(1000, ge=1, description="Most waypoints one path may have.")
    max_points: int = Field(100_000_000, ge=1, description="Most points one cloud of the workspace may have.")
    max_streams: int = Field(8, ge=1, description="Most clouds and maps one process sends at a time.")
    max_voxels: int = Field(40, ge=1, le=256, description="Most voxels along one side of a capability map.")
    max_body: int = Field(8 * 1024 * 1024, ge=1024, description="Largest request body in bytes.")
    max_requests: int = Field(
        16, ge=1, le=32, description="Most requests one process computes at a time; others wait for their turn."
    )
    time_budget: float = Field(
        30.0, ge=0.1, le=3600, description="Seconds one request may compute, and seconds it may wait for its turn."
    )
    token: SecretStr | None = Field(
        None, min_length=8, description="Whoever wants in must know it; none: everybody may."
    )
    read_only: bool = Field(False, description="Whoever has no token may look, not touch.")
    rate_limit: float = Field(
        0.0, ge=0, allow_inf_nan=False, description="Requests per second of one client; 0: no limit."
    )
    cors_origins: tuple[str, ...] = Field((), description="Origins whose pages may read REST's answers.")
    workers: int = Field(1, ge=1, le=64, description="Processes that serve side by side; REST and viewers alike.")
    pin: bool = Field(False, description="Keep the interpreter of each process on one processor: quicker drags.")
    drain: float = Field(
        5.0, ge=1, le=300, description="Seconds that answers under way may take when the service is told to stop."
    )
    max_visitors: int = Field(200, ge=1, description="Most tabs of the viewer at a time, for each worker.")
    access_log: bool = Field(False, description="Write each request to stderr, one JSON object a line.")
    cloud_memory: int = Field(
        512 * 1024 * 1024, ge=0, description="Bytes of workspace clouds kept for all visitors together."
    )
    allowed_origins: tuple[str, ...] = Field(
        (), description="Origins, besides our own, whose pages may open the viewer's websocket."
    )
