"""Who a client is, for limits per client: an IPv4 address, or an IPv6 network, within which a host may use any.

Behind a proxy, all connections come from the proxy's address, and the header ``X-Forwarded-For`` names the client.
Anybody can send that header. It counts only if the connection comes from a proxy the operator trusts.
"""

from __future__ import annotations

import ipaddress
import math
from collections.abc import Iterable
from functools import lru_cache

from starlette.types import Scope


@lru_cache(maxsize=4096)
def network_of(host: str) -> str:
    """The client at an address."""
    try:
        address = ipaddress.ip_address(host)
    except ValueError:
        return host
    if isinstance(address, ipaddress.IPv4Address):
        return host
    return str(address.ipv4_mapped or ipaddress.ip_network((address, 64), strict=False))


def client_of(scope: Scope) -> str:
    """The client of a request."""
    return network_of(str((scope.get("client") or ("unknown", 0))[0])[:64])


def host_name(host: bytes) -> str:
    """The name in a header ``Host``, without the port."""
    name = host.decode("latin-1").lower()
    return name[1:].partition("]")[0] if name.startswith("[") else name.partition(":")[0].rstrip(".")


def is_local_name(name: str) -> bool:
    """Whether each machine means itself by the name of a host."""
    try:
        return ipaddress.ip_address(name).is_loopback
    except ValueError:
        return name == "localhost" or name.endswith(".localhost")


def is_here(scope: Scope) -> bool:
    """Whether a request comes from this machine, under a name that no other machine can use, and by no proxy."""
    headers = dict(scope["headers"])
    names = (scope.get("client") or ("",))[0], host_name(headers.get(b"host", b""))
    return all(map(is_local_name, names)) and not headers.keys() & {b"x-forwarded-for", b"forwarded"}


def share_of(most: int, share: float) -> int:
    """How many of `most` places one client may take."""
    return max(1, math.ceil(most * share))


class Proxies:
    """The proxies that may name the client. Addresses and networks, as in ``10.0.0.0/8``."""

    def __init__(self, networks: Iterable[str]) -> None:
        self._networks = tuple(ipaddress.ip_network(each, strict=False) for each in networks)

    def __contains__(self, host: str) -> bool:
        if not self._networks:
            return False
        try:
            address = ipaddress.ip_address(host)
        except ValueError:
            return False
        return any(address in network for network in self._networks)
