"""`examples/mujoco_arm.py`: its physics against statics by the Jacobian, and a page whose program it follows."""

from __future__ import annotations

import csv
import re
import signal
import threading
from _thread import interrupt_main
from xml.etree import ElementTree

import mujoco_arm
import numpy as np
import pytest
from live_code import code_of
from mujoco_arm import Simulation

import kin

G = 9.81  # m/s²
UR5 = kin.get_robot("ur5")
FAR = np.radians([0.0, -20.0, 30.0, -10.0, 20.0, 0.0])  # stretched out


@pytest.mark.parametrize("name", ["ur5", "puma560", "scara", "so101"])
def test_a_payload_loads_each_joint_by_the_jacobian(name):
    robot = kin.get_robot(name)
    for q in robot.random_q(np.random.default_rng(3), 5):
        more = Simulation(robot, payload=2.0).needed(q) - Simulation(robot).needed(q)
        assert more == pytest.approx(kin.jacobian(robot, q)[2] * 2.0 * G, abs=1e-6)


def test_an_arm_at_rest_is_held_by_the_torques_that_it_needs():
    arm = Simulation(UR5, payload=3.0)
    arm.start(FAR)
    arm.advance(FAR, 3.0)
    assert arm.torque == pytest.approx(arm.needed(arm.q), abs=0.05)
    stiffness = arm.effort / 0.05  # a servo gives all it has at 0.05 rad
    assert FAR - arm.q == pytest.approx(arm.torque / stiffness, abs=1e-4)
    assert arm.overloaded(FAR) == []
    assert arm.tool == pytest.approx(kin.fk(UR5, arm.q)[:3, 3], abs=1e-9)


def test_a_payload_that_is_too_heavy_is_named_and_sinks():
    arm = Simulation(UR5, payload=30.0)
    heavy = arm.overloaded(FAR)
    total = Simulation(UR5).needed(FAR) + kin.jacobian(UR5, FAR)[2] * 30.0 * G
    assert [i for i, _ in heavy] == np.flatnonzero(np.abs(total) > [150, 150, 150, 28, 28, 28]).tolist() == [1]
    assert re.fullmatch(r"shoulder needs \d+ N m to hold this, and has 150 N m", heavy[0][1])
    arm.start(FAR)
    arm.advance(FAR, 1.0)
    assert kin.fk(UR5, arm.q)[2, 3] < kin.fk(UR5, FAR)[2, 3] - 0.2
    assert np.abs(arm.torque).max() == pytest.approx(150.0)
    assert (np.abs(arm.torque) <= arm.effort + 1e-9).all()


def test_gravity_along_all_axes_loads_nothing():
    arm = Simulation(kin.get_robot("planar2r"), payload=500.0)
    assert arm.overloaded(np.array([0.3, 0.2])) == []


def test_what_is_invented_is_said():
    arm = Simulation(kin.get_robot("so101"))
    assert arm.invented == [joint.name for joint in arm.robot.joints]
    said = arm.facts(0.0, known=False)
    assert "invented: 1000 kg/m³ in each capsule" in said
    assert "invented for shoulder pan, shoulder lift" in said
    assert arm.overloaded(arm.robot.q_home) == []
    stated = Simulation(UR5, mass=18.4)
    assert stated.mass == 18.4
    assert "invented" not in stated.facts(0.0, known=True)
    assert stated.needed(FAR) == pytest.approx(Simulation(UR5).needed(FAR) * 18.4 / Simulation(UR5).mass)


def test_a_command_far_away_is_approached_little_faster_than_the_joints_turn():
    arm = Simulation(UR5)
    arm.start(UR5.q_home)
    goal = UR5.q_home + 2.0 * np.eye(6)[0]
    moved = []
    for _ in range(150):
        before = arm.q[0]
        arm.advance(goal, 0.01)
        moved.append((arm.q[0] - before) / 0.01)
    assert UR5.joints[0].velocity < max(moved) < 1.3 * UR5.joints[0].velocity
    assert arm.q[0] == pytest.approx(goal[0], abs=0.01)


def drawn(page, kind):
    """The texts of the drawings of a kind."""
    nodes = [m for n, m in page.nodes.items() if re.search(r"/connect-\d+/drawn", n) and page.visible.get(n, True)]
    return [m["props"].get("text", "") for m in nodes if m["type"] == kind]


def press(page, name, *index, value=None):
    page.say("feature", ["program", [name, *index, len(page.log)], value])


