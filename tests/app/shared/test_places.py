"""Places that are shared among clients."""

from __future__ import annotations

import asyncio

import pytest
from hypothesis import given
from hypothesis import strategies as st

import app.shared.places
from app.shared.places import Place, Places


def test_one_client_takes_its_share():
    places = Places(4, 0.75)
    assert [places.take("a") for _ in range(5)] == [True, True, True, False, False]
    assert places.take("b")
    assert not places.free("b")
    places.give_back("a")
    assert places.free("a")
    assert places.free("b")


def test_the_client_with_the_fewest_places_is_next():
    async def run() -> list[str]:
        places = Places(2)
        served: list[str] = []

        async def use(client: str) -> None:
            await places.wait(client)
            served.append(client)

        for client in ("a", "a"):
            await use(client)
        waiting = [asyncio.create_task(use(client)) for client in ("a", "a", "a", "b", "c")]
        await asyncio.sleep(0)
        for client in ("a", "b", "c", "a"):
            places.give_back(client)
            await asyncio.sleep(0)
        for each in waiting:
            each.cancel()
        return served

    assert asyncio.run(run()) == ["a", "a", "b", "c", "a", "a"]


def test_a_client_at_its_share_waits_though_there_are_places():
    async def run() -> None:
        places = Places(4, 0.5)
        for _ in range(2):
            await places.wait("a")
        waiting = asyncio.create_task(places.wait("a"))
        await asyncio.sleep(0)
        assert places.take("b")
        places.give_back("b")
        await asyncio.sleep(0)
        assert not waiting.done()
        places.give_back("a")
        await asyncio.wait_for(waiting, 1)
        assert places.taken == 2

    asyncio.run(run())


@given(st.lists(st.sampled_from(["a", "b", "give a", "give b", "cancel"]), max_size=40), st.integers(1, 5))
def test_places_are_neither_lost_nor_invented(steps, most):
    async def run() -> None:
        places = Places(most, 0.6)
        held: dict[str, int] = {"a": 0, "b": 0}
        waiting: list[asyncio.Task[None]] = []

        async def use(client: str) -> None:
            await places.wait(client)
            held[client] += 1

        for step in steps:
            if step in held:
                waiting.append(asyncio.create_task(use(step)))
            elif step == "cancel" and waiting:
                waiting.pop().cancel()
            elif step.startswith("give") and held[step[-1]]:
                held[step[-1]] -= 1
                places.give_back(step[-1])
            for _ in range(3):
                await asyncio.sleep(0)
            assert places.taken == sum(held.values()) <= most
            assert all(count <= places.most_of_one for count in held.values())
        for each in waiting:
            each.cancel()
        await asyncio.gather(*waiting, return_exceptions=True)
        assert places.taken == sum(held.values())

    asyncio.run(run())


@pytest.mark.parametrize("cancelled", [False, True])
def test_a_place_is_given_back_while_sending_takes_long(monkeypatch, cancelled):
    monkeypatch.setattr(app.shared.places, "STILL", 0.01)

    async def run() -> None:
        places, go = Places(1), asyncio.Event()

        async def send() -> None:
            await go.wait()

        async def answer() -> None:
            await places.wait("a")
            with Place(places, "a") as place:
                await place.lent(send)()
                assert places.taken == 1

        answering = asyncio.create_task(answer())
        await asyncio.wait_for(places.wait("b"), 5)  # while a sends
        go.set()
        await asyncio.sleep(0.05)
        assert not answering.done()  # it waits for its place
        if cancelled:
            answering.cancel()
            await asyncio.gather(answering, return_exceptions=True)
        places.give_back("b")
        await asyncio.gather(answering, return_exceptions=True)
        assert answering.cancelled() is cancelled
        assert places.taken == 0

    asyncio.run(run())
