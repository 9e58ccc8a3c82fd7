"""The public keys of one platform, fetched when a launch needs them.

A launch that waits for keys holds no thread. One fetch is under way at a time, in a thread of its own; all
launches that need it wait for the same one, for a short time. A failure is remembered for a while, and so is a set
of keys: nobody can make us ask the platform, or wait for it, again and again. While the platform's server of keys
does not answer, keys that it published before go on counting.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import math
import threading
from concurrent.futures import Future

from jwt import PyJWK, PyJWKSet, PyJWTError

from app.classroom.clock import steady
from app.classroom.lti.exchange import LIMITS, PlatformError, ask
from app.classroom.lti.platforms import Platform
from kin.parsing import read_json

logger = logging.getLogger("kinboard.lti")

PATIENCE = 4.0  # s that a launch waits
FRESH, KEEP = 300.0, 3600.0  # s that keys count; while the platform does not answer
AGAIN, AGAIN_FAILED = 5.0, 20.0  # s between two fetches; after one that failed
MOST_WAITING = 40  # launches at a time


class PlatformAway(Exception):  # noqa: N818 - a finding, with a sentence for the page
    """The platform does not give its keys; `wait` says in how many seconds it is asked again."""

    def __init__(self, message: str, wait: float) -> None:
        super().__init__(message)
        self.wait = wait


class PlatformKeys:
    """Keys by their ids; for all threads and event loops."""

    def __init__(self, platform: Platform) -> None:
        self._platform = platform
        self._lock = threading.Lock()
        self._keys: dict[str, PyJWK] = {}
        self._fetched = self._ended = -math.inf  # when the keys came, and when the last fetch ended
        self._failure = ""
        self._fetch: Future[None] | None = None
        self._waiting = 0

    async def find(self, key_id: str) -> PyJWK | None:
        """The key; None if the platform does not publish it. Raises `PlatformAway`."""
        key = self._known(key_id, FRESH)
        if key is None and (fetch := self._begin()) is not None:
            await self._wait(fetch)
        key = key or self._known(key_id, KEEP)
        if key is None:
            self._raise_failure()
        return key

    def _known(self, key_id: str, seconds: float) -> PyJWK | None:
        with self._lock:
            return self._keys.get(key_id) if steady() - self._fetched < seconds else None

    def _begin(self) -> Future[None] | None:
        """The fetch that is under way, or a new one; None: the last one was a moment ago."""
        with self._lock:
            if self._fetch is None and steady() - self._ended >= (AGAIN_FAILED if self._failure else AGAIN):
                self._fetch = Future()
                self._fetch.set_running_or_notify_cancel()  # a launch that gives up cancels it for no other
                run = threading.Thread(
                    target=self._run, args=(self._fetch,), name="kinboard-lti-keys", daemon=True
                )
                run.start()
            return self._fetch

    async def _wait(self, fetch: Future[None]) -> None:
        with self._lock:
            if self._waiting >= MOST_WAITING:
                raise PlatformAway(f"Too many launches wait for the keys of {self._platform.name}.", PATIENCE)
            self._waiting += 1
        try:
            with contextlib.suppress(TimeoutError):
                await asyncio.wait_for(asyncio.wrap_future(fetch), PATIENCE)
        finally:
            with self._lock:
                self._waiting -= 1

    def _raise_failure(self) -> None:
        """Raise `PlatformAway` if the platform does not answer, or did not when it was last asked."""
        address = self._platform.keys_url
        with self._lock:
            if self._fetch is not None:
                raise PlatformAway(f"The platform does not answer: its keys at {address} have not come.", PATIENCE)
            if self._failure:
                wait = max(1.0, self._ended + AGAIN_FAILED - steady())
                raise PlatformAway(self._failure, wait)

    def _run(self, fetch: Future[None]) -> None:
        address = self._platform.keys_url
        failure, keys = f"The platform's keys at {address} cannot be read.", None
        try:
            keys = _parsed(ask(address, self._platform.places))
            failure = ""
        except PlatformError as error:
            failure = f"The platform's keys at {address} cannot be fetched: {error}."
        except (PyJWTError, ValueError, TypeError, AttributeError):
            # PyJWT takes the answer as it is: text, a list, or keys without the fields of a key.
            failure = f"What the platform has at {address} is not a set of public keys (JSON Web Key Set)."
        finally:
            with self._lock:
                self._failure, self._ended, self._fetch = failure, steady(), None
                if keys is not None:
                    self._keys, self._fetched = keys, self._ended
            fetch.set_result(None)
        if failure:
            logger.warning("a platform does not give its keys: %s", failure)


def _parsed(text: bytes) -> dict[str, PyJWK]:
    published = PyJWKSet.from_dict(read_json(text, LIMITS)).keys
    keys = {each.key_id: each for each in published if each.public_key_use in ("sig", None)}
    return {name: key for name, key in keys.items() if isinstance(name, str) and name}
