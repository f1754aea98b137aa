"""The door for addresses of the web: no connection to an address that is not public.

A page may redirect to, or a name may mean, a machine of the user's own network. While the guard is
on, every name that this thread resolves is refused where any of its addresses is private; so is a
redirect, a second answer of a name server, and an address written as a number. What a proxy
connects to is the proxy's matter.
"""

import ipaddress
import re
import socket
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from http.client import HTTPResponse
from typing import Any
from urllib.parse import SplitResult, urlsplit

from robojackson.errors import DownloadFailed

WITH_IPV4 = (ipaddress.IPv6Network("64:ff9b::/96"), ipaddress.IPv6Network("::/96"))
"""Networks whose addresses end with an IPv4 address: NAT64 (RFC 6052), and the earliest form."""
PORTS = {"http": 80, "https": 443, "socks4": 1080, "socks5": 1080, "socks5h": 1080}
ADVICE = "web.private_addresses=true in the configuration allows it"
REFUSED = re.compile(f"\\S{{1,80}} is no address of the public web; {re.escape(ADVICE)}")
"""The guard's message, also inside a text of a library that does not attach the cause."""
_trusted: ContextVar[frozenset[str] | None] = ContextVar("trusted hosts of the guard", default=None)
_resolve = socket.getaddrinfo
Given = Any
"""What `getaddrinfo` takes and returns."""


class PrivateAddress(OSError):
    """A host of the web that is none of the public web."""


@contextmanager
def public_only(allowed: bool, proxy: str | None = None) -> Iterator[None]:
    """Let this thread connect to public addresses alone, inside the block.

    Args:
        allowed: Whether private addresses may be reached all the same.
        proxy: Address of the user's own proxy, which may be anywhere; those of the environment
            without it.

    Raises:
        DownloadFailed: an address was refused.
    """
    if allowed:
        yield
        return
    if socket.getaddrinfo is not _guarded:
        socket.getaddrinfo = _guarded
    token = _trusted.set(frozenset(_proxy_hosts(proxy)))
    try:
        yield
    finally:
        _trusted.reset(token)


@contextmanager
def opened(
    address: str | urllib.request.Request, allowed: bool, proxy: str | None, timeout_s: float
) -> Iterator[HTTPResponse]:
    """Yield what a server of the web sends, with the guard on.

    Args:
        allowed, proxy: As of `public_only`.
        timeout_s: Longest silence of the server, seconds.
    Raises:
        OSError, ValueError: it sends nothing; `PrivateAddress` where it is not public.
    """
    handlers = [urllib.request.ProxyHandler({"http": proxy, "https": proxy})] if proxy else []
    opener = urllib.request.build_opener(*handlers)
    with public_only(allowed, proxy), opener.open(address, timeout=timeout_s) as answer:
        yield answer


def _proxy_hosts(proxy: str | None) -> set[str]:
    """Return the hosts of a proxy, or of those that the environment names for the web."""
    named = urllib.request.getproxies()
    usual = [named[kind] for kind in ("http", "https", "all") if kind in named]
    found = set()
    for address in [proxy] if proxy else usual:
        with suppress(ValueError):
            found.add(host_of(address))
    return {host for host in found if host}


def host_of(address: str) -> str:
    """Return the host of an address; one without a scheme is a proxy's.

    Raises:
        ValueError: it is no address.
    """
    return _parts(address).hostname or ""


def host_and_port(address: str) -> tuple[str, int]:
    """Return the same with the port.

    Raises:
        ValueError: it is no address, or the port no number.
    """
    parts = _parts(address)
    return parts.hostname or "", parts.port or PORTS.get(parts.scheme, 80)


def _parts(address: str) -> SplitResult:
    return urlsplit(address if "://" in address else f"http://{address}")


def is_public(address: str) -> bool:
    """Return whether an IP address is one of the public web; an embedded IPv4 address counts."""
    found = ipaddress.ip_address(address.partition("%")[0])
    hidden = getattr(found, "ipv4_mapped", None) or getattr(found, "sixtofour", None)
    if any(found in network for network in WITH_IPV4):
        hidden = ipaddress.IPv4Address(int(found) & 0xFFFFFFFF)
    return (hidden or found).is_global and not found.is_multicast


def refusal(cause: BaseException) -> DownloadFailed | None:
    """Return the error of ours where the guard is behind an error of a library."""
    seen: BaseException | None = cause
    while seen is not None:
        if found := REFUSED.search(str(seen)):
            return DownloadFailed(found[0])
        seen = seen.__cause__ or seen.__context__
    return None


def _guarded(host: Given, *more: Given, **options: Given) -> Given:
    found = _resolve(host, *more, **options)
    trusted = _trusted.get()
    if trusted is not None and str(host) not in trusted:
        for place in found:
            if not is_public(str(place[4][0])):
                raise PrivateAddress(f"{str(host)[:80]} is no address of the public web; {ADVICE}")
    return found
