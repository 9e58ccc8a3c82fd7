"""The learning platforms that may launch Kinboard: a TOML file of the operator's, and our key beside it."""

from __future__ import annotations

import json
import os
import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from cryptography.hazmat.primitives import serialization
from cryptography.hazmat.primitives.asymmetric import rsa
from jwt.algorithms import RSAAlgorithm

_ADDRESSES = ("login_url", "token_url", "keys_url")
_FIELDS = ("name", "issuer", "client_id", "deployments", *_ADDRESSES)
KEY_BITS = 2048
LOCAL = ("127.0.0.1", "::1", "localhost")
PORTS = {"https": 443, "http": 80}
_NEVER = frozenset(" \"'<>\\^`{|}")  # in addresses (RFC 3986)
_HOST = re.compile(r"[a-z0-9_]([a-z0-9_.-]*[a-z0-9_])?|[0-9a-f:.]*:[0-9a-f:.]*", re.ASCII)
HostPort = tuple[str, int]


class PlatformFileError(ValueError):
    """The file is invalid; the message names the field, the value and what is valid."""


@dataclass(frozen=True)
class Platform:
    """One registration with one platform.

    Attributes:
        deployments: ids of its deployments.
        login_url, token_url, keys_url: the platform's addresses for authentication, access tokens and public keys.
    """

    name: str
    issuer: str
    client_id: str
    deployments: tuple[str, ...]
    login_url: str
    token_url: str
    keys_url: str

    @property
    def places(self) -> frozenset[HostPort]:
        """Hosts that the operator names; they may be in a private network."""
        named = map(place_of, (self.issuer, self.login_url, self.token_url, self.keys_url))
        return frozenset(place for place in named if place is not None)


@dataclass(frozen=True)
class Platforms:
    """All registrations, and the key that signs for us."""

    all: tuple[Platform, ...]
    key: rsa.RSAPrivateKey

    def find(self, issuer: str, client_id: str) -> Platform | None:
        """The registration; without a client id, the only one of this issuer."""
        found = [each for each in self.all if each.issuer == issuer and client_id in ("", each.client_id)]
        return found[0] if len(found) == 1 else None

    @property
    def key_id(self) -> str:
        """Names our public key."""
        return str(self.public_key()["n"])[:16]

    def public_key(self) -> dict[str, Any]:
        """Our public key as a JWK, without its id."""
        found: dict[str, Any] = json.loads(RSAAlgorithm.to_jwk(self.key.public_key()))
        return found

    def key_set(self) -> dict[str, Any]:
        """What platforms fetch."""
        public = {"kty": "RSA", **{name: self.public_key()[name] for name in ("n", "e")}}
        return {"keys": [{**public, "kid": self.key_id, "alg": "RS256", "use": "sig"}]}


def load_platforms(path: Path) -> Platforms:
    """Read the file; raises `PlatformFileError`."""
    try:
        data = tomllib.loads(path.read_text("utf-8"))
    except (OSError, ValueError) as error:
        raise PlatformFileError(f"{path}: {error}") from error
    if unknown := set(data) - {"key", "platform"}:
        raise PlatformFileError(f"{path}: {sorted(unknown)[0]}: the file has the fields key and platform only")
    rows = data.get("platform", [])
    if not isinstance(rows, list) or not all(isinstance(row, dict) for row in rows):
        raise PlatformFileError(f"{path}: platform: write each platform as a table [[platform]]")
    platforms = tuple(_platform(row, f"{path}: platform {i}") for i, row in enumerate(rows, 1))
    if len({(each.issuer, each.client_id) for each in platforms}) < len(platforms):
        raise PlatformFileError(f"{path}: two platforms have the same issuer and client_id")
    return Platforms(platforms, _key(key_file(path, data)))


def key_file(path: Path, data: Mapping[str, Any]) -> Path:
    """Where our private key is: named in the file, relative to it."""
    name = data.get("key", "lti-key.pem")
    if not isinstance(name, str) or not name:
        raise PlatformFileError(f"{path}: key: got {name!r}; it must be the name of a PEM file")
    return path.parent / name


def make_key(path: Path) -> bool:
    """Write a new private key that only its owner can read, unless there is one; returns whether it did."""
    key = rsa.generate_private_key(65537, KEY_BITS)
    form = serialization.PrivateFormat.PKCS8
    text = key.private_bytes(serialization.Encoding.PEM, form, serialization.NoEncryption())
    try:
        descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    except FileExistsError:
        return False
    with os.fdopen(descriptor, "wb") as file:
        file.write(text)
    return True


def _key(path: Path) -> rsa.RSAPrivateKey:
    try:
        key = serialization.load_pem_private_key(path.read_bytes(), None)
    except FileNotFoundError:
        raise PlatformFileError(f"{path}: there is no private key; `kinboard lti` makes one") from None
    except (OSError, ValueError, TypeError) as error:
        raise PlatformFileError(f"{path}: not a private key in PEM form without a password: {error}") from error
    if not isinstance(key, rsa.RSAPrivateKey) or key.key_size < KEY_BITS:
        raise PlatformFileError(f"{path}: an RSA key of at least {KEY_BITS} bits is needed")
    return key


def _platform(row: Mapping[str, Any], where: str) -> Platform:
    if unknown := set(row) - set(_FIELDS):
        raise PlatformFileError(f"{where}: {sorted(unknown)[0]}: the fields are {', '.join(_FIELDS)}")
    for name in _FIELDS:
        value = row.get(name, "" if name == "name" else None)
        listed = name == "deployments" and isinstance(value, list) and value
        if not (listed and all(isinstance(each, str) for each in value)) and not (
            name != "deployments" and isinstance(value, str) and (value or name == "name")
        ):
            valid = "a list of one or more texts" if name == "deployments" else "a text"
            raise PlatformFileError(f"{where}: {name}: got {value!r}; it must be {valid}")
    for name in _ADDRESSES:
        if not is_safe(row[name]):
            raise PlatformFileError(
                f"{where}: {name}: got {row[name]!r}; it must be an address with https://, in ASCII"
            )
    values = {name: row[name] for name in _FIELDS if name in row}
    return Platform(**{"name": row["issuer"], **values, "deployments": tuple(row["deployments"])})


def place_of(address: str) -> HostPort | None:
    """The host and port of an address with http or https; None if it is none, or contains more than it should."""
    if not (address.isascii() and address.isprintable()) or not _NEVER.isdisjoint(address):
        return None
    try:
        parts = urlsplit(address)
        host, port = parts.hostname or "", parts.port or PORTS.get(parts.scheme, 0)
    except ValueError:
        return None
    return (host, port) if port and _HOST.fullmatch(host) and "@" not in parts.netloc else None


def is_safe(address: str) -> bool:
    """Whether we may send something secret to this address: HTTPS, or this machine."""
    place = place_of(address)
    return place is not None and (urlsplit(address).scheme == "https" or place[0] in LOCAL)


def origin_of(address: str) -> str:
    """The origin of a safe address, as a content security policy names it."""
    parts, place = urlsplit(address), place_of(address)
    assert place is not None, address
    host = f"[{place[0]}]" if ":" in place[0] else place[0]
    return f"{parts.scheme}://{host}" + (f":{place[1]}" if place[1] != PORTS[parts.scheme] else "")
