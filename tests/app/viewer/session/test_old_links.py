"""Links of earlier versions restore what they restored then: one for each lesson and tab, recorded in a file.

``tests/data/links.json`` has the links as they were given out, and the states of the features that the page had
with them. To record new ones::

    python tests/app/viewer/session/test_old_links.py

A version that breaks a link must not be recorded: what it restores differs from what the page showed.
"""

from __future__ import annotations

import json
import sys
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pytest

if __name__ == "__main__":
    sys.path[:0] = [str(Path(__file__).parents[k]) for k in (2, 3, 4)]

from fake_browser import FakeBrowser
from live_server import serve_viewer

from app.shared.clouds import Clouds
from app.shared.settings import Settings
from app.shared.store import Store
from app.viewer.server import ViewerServer
from app.viewer.session.choices import ViewState
from app.viewer.session.state import PageState, decode, encode
from kin.units import Units

pytestmark = pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection")

STORE = Store()
FILE = Path(__file__).parents[3] / "data" / "links.json"
ANGLES = [0.3, -1.1, 0.7, 0.2, -0.4, 0.9]
# Settings other than the usual ones, by the name of the case.
CASES: dict[str, PageState] = {
    "velocity": PageState(
        robot="ur5",
        lesson="velocity",
        features={
            "velocity": {
                "frame": "tool",
                "ellipsoid": "moment",
                "joint": 3,
                "step": 0.02,
                "turn": 0.1,
                "statics": {"on": True, "force": [1.0, -2.0, 3.5]},
            },
            "guide": {"joints": True},
        },
    ),
    "velocity without an ellipsoid": PageState(
        robot="scara", lesson="velocity", features={"velocity": {"ellipsoid": "none", "joint": 4, "step": 0.001}}
    ),
    "redundancy": PageState(robot="iiwa14", lesson="redundancy", features={"redundancy": {"free": "psi"}}),
    "rotations": PageState(
        robot="irb120",
        lesson="rotations",
        features={
            "rotations": {
                "convention": "zyz-moving",
                "angles": [0.1, 0.2, -0.3],
                "chained": False,
                "chain": [],
                "motion": "Shift along x",
                "own": False,
                "turn": 1.0,
                "shift": -0.3,
            }
        },
    ),
    "rotations, a chain": PageState(
        robot="irb120",
        lesson="rotations",
        features={"rotations": {"chained": True, "chain": [[True, 2, 0.5, True], [False, 0, 0.25, False]]}},
    ),
    "numeric": PageState(
        robot="planar2r",
        lesson="numeric",
        features={
            "numeric": {
                "method": "transpose",
                "damping": 0.2,
                "gain": 0.5,
                "longest": 0.3,
                "limits": True,
                "match": "point",
                "start": [0.5, 0.8],
                "at": 3,
                "compare": True,
                "picture": False,
            }
        },
    ),
    "postures": PageState(
        robot="ur5",
        lesson="postures",
        features={"postures": {"ghosts": True, "cone": False, "hidden": ["shoulder_left/elbow_up/wrist_flip"]}},
    ),
    "postures of five joints": PageState(
        robot="pioneer5", lesson="postures", features={"postures": {"ghosts": False, "cone": False}}
    ),
    "screws": PageState(
        robot="scara",
        lesson="screws",
        features={"screws": {"form": "body", "axes": "now", "joint": 3, "factors": 2}},
    ),
    "equations": PageState(robot="pioneer5", lesson="equations", features={"equations": {"equation": "3.9"}}),
    "trajectories": PageState(robot="irb120", lesson="trajectories", features={"trajectories": {"paths": True}}),
    "dh": PageState(
        robot="ur5",
        lesson="dh",
        features={"dh": {"at": 4, "symbols": True, "compare": True, "speed": 2.0, "lines": True}},
    ),
    "inverse": PageState(robot="ur5", lesson="inverse", features={"inverse": {"all": True}}),
    "inverse, another branch": PageState(
        robot="puma560",
        lesson="inverse",
        features={
            "inverse": {
                "q": [0.3, 0.2, 0.4, -0.5, 0.6, 0.7],
                "signs": [-1, -1, 1],
                "all": False,
                "taken": {"2": -2.5},
            },
            "guide": {"step": 2, "given": {"2": -2.5}, "revealed": ["1"]},
        },
    ),
    "workspace": PageState(
        robot="irb120",
        features={
            "workspace": {
                "n": 30000,
                "strategy": "halton",
                "seed": 5,
                "by": "manipulability",
                "map": "viridis",
                "size": 0.005,
                "axis": "x",
                "at": 0.1,
                "keep": "above",
                "compare": "ur5",
                "sizes": True,
                "section": True,
                "axes": True,
                "clicks": False,
                "drawn": False,
                "capability": {
                    "resolution": 15,
                    "directions": 48,
                    "by": "manipulability",
                    "least": 0.3,
                    "drawn": False,
                },
            }
        },
    ),
    "program": PageState(robot="ur5", features={"program": {"loop": True, "rate": 0.5, "ghosts": True}}),
    "the page": PageState(
        robot="ur5",
        q=np.array(ANGLES),
        task="position",
        locks=(0, 2),
        units=Units(False, "cm"),
        view=ViewState(frames=True, labels=False, axes=False, dark=True, base_axes=True, look="both", avoid=True),
    ),
}


