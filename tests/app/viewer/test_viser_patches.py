"""What is done past viser's own ways: the same messages and pages, exact, and none where nothing changed."""

from __future__ import annotations

import asyncio
import contextlib
import io
import typing

import numpy as np
import pytest
import viser
from bare_page import state_of
from viser import _assignable_props_api as props
from viser._messages import GuiUpdateMessage, TransformControlsUpdateMessage

from app.viewer.viser_patches import (
    SceneFilter,
    assign,
    cache_type_hints,
    keep_private,
    note_heard,
    sent_value,
    show_text,
    show_value,
)

PLACE, TURN = (0.1, -0.2, 0.3), (0.5, -0.5, 0.5, 0.5)


@pytest.fixture
def wire(monkeypatch):
    """A scene's messages as they go on the wire, and the scene."""
    with contextlib.redirect_stdout(io.StringIO()):
        server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    messages = []
    monkeypatch.setattr(server.scene, "_queue_scene_message", queue_into(messages, server.scene))
    yield messages, server.scene
    with contextlib.redirect_stdout(io.StringIO()):
        server.stop()


def queue_into(messages, scene):
    send = scene._queue_scene_message

    def queue(message):
        send(message)
        messages.append(message.as_serializable_dict())

    return queue


@pytest.mark.parametrize("given", [tuple, list, np.array])
def test_what_is_sent_is_what_the_setters_send(wire, given):
    messages, scene = wire
    node = scene.add_frame("/a")
    messages.clear()
    node.position, node.wxyz = PLACE, TURN
    expected = list(messages)
    assert [m["type"] for m in expected] == ["SetPositionMessage", "SetOrientationMessage"]
    other = scene.add_frame("/a")
    messages.clear()
    assign(other, given(PLACE), given(TURN))
    assert messages == expected
    assert other.position.tolist() == list(PLACE)
    assert other.wxyz.tolist() == list(TURN)


def test_the_smallest_step_is_sent_and_a_repetition_is_not(wire):
    messages, scene = wire
    node = scene.add_frame("/a")
    assign(node, PLACE, TURN)
    messages.clear()
    assign(node, PLACE, TURN)
    assign(node)
    assert messages == []
    near = (np.nextafter(PLACE[0], 1.0), *PLACE[1:])
    assign(node, near)
    assert [m["position"] for m in messages] == [near]


def test_the_array_given_can_be_used_again(wire):
    _, scene = wire
    node = scene.add_frame("/a")
    place = np.array(PLACE)
    assign(node, place)
    place[:] = 7.0
    assert node.position.tolist() == list(PLACE)


def test_a_removed_node_is_not_brought_back(wire):
    messages, scene = wire
    node = scene.add_frame("/a")
    node.remove()
    messages.clear()
    with pytest.raises(RuntimeError, match="/a was removed"):
        assign(node, PLACE)
    assert messages == []


def test_a_private_gizmo_repeats_nothing_and_is_heard_all_the_same(wire):
    messages, scene = wire
    heard = []
    for private, expected in ((False, ["SetOrientationMessage", "SetPositionMessage"]), (True, [])):
        gizmo = scene.add_transform_controls("/g")
        if private:
            keep_private(gizmo)

        @gizmo.on_update
        async def _(event):
            heard.append((event.phase, event.target.position.tolist()))

        messages.clear()
        moved = TransformControlsUpdateMessage("/g", wxyz=TURN, position=PLACE)
        asyncio.run(scene._handle_transform_controls_updates(7, moved))
        assert [m["type"] for m in messages] == expected
    assert heard == 2 * [("update", list(PLACE))]


def test_a_value_is_sent_as_the_setter_sends_it_and_no_callback_is_called(wire, monkeypatch):
    _, scene = wire
    gui, messages, called = scene._owner.gui, [], []
    monkeypatch.setattr(gui._websock_interface, "queue_message", messages.append)
    for value, given in ((1.5, np.float64(2.5)), (1.5, 2), (True, False), ("a", "b")):
        shown = []
        for show in (lambda handle, value: setattr(handle, "value", value), show_value):
            kind = {float: gui.add_number, bool: gui.add_checkbox, str: gui.add_text}[type(value)]
            handle = kind("label", value)
            messages.clear()
            show(handle, given)
            show(handle, given)
            (message,) = messages
            shown.append((type(message), message.updates, type(message.updates["value"]), handle.value))
            assert message.uuid == state_of(handle).uuid
            handle.on_update(lambda _: called.append("callback"))
        assert shown[0] == shown[1]
        show_value(handle, value)
    handle.remove()
    with pytest.raises(RuntimeError, match="GuiTextHandle was removed"):
        show_value(handle, "c")
    assert called == []


