"""The clouds of the tab Workspace as values: what a step adds, what stays, and what is sent again."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from bare_page import BarePage, bare_page

import kin
from app.shared.clouds import SAMPLED, Cloud, Clouds
from app.viewer.declared.work import Wait
from app.viewer.tabs.workspace import cloud as clouds_of
from app.viewer.tabs.workspace.cloud import Drawn, Look, Stream, Wanted, begun, draw, stream
from app.viewer.tabs.workspace.colours import OWN
from app.viewer.tabs.workspace.cut import cut_of
from app.viewer.tabs.workspace.send_window import SendWindow
from app.viewer.tabs.workspace.tab import Workspace

PIONEER = kin.get_robot("pioneer5")
N = 3 * SAMPLED + 1000  # four parts
PLAIN = Look("one", "cividis", OWN)
ACROSS_Z = replace(PLAIN, cut=cut_of([PIONEER], "z", PIONEER.q_home))
ACROSS_X = replace(PLAIN, cut=cut_of([PIONEER], "x", PIONEER.q_home))


@pytest.fixture
def page() -> Iterator[BarePage]:
    with bare_page(PIONEER) as page:
        page.clouds = Clouds()  # type: ignore[attr-defined]
        yield page
        page.clouds.close()  # type: ignore[attr-defined]


@pytest.fixture
def clouds() -> Iterator[Clouds]:
    made = Clouds()
    yield made
    made.close()


def count(drawn: Drawn) -> list[int]:
    """The points in each sheet."""
    return [
        sum(len(props["points"]) for block in sheet.blocks.values() for props in block.slabs.values())
        for sheet in drawn.sheets
    ]


def steps(clouds: Clouds, drawn: Drawn, running: bool = True) -> Iterator[Drawn]:
    """Each value while a cloud is drawn."""
    for found in draw(clouds, drawn, drawn.limit(running), lambda: None):
        if found is not None:
            yield found


def fresh(look: Look, n: int = N) -> Drawn:
    return begun(Wanted(Cloud(PIONEER, n, seed=3), look), None)


def test_each_step_adds_points_and_their_order_is_that_of_the_cloud(clouds: Clouds) -> None:
    values = list(steps(clouds, fresh(PLAIN)))
    assert [one.points for one in values] == [SAMPLED, 2 * SAMPLED, 3 * SAMPLED, N]
    assert [one.sent for one in values] == [SAMPLED, SAMPLED, SAMPLED, 1000]
    assert count(values[-1]) == [N]
    blocks = values[-1].sheet.blocks.values()
    drawn = np.concatenate([block.slabs[0]["points"] for block in blocks])
    assert np.abs(drawn - Cloud(PIONEER, N, seed=3).slice(0, N).points).max() < 5e-4


def test_a_value_does_not_change_when_there_are_further_ones(clouds: Clouds) -> None:
    first, *_, last = steps(clouds, fresh(ACROSS_Z))
    assert first.points < last.points
    assert count(first) == [first.sent]
    assert count(last) == [N]


def test_the_points_of_a_cut_stay_until_those_of_the_next_one_are_complete(clouds: Clouds) -> None:
    *_, whole = steps(clouds, fresh(ACROSS_Z))
    values = list(steps(clouds, begun(Wanted(whole.cloud, ACROSS_X), whole)))
    assert all(one.old is whole.sheet for one in values[:-1])
    assert values[-1].old is None
    assert count(values[-1]) == [N]
    # A third cut before the second is complete: the first one is still there.
    half = values[len(values) // 2]
    third = begun(Wanted(whole.cloud, PLAIN), half)
    assert third.old is whole.sheet
    assert third.points == N
    assert count(list(steps(clouds, third))[-1]) == [N]


def test_a_paused_cloud_gets_its_look_and_no_more_points(clouds: Clouds) -> None:
    flow = steps(clouds, fresh(PLAIN))
    next(flow)
    half = next(flow)
    coloured = begun(Wanted(half.cloud, replace(PLAIN, by="radius")), half)
    values = list(steps(clouds, coloured, running=False))
    assert [one.points for one in values] == [2 * SAMPLED] * 2
    nodes = [block.slabs[0] for block in values[-1].sheet.blocks.values()]
    before = [block.slabs[0] for block in half.sheet.blocks.values()]
    assert all(a["points"] is b["points"] for a, b in zip(nodes, before, strict=True)), "only colours are sent"
    assert [one["colors"].shape for one in nodes] == [(SAMPLED, 3)] * 2
    assert [one.points for one in steps(clouds, values[-1])] == [3 * SAMPLED, N]


def test_a_pause_within_nodes_that_belong_together_completes_them(clouds: Clouds) -> None:
    flow = steps(clouds, fresh(ACROSS_Z))
    cut_short = next(one for one in flow if count(one)[0] > 0 and one.points < count(one)[0])
    *_, paused = steps(clouds, cut_short, running=False)
    assert count(paused) == [paused.points]
    assert paused.points < N
    *_, whole = steps(clouds, paused)
    assert count(whole) == [N]


def test_two_clouds_grow_side_by_side_and_a_new_look_goes_on_from_what_is_there(
    page: BarePage, clouds: Clouds
) -> None:
    window = SendWindow(page.client, lambda: None)
    own, other = Cloud(PIONEER, N, seed=3), Cloud(kin.get_robot("puma560"), N, seed=3)
    for one in (own, other):
        for i in range(one.parts):
            clouds.part(one, i).result()  # otherwise the one goes on while the other waits

    def run(wanted: list[Wanted], before: Stream | None, to: int = 2 * N) -> list[Stream]:
        values = list[Stream]()
        for found in stream(clouds, window, lambda: None, wanted, True, before):
            if not isinstance(found, Wait):
                values.append(found)
                if sum(one.points for one in found.clouds) >= to:
                    break
        return values

    values = run([Wanted(own, PLAIN), Wanted(other, PLAIN)], None)
    assert max(abs(one.clouds[0].points - one.clouds[1].points) for one in values) <= SAMPLED
    assert not values[0].clouds[0].parts, "what was drawn before goes at once"
    assert (values[-1].busy, values[-1].points) == (False, 2 * N)
    assert values[-1].seconds > 0.0
    alone = run([Wanted(own, PLAIN)], values[-1], N)[0]
    assert alone.clouds == values[-1].clouds[:1]
    assert alone.seconds == values[-1].seconds, "nothing comes"
    assert run([Wanted(other, PLAIN)], alone, 0)[0].seconds < alone.seconds, "that of another cloud begins anew"


def messages(page: BarePage) -> int:
    return page.sent.count("PointCloudMessage")


def test_points_are_not_sent_again_for_a_question_another_unit_or_the_same_state(page: BarePage) -> None:
    tab = page.open(Workspace)
    page.watch()
    page.restore({"n": 2000, "drawn": True, "axis": "z"})
    assert tab.facts.clouds[0].points == 2000
    sent = messages(page)
    assert sent > 10
    page.activity = SimpleNamespace(**{**vars(page.activity), "withheld": frozenset({"postures"})})
    tab.on_activity()
    page.rest()
    page.style(kin.units.Units(length="cm"))
    page.restore(tab.state())
    assert messages(page) == sent
    assert tab.facts.state == "done"
    page.restore({**tab.state(), "seed": 4})
    assert messages(page) > sent


def test_what_a_cut_hid_stays_hidden_while_the_next_one_is_sent(page: BarePage) -> None:
    tab = page.open(Workspace)
    page.restore({"n": 2000, "drawn": True, "axis": "z", "at": 0.1})
    (before,) = tab.facts.visible
    assert 0 < before.sum() < len(before)
    page.set("Cut", "across x")
    for key, value in page.events:
        tab.handle(key[2], value)
    page.events.clear()
    tab.tick(time.perf_counter())
    old, new = tab.facts.visible
    assert old is before
    assert len(new) == tab.settings.cut.count
    page.rest()
    assert len(tab.facts.visible) == 1
    page.set("Cut", "across z (level)")
    page.rest()
    assert [cut for cut, _ in tab.settings.seen] == [ACROSS_X.cut], "what is gone is forgotten"


def test_a_failing_colour_is_reported_once_and_tried_again_with_the_next_look(
    page: BarePage, monkeypatch: pytest.MonkeyPatch
) -> None:
    tab = page.open(Workspace)
    page.restore({"n": 2000, "drawn": True})

    def failing(*_: object) -> None:
        raise RuntimeError("out of paint")

    with monkeypatch.context() as patched:
        patched.setattr(clouds_of, "paint", failing)
        page.set("Colour by", "Height")
        with pytest.raises(RuntimeError, match="out of paint"):
            page.rest()
        page.rest()
        assert tab.facts.state == "done"
        assert tab.facts.clouds[0].points == 2000
    page.set("Colours", "viridis")
    page.rest()
    assert tab.facts.clouds[0].look.map == "viridis"
    assert tab.facts.clouds[0].done == 1
