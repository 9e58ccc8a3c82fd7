"""The address at which other machines of the network reach this one."""

from __future__ import annotations

import ipaddress
import socket
from pathlib import Path

ANY = ("", "0.0.0.0", "::")  # hosts that stand for all addresses of this machine
# Files that Docker and Podman put into containers, whose own address means nothing outside.
CONTAINERS = (Path("/.dockerenv"), Path("/run/.containerenv"))
_OUTSIDE = ("192.0.2.1", 9)  # an address of documentation (RFC 5737); nothing is sent to it


def address_here() -> str | None:
    """This machine's IPv4 address in its network; None if it has none, or in a container."""
    if any(file.exists() for file in CONTAINERS):
        return None
    try:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            probe.connect(_OUTSIDE)  # chooses the network interface, and with it our address
            found = str(probe.getsockname()[0])
    except OSError:  # no network
        return None
    address = ipaddress.ip_address(found)
    return None if address.is_loopback or address.is_unspecified else found


def url_for_others(host: str, port: int, prefix: str) -> str | None:
    """The URL of a service on `host` for other machines; None if there is none, or it is not known."""
    found = address_here() if host in ANY else None
    return None if found is None else f"http://{found}:{port}{prefix}/"
