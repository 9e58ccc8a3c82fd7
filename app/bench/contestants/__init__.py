"""One way of one library to do a task. A library that is not installed is left out; that is no error.

The call that a user of the library would write is timed, on one thread, with inputs already in the library's own
form; `Contestant.read` turns its answer into our joints afterwards, untimed. If a library returns an object from
which the configurations have to be fetched, fetching them is timed as well.

To add a library, write a function from `Task` to its contestants (none for tasks it cannot do) and add a row to
`PEERS`.
"""

from app.bench.contestants import closed_forms, collisions, iterative, motions, ours
from app.bench.contestants.contestant import OURS, SOLVE_IK, Contestant, Peer, quiet
from app.bench.rows import MOTIONS, Task

__all__ = ["FLOOR", "KINBOARD", "OURS", "PEERS", "SOLVE_IK", "Contestant", "Peer", "quiet"]


def _toolbox(task: Task) -> list[Contestant]:
    if task.row.kind in MOTIONS:
        return motions.toolbox(task)
    return iterative.toolbox(task) + closed_forms.toolbox_analytic(task)


KINBOARD = Peer("kinboard", "kin", ours.ours)
FLOOR = Peer("floor", "kin", ours.floor)
PEERS: tuple[Peer, ...] = (
    Peer("numpy", "numpy", ours.plain_numpy),
    Peer("pin", "pinocchio", iterative.pinocchio),
    Peer("coal", "coal", collisions.coal),
    Peer("vamp-planner", "vamp", collisions.vamp, extra=False),
    Peer("eaik", "eaik", closed_forms.eaik),
    Peer("ssik", "ssik", closed_forms.ssik),
    Peer("ik-geo", "ik_geo", closed_forms.ik_geo),
    Peer("py-opw-kinematics", "py_opw_kinematics", closed_forms.opw),
    Peer("roboticstoolbox-python", "roboticstoolbox", _toolbox),
    Peer("ruckig", "ruckig", motions.ruckig),
    Peer("toppra", "toppra", motions.toppra),
    Peer("roboplan", "roboplan.toppra", motions.roboplan),
    Peer("ikpy", "ikpy", iterative.ikpy),
)