@pytest.mark.full
def test_a_program_of_the_page_is_followed_and_measured(viewer, page, tmp_path, capsys):
    """The ghost is behind the commanded arm; the terminal has the errors, the files have all values."""
    plot, table = tmp_path / "tracking.svg", tmp_path / "tracking.csv"
    words = [code_of(page), "--address", f"http://127.0.0.1:{viewer}", "--payload", "2"]
    codes = []
    thread = threading.Thread(
        target=lambda: codes.append(mujoco_arm.main([*words, "--plot", str(plot), "--csv", str(table)]))
    )
    moves = "".join(f"[[segments]]\nkind = 'ptp'\nq = {(FAR + x).tolist()}\n" for x in (0.0, 0.4))
    press(page, "upload", value=["two.toml", moves])
    press(page, "go", 0)
    page.wait(lambda: bool(np.allclose(page.tool_pose(), kin.fk(UR5, FAR), atol=1e-5)))
    thread.start()
    page.wait(lambda: "data-live-measured" in page.html)
    press(page, "play")
    page.wait(lambda: any(" N m of " in text for text in drawn(page, "LabelMessage")))
    assert len(drawn(page, "LineSegmentsMessage")) == 2
    assert len(drawn(page, "PointCloudMessage")) == 1
    said = ""

    def measured() -> bool:
        nonlocal said
        said += capsys.readouterr().out
        return "Saved: " in said

    page.wait(measured)
    page.send("GuiUpdateMessage", uuid=page.element("Withdraw the code"), updates={"value": True})
    thread.join(30.0)
    page.settle()
    assert codes == [1]
    assert "Payload: 2 kg at the tool." in said
    assert re.search(r"Program 1: .* Largest error: \d+\.\d° at \w+.* N m of (150|28) N m\.", said), said
    with table.open() as stream:
        head, *rows = csv.reader(stream)
    assert head == [
        "time",
        *(f"{kind} {j.name}" for kind in ("commanded", "measured", "torque") for j in UR5.joints),
    ]
    t, commanded, measured, torque = np.split(np.array(rows, dtype=float), [1, 7, 13], axis=1)
    assert commanded[-1] == pytest.approx(FAR + 0.4, abs=1e-4)
    assert commanded.max(axis=0)[0] - commanded.min(axis=0)[0] > 0.39
    error = np.abs(commanded - measured).max()
    assert 0.005 < error < 1.5
    assert f"Largest error: {np.degrees(error):.1f}°" in said
    assert (np.diff(t[:, 0]) > 0.0).all()
    assert (np.abs(torque) <= [150, 150, 150, 28, 28, 28]).all()
    picture = ElementTree.parse(plot).getroot()
    assert len(picture.findall("{http://www.w3.org/2000/svg}polyline")) == 12


def test_what_goes_wrong_is_one_line(viewer, page, capsys):
    address = ["--address", f"http://127.0.0.1:{viewer}"]
    assert mujoco_arm.main(["AAAA-AAAA", *address]) == 1
    assert mujoco_arm.main(["AAAA-AAAA", "--address", "http://127.0.0.1:9"]) == 1
    wrong, absent, hint = capsys.readouterr().err.splitlines()
    assert "code" in wrong
    assert "no connection to 127.0.0.1:9" in absent
    assert "Is Kinboard running" in hint
    for words in (["A", "--payload", "-1"], ["A", "--payload", "nan"], ["A", "--mass", "0"], []):
        with pytest.raises(SystemExit) as ended:
            mujoco_arm.main(words)
        assert ended.value.code == 2
    assert "argument --payload: got '-1', expected a number that is 0 or more" in capsys.readouterr().err


def test_ctrl_c_ends_cleanly(viewer, page, monkeypatch, capsys):
    steps, advance = [], Simulation.advance

    def interrupted(arm, q, seconds) -> None:
        advance(arm, q, seconds)
        steps.append(seconds)
        if len(steps) == 30:
            interrupt_main()

    monkeypatch.setattr(Simulation, "advance", interrupted)
    # A shell starts what runs in the background with Ctrl+C switched off, and so perhaps these tests.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        assert mujoco_arm.main([code_of(page), "--address", f"http://127.0.0.1:{viewer}"]) == 0
    finally:
        signal.signal(signal.SIGINT, before)
    assert len(steps) == 30
    assert capsys.readouterr().out.endswith("Ended.\n")
    page.settle()
    assert "data-live-measured" not in page.html
    assert not drawn(page, "LabelMessage")


def test_another_arm_of_the_page_is_simulated_in_its_place(viewer, page, capsys):
    words = [code_of(page), "--address", f"http://127.0.0.1:{viewer}"]
    codes, said = [], ""
    thread = threading.Thread(target=lambda: codes.append(mujoco_arm.main(words)))
    thread.start()
    page.wait(lambda: "data-live-measured" in page.html)
    page.set("Robot", kin.get_robot("scara").name)

    def simulated() -> list[str]:
        nonlocal said
        said += capsys.readouterr().out
        return re.findall("Largest torques: .*", said)

    page.wait(lambda: len(simulated()) == 2)
    assert "150 N m" in simulated()[0]
    assert "invented for shoulder, elbow, quill, tool turn" in simulated()[1]
    page.wait(lambda: "data-live-measured" in page.html)
    page.send("GuiUpdateMessage", uuid=page.element("Withdraw the code"), updates={"value": True})
    thread.join(30.0)
    page.settle()
    assert codes == [1]
    assert "The page has withdrawn the code." in capsys.readouterr().err
