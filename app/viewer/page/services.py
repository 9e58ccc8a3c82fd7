"""What all pages of a server share."""

from __future__ import annotations

from dataclasses import dataclass

from app.classroom import Hub
from app.classroom.courses import Courses
from app.live import Lines
from app.shared.clouds import Clouds
from app.shared.maps import Maps
from app.shared.store import Store
from app.shared.summaries import Summaries
from app.viewer.meshes.library.library import Library
from app.viewer.meshes.reader import MeshReader
from app.viewer.scene.motion import Pace


@dataclass(frozen=True)
class Services:
    """The robots, the caches of expensive results, the readers of meshes, the frame rate, courses with their
    exercises, the live state of classrooms, and the lines to programs."""

    store: Store
    clouds: Clouds
    maps: Maps
    summaries: Summaries
    meshes: MeshReader
    library: Library
    pace: Pace
    courses: Courses
    classroom: Hub
    lines: Lines
