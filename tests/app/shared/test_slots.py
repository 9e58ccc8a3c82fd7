"""Slots that are shared among clients."""

from __future__ import annotations

import asyncio

import pytest
from hypothesis import given
from hypothesis import strategies as st

import app.shared.slots
from app.shared.slots import Slot, Slots


def test_one_client_takes_its_share():
    slots = Slots(4, 0.75)
    assert [slots.take("a") for _ in range(5)] == [True, True, True, False, False]
    assert slots.take("b")
    assert not slots.free("b")
    slots.give_back("a")
    assert slots.free("a")
    assert slots.free("b")


def test_the_client_with_the_fewest_places_is_next():
    async def run() -> list[str]:
        slots = Slots(2)
        served: list[str] = []

        async def use(client: str) -> None:
            await slots.wait(client)
            served.append(client)

        for client in ("a", "a"):
            await use(client)
        waiting = [asyncio.create_task(use(client)) for client in ("a", "a", "a", "b", "c")]
        await asyncio.sleep(0)
        for client in ("a", "b", "c", "a"):
            slots.give_back(client)
            await asyncio.sleep(0)
        for each in waiting:
            each.cancel()
        return served

    assert asyncio.run(run()) == ["a", "a", "b", "c", "a", "a"]


def test_a_client_with_many_requests_does_not_keep_the_only_slot():
    async def run() -> list[str]:
        slots = Slots(1)
        served: list[str] = []

        async def use(client: str) -> None:
            await slots.wait(client)
            served.append(client)
            await asyncio.sleep(0.001)
            slots.give_back(client)

        await asyncio.gather(*map(use, ("a", "a", "a", "a", "b", "b", "c")))
        return served

    assert asyncio.run(run()) == ["a", "b", "c", "a", "b", "a", "a"]


def test_a_client_at_its_share_waits_though_there_are_places():
    async def run() -> None:
        slots = Slots(4, 0.5)
        for _ in range(2):
            await slots.wait("a")
        waiting = asyncio.create_task(slots.wait("a"))
        await asyncio.sleep(0)
        assert slots.take("b")
        slots.give_back("b")
        await asyncio.sleep(0)
        assert not waiting.done()
        slots.give_back("a")
        await asyncio.wait_for(waiting, 1)
        assert slots.taken == 2

    asyncio.run(run())


@given(st.lists(st.sampled_from(["a", "b", "give a", "give b", "cancel"]), max_size=40), st.integers(1, 5))
def test_places_are_neither_lost_nor_invented(steps, most):
    async def run() -> None:
        slots = Slots(most, 0.6)
        held: dict[str, int] = {"a": 0, "b": 0}
        waiting: list[asyncio.Task[None]] = []

        async def use(client: str) -> None:
            await slots.wait(client)
            held[client] += 1

        for step in steps:
            if step in held:
                waiting.append(asyncio.create_task(use(step)))
            elif step == "cancel" and waiting:
                waiting.pop().cancel()
            elif step.startswith("give") and held[step[-1]]:
                held[step[-1]] -= 1
                slots.give_back(step[-1])
            for _ in range(3):
                await asyncio.sleep(0)
            assert slots.taken == sum(held.values()) <= most
            assert all(count <= slots.most_of_one for count in held.values())
        for each in waiting:
            each.cancel()
        await asyncio.gather(*waiting, return_exceptions=True)
        assert slots.taken == sum(held.values())

    asyncio.run(run())


@pytest.mark.parametrize("cancelled", [False, True])
def test_a_place_is_given_back_while_sending_takes_long(monkeypatch, cancelled):
    monkeypatch.setattr(app.shared.slots, "STILL", 0.01)

    async def run() -> None:
        slots, go = Slots(1), asyncio.Event()

        async def send() -> None:
            await go.wait()

        async def answer() -> None:
            await slots.wait("a")
            with Slot(slots, "a") as slot:
                await slot.lent(send)()
                assert slots.taken == 1

        answering = asyncio.create_task(answer())
        await asyncio.wait_for(slots.wait("b"), 5)  # while a sends
        go.set()
        await asyncio.sleep(0.05)
        assert not answering.done()  # it waits for its slot
        if cancelled:
            answering.cancel()
            await asyncio.gather(answering, return_exceptions=True)
        slots.give_back("b")
        await asyncio.gather(answering, return_exceptions=True)
        assert answering.cancelled() is cancelled
        assert slots.taken == 0

    asyncio.run(run())
