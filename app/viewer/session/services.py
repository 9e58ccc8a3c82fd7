"""What all pages of a server share."""

from __future__ import annotations

from dataclasses import dataclass

from app.shared.clouds import Clouds
from app.shared.maps import Maps
from app.shared.store import Store
from app.shared.summaries import Summaries
from app.viewer.scene.motion import Pace


@dataclass(frozen=True)
class Services:
    """The robots, the caches of expensive results, and the frame rate."""

    store: Store
    clouds: Clouds
    maps: Maps
    summaries: Summaries
    pace: Pace
