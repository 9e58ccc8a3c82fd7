"""One request to a learning platform: bounded in time and size, without redirects, never into a private network.

A platform names addresses in what it signs, such as the column for a score. Our request to them starts inside of
the operator's network, so an address there is refused unless the operator has written it into the file of
platforms. The name is looked up once: the connection goes to the addresses that were checked. Where a proxy is set
(`HTTPS_PROXY`), the proxy connects, and decides what may be reached.

A timeout of a socket begins anew with each byte. So a timer cuts the connection off when the whole exchange has
taken too long.
"""

from __future__ import annotations

import contextlib
import ipaddress
import socket
import ssl
import threading
import urllib.request
from collections.abc import Mapping, Set
from functools import cache
from http.client import HTTPConnection, HTTPException, HTTPResponse, HTTPSConnection
from typing import Any, Self
from urllib.error import HTTPError

from app.classroom.lti.platforms import HostPort, is_safe, place_of
from kin.parsing import Limits

PATIENCE = 10.0  # s for the whole exchange
MOST = 256 * 1024  # bytes of an answer
LIMITS = Limits(MOST, 20_000, 16)  # of JSON in it
_MOST_ADDRESSES = 4  # of one name that are tried
_NAT64 = ipaddress.ip_network("64:ff9b::/96")


class PlatformError(Exception):
    """The platform did not answer, or refused.

    Attributes:
        final: whether trying again is useless.
        general: whether other requests to this platform would fail too.
    """

    def __init__(self, message: str, final: bool = False) -> None:
        super().__init__(message)
        self.final = final
        self.general = False


def ask(
    address: str,
    trusted: Set[HostPort],
    body: bytes | None = None,
    headers: Mapping[str, str] | None = None,
    seconds: float = PATIENCE,
) -> bytes:
    """The body of the answer; with a `body`, the request is a POST. Raises `PlatformError`.

    Args:
        trusted: hosts and ports that may be in a private network.
    """
    if not is_safe(address):
        raise PlatformError(f"the address {address[:200]!r} is not HTTPS", final=True)
    request = urllib.request.Request(address, body, {"Accept": "application/json", **(headers or {})})
    with _Line(trusted | _proxies(), seconds) as line:
        try:
            with line.opener().open(request, timeout=seconds) as answer:
                found: bytes = answer.read(MOST + 1)
        except HTTPError as error:
            with error:
                raise _refusal(error.code) from None
        except _PrivateAddressError as error:
            raise PlatformError(str(error), final=True) from None
        except (OSError, HTTPException, ValueError) as error:
            if isinstance(reason := getattr(error, "reason", None), _PrivateAddressError):
                raise PlatformError(str(reason), final=True) from None
            words = f"there was no answer within {seconds:g} s" if line.cut_off else str(reason or error)
            raise PlatformError(f"the platform cannot be reached: {words}") from None
        if line.cut_off:  # which looks like the end of an answer
            raise PlatformError(f"the platform cannot be reached: its answer took longer than {seconds:g} s")
    if len(found) > MOST:
        raise PlatformError(f"the platform's answer is larger than {MOST} bytes")
    return found


def _refusal(status: int) -> PlatformError:
    if 300 <= status < 400:
        return PlatformError(f"the platform answered {status}: redirects are not followed", final=True)
    return PlatformError(f"the platform answered {status}", final=400 <= status < 500 and status != 429)


class _PrivateAddressError(OSError):
    """A name of the platform's leads into a private network."""


class _Line:
    """The connection of one exchange."""

    def __init__(self, trusted: Set[HostPort], seconds: float) -> None:
        self._trusted = trusted
        self._lock = threading.Lock()
        self._held: list[socket.socket] = []  # copies, which stay ours when TLS takes the socket
        self.cut_off = False
        self._timer = threading.Timer(seconds, self._cut)
        self._timer.daemon = True

    def __enter__(self) -> Self:
        self._timer.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._timer.cancel()
        with self._lock:
            for each in self._held:
                each.close()
            self._held.clear()

    def opener(self) -> urllib.request.OpenerDirector:
        """What sends requests over this line."""
        return urllib.request.build_opener(_NoRedirects, _Http(self), _Https(self))

    def connect(self, where: HostPort, timeout: float, *_: object) -> socket.socket:
        """A connection to an allowed address of this host."""
        host, port = place = where[0].lower(), where[1]
        found = {str(info[4][0]): None for info in socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)}
        allowed = [each for each in found if place in self._trusted or is_public(each)]
        if not allowed:
            raise _PrivateAddressError(
                f"{host} is {', '.join(found)[:100]}, in a private network, and not in the file of platforms"
            )
        error: OSError | None = None
        for address in allowed[:_MOST_ADDRESSES]:
            try:
                made = socket.create_connection((address, port), timeout)
            except OSError as failed:
                error = failed
                continue
            with self._lock:
                if self.cut_off:
                    made.close()
                    raise TimeoutError
                self._held.append(made.dup())
            return made
        assert error is not None
        raise error

    def _cut(self) -> None:
        with self._lock:
            self.cut_off = True
            for each in self._held:
                with contextlib.suppress(OSError):  # the other side may have closed it
                    each.shutdown(socket.SHUT_RDWR)


class _NoRedirects(urllib.request.HTTPRedirectHandler):
    """What is sent is secret: it goes to the address that the operator or the platform gave, and nowhere else."""

    def redirect_request(self, *_: object) -> None:
        return None


class _Http(urllib.request.HTTPHandler):
    def __init__(self, line: _Line) -> None:
        super().__init__()
        self._line = line

    def http_open(self, req: urllib.request.Request) -> HTTPResponse:
        return self.do_open(_over(self._line, HTTPConnection), req)


class _Https(urllib.request.HTTPSHandler):
    def __init__(self, line: _Line) -> None:
        super().__init__(context=_tls())
        self._line = line

    def https_open(self, req: urllib.request.Request) -> HTTPResponse:
        return self.do_open(_over(self._line, HTTPSConnection), req, context=_tls())


def _over(line: _Line, kind: Any) -> Any:
    """Connections of this kind of `http.client`, made over a line. TLS checks the name, not the address."""

    def make(host: str, **options: Any) -> HTTPConnection:
        made = kind(host, **options)
        made._create_connection = line.connect  # as its own tests replace it
        return made  # type: ignore[no-any-return]

    return make


@cache
def _tls() -> ssl.SSLContext:
    return ssl.create_default_context()


def _proxies() -> Set[HostPort]:
    """The operator's proxies, which may be in the private network."""
    named = urllib.request.getproxies().values()
    places = {place_of(each if "://" in each else f"http://{each}") for each in named}
    return {each for each in places if each is not None}


def is_public(address: str) -> bool:
    """Whether an IP address is one of the internet, also where it stands for an IPv4 address."""
    found = ipaddress.ip_address(address.partition("%")[0])
    if isinstance(found, ipaddress.IPv6Address):
        inner = found.ipv4_mapped or found.sixtofour
        if found in _NAT64:
            inner = ipaddress.IPv4Address(int(found) & 0xFFFFFFFF)
        if inner is not None:
            return is_public(str(inner))
    return found.is_global and not found.is_multicast
