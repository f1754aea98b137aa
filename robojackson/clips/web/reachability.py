"""Check that a site can be reached: one attempt, before anything costly begins.

A search without a network would otherwise start Prefect's server, and retry again and again.
"""

import socket
import threading
import urllib.request
from contextlib import suppress
from urllib.parse import urlsplit

from robojackson.clips.web.address_guard import host_and_port, host_of
from robojackson.clips.web.untrusted_text import clean_text
from robojackson.errors import SearchFailed

PATIENCE_S = 5.0
"""For name resolution and connection together; a network that works takes well under one second."""
ADVICE = (
    "check the network (behind a proxy: HTTPS_PROXY=http://HOST:PORT), or use videos "
    "of this machine: `robojackson find FOLDER --source folder`, `robojackson dance FILE`"
)


def require_reachable(page: str, proxy: str | None = None, patience_s: float = PATIENCE_S) -> None:
    """Connect to the host of a page, or to the proxy in front of it, once.

    Args:
        page: Address of the page.
        proxy: Address of a proxy; without one, what the environment names is used.
        patience_s: Longest wait, seconds.
    Raises:
        SearchFailed: there is no connection; the line has the reason and what to do.
    """
    host = urlsplit(page).hostname or ""
    through = proxy or _usual_proxy(page, host)
    reason = _refusal(through or page, patience_s)
    if reason:
        via = f" through the proxy {_named(through)}" if through else ""
        raise SearchFailed(f"no connection to {clean_text(host)}{via} ({reason}): {ADVICE}")


def _named(proxy: str) -> str:
    """Return the host of a proxy; what was given without a password, where it is no address."""
    with suppress(ValueError):
        return host_of(proxy)
    return clean_text(proxy.rpartition("@")[2])


def _usual_proxy(page: str, host: str) -> str:
    """Return the proxy that the environment names for a page; empty where it names none."""
    if urllib.request.proxy_bypass(host):
        return ""
    proxies = urllib.request.getproxies()
    return proxies.get(urlsplit(page).scheme) or proxies.get("all") or ""


def _refusal(address: str, patience_s: float) -> str:
    """Return why no connection could be made; empty where one was.

    In a thread, since name resolution has no time limit of its own.
    """
    found: list[str] = []
    thread = threading.Thread(
        target=lambda: found.append(_attempt(address, patience_s)), daemon=True
    )
    thread.start()
    thread.join(patience_s)
    return found[0] if found else f"no answer in {patience_s:g} s"


def _attempt(address: str, patience_s: float) -> str:
    try:
        socket.create_connection(host_and_port(address), patience_s).close()
    except (OSError, ValueError) as cause:
        detail = cause.strerror if isinstance(cause, OSError) and cause.strerror else str(cause)
        return clean_text(detail or type(cause).__name__)
    return ""