def restored(port: int, link: str) -> PageState:
    """What a page has after it has opened a link and rested."""
    tab = FakeBrowser(port, memory=json.dumps({"address": "http://127.0.0.1/", "state": link}))
    with closing(tab):
        tab.wait(lambda: any(node["type"] == "TransformControlsMessage" for node in tab.nodes.values()))
        tab.settle()
        before = len(tab.kept)
        # Any change makes the page store its state; this one is taken back.
        tab.set("Frame labels", not tab.value("Frame labels"))
        tab.wait(lambda: len(tab.kept) > before)
        tab.settle()
        before = len(tab.kept)
        tab.set("Frame labels", not tab.value("Frame labels"))
        tab.wait(lambda: len(tab.kept) > before)
        return decode(tab.kept[-1], STORE.robots)


def described(state: PageState) -> dict[str, Any]:
    """What a link is about, as JSON: everything but the viewpoint."""
    found: dict[str, Any] = json.loads(
        json.dumps(
            {
                "robot": state.robot,
                "lesson": state.lesson,
                "task": state.task,
                "locks": state.locks,
                "units": [state.units.degrees, state.units.length],
                "view": vars(state.view),
                "q": None if state.q is None else [round(x, 6) for x in state.q.tolist()],
                "features": state.features,
            }
        )
    )
    return found


LATER = {
    "rotations": {"axes": "all"},
    "workspace": {"postures": {"plane": "vertical", "limits": True, "drawn": True}},
}  # settings that links did not have when these were recorded
RECORDED: dict[str, Any] = json.loads(FILE.read_text(encoding="utf-8")) if FILE.exists() else {}


def test_there_is_a_link_for_every_lesson_and_tab() -> None:
    from app.viewer.lessons import LESSONS

    assert {lesson.key for lesson in LESSONS} <= set(RECORDED)
    assert {"workspace", "program", "the page"} <= set(RECORDED)


@pytest.mark.full
@pytest.mark.parametrize("case", RECORDED)
def test_a_recorded_link_restores_what_it_did(port: int, case: str) -> None:
    recorded = RECORDED[case]
    before = recorded["restored"]
    before["view"] = vars(ViewState()) | before["view"]  # choices that came later are as at first
    for feature, later in LATER.items():
        if feature in before["features"]:
            before["features"][feature] = {**later, **before["features"][feature]}
    found = described(restored(port, recorded["link"]))
    found["features"].get("guide", {}).pop("arm", None)  # the one that is asked about, where it is not on show
    assert found == before


if __name__ == "__main__":
    with serve_viewer(ViewerServer(STORE, Settings(), Clouds())) as number:
        for name, state in CASES.items():
            text = encode(state)
            RECORDED[name] = {"link": text, "restored": described(restored(number, text))}
            print(name, json.dumps(RECORDED[name]["restored"]["features"]))
    FILE.write_text(json.dumps(RECORDED, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