def test_text_of_a_label_is_sent_as_by_its_setter_and_once(wire):
    messages, scene = wire
    shown = []
    for show in (lambda handle, text: setattr(handle, "text", text), show_text):
        label = scene.add_label("/label", "old")
        messages.clear()
        show(label, "Δ 1 mm")
        show(label, "Δ 1 mm")
        (message,) = messages
        shown.append((message, label.text))
    assert shown[0] == shown[1]
    label.remove()
    with pytest.raises(RuntimeError, match="/label was removed"):
        show_text(label, "late")


def test_hints_are_looked_up_once_and_are_the_same(wire, monkeypatch):
    _, scene = wire
    monkeypatch.setattr(props, "get_type_hints", typing.get_type_hints)
    theirs = scene.add_frame("/theirs")._prop_hints
    cache_type_hints()
    first, second = scene.add_frame("/first"), scene.add_frame("/second")
    assert first._prop_hints is second._prop_hints
    assert first._prop_hints == theirs
    first.axes_length = 0.25
    assert first.axes_length == 0.25
    with pytest.raises(AttributeError):
        _ = first.no_such_thing


def seen_at_the_top(messages) -> dict[str, bool]:
    """What the messages make visible of the nodes at the top."""
    found = [m for m in messages if m["type"] == "SetSceneNodeVisibilityMessage" and m["name"] != "/WorldAxes"]
    return {m["name"]: m["visible"] for m in found if m["name"].count("/") == 1}


def test_behind_a_curtain_nothing_is_seen_and_all_is_as_its_owner_left_it(wire):
    messages, scene = wire
    shown, hidden, gone = (
        scene.add_frame("/shown"),
        scene.add_frame("/hidden", visible=False),
        scene.add_frame("/x"),
    )
    child = scene.add_frame("/shown/child")
    scene.add_light_directional("/lamp")

    def seen() -> dict[str, bool]:
        return seen_at_the_top(messages)

    assert seen() == {"/shown": True, "/hidden": False, "/x": True, "/lamp": True}
    scene_filter = SceneFilter(scene, "/wall-")
    assert seen() == {"/shown": False, "/hidden": False, "/x": False, "/lamp": True}
    assert shown.visible
    gone.remove()
    late = scene.add_frame("/late")
    scene.add_frame("/wall-1")
    hidden.visible, shown.visible, child.visible = True, False, False
    assert seen() == {
        **dict.fromkeys(("/shown", "/hidden", "/x", "/late"), False),
        "/lamp": True,
        "/wall-1": True,
    }
    late.visible = False
    messages.clear()
    scene_filter.open()
    assert seen() == {"/shown": False, "/hidden": True, "/late": False}
    late.visible = True
    assert seen()["/late"] is True


@pytest.mark.parametrize("first", [0, 1])
def test_two_filters_end_in_any_order(wire, first):
    messages, scene = wire
    for name in ("/wall-1", "/worked-1", "/arm"):
        scene.add_frame(name)
    filters = [SceneFilter(scene, "/wall-"), SceneFilter(scene, "/worked-")]
    filters.pop(first).open()
    kept, hidden = ("/wall-1", "/worked-1") if first else ("/worked-1", "/wall-1")
    seen = seen_at_the_top(messages)
    assert (seen[kept], seen[hidden], seen["/arm"]) == (True, False, False)
    filters.pop().open()
    assert seen_at_the_top(messages) == {"/wall-1": True, "/worked-1": True, "/arm": True}
    scene.add_frame("/late")
    assert seen_at_the_top(messages)["/late"]


@pytest.mark.parametrize(
    ("add", "first", "shown", "sent", "expected"),
    [
        ("add_slider", 1.0, 2.0, 7, 7.0),
        ("add_number", 1.0, 2.0, 7, 7.0),
        ("add_text", "a", "b", "typed", "typed"),
        ("add_checkbox", False, False, True, True),
        ("add_rgb", (1, 2, 3), (4, 5, 6), [7, 8, 9], (7, 8, 9)),
    ],
)
def test_a_value_that_was_sent_arrives_though_another_is_shown_meanwhile(wire, add, first, shown, sent, expected):
    gui = wire[1]._owner.gui
    more = {"min": 0.0, "max": 10.0, "step": 0.1} if add == "add_slider" else {}
    handle = getattr(gui, add)("Value", initial_value=first, **more)
    # Viser calls this between the value and the callbacks; in a page, another thread may come in between.
    state_of(handle).sync_cb = lambda *_: show_value(handle, shown)
    got = []

    async def changed(event):
        got.append((event.target.value, sent_value(event)))

    handle.on_update(changed)
    gui._resolve_client = lambda _: object()

    async def hear(message):
        note_heard(message)
        await gui._handle_gui_updates(0, message)

    asyncio.run(hear(GuiUpdateMessage(state_of(handle).uuid, {"value": sent})))
    assert got == [(shown, expected)]
    assert type(got[0][1]) is type(expected)

    async def no_message():
        return sent_value(viser.GuiEvent(None, None, handle))

    assert asyncio.run(no_message()) == shown, "without a message, what is shown"
