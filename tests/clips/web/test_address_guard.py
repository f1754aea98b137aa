"""No connection to an address that is not of the public web, however it is reached."""

import socket
from pathlib import Path

import pytest

from robojackson.clips.web.address_guard import PrivateAddress, is_public, public_only
from robojackson.clips.web.download_formats import FormatConfig
from robojackson.clips.web.yt_dlp_client import _watch, offer
from robojackson.errors import DownloadFailed
from tests.fixtures.web_server import PATIENT, Web, WebConfig

STRICT = WebConfig(retries=0, timeout_s=2.0, request_pause_s=0.0)
PRIVATE = (
    *("127.0.0.1", "10.0.0.1", "192.168.1.1", "172.16.0.1", "169.254.169.254", "0.0.0.0"),
    *("::1", "fe80::1%eth0", "fc00::1", "::ffff:127.0.0.1", "2002:7f00:1::", "100.64.0.1"),
    *("224.0.0.1", "255.255.255.255", "::ffff:10.0.0.1"),
    *("64:ff9b::127.0.0.1", "64:ff9b::a9fe:a9fe", "::127.0.0.1", "::"),
)


@pytest.mark.parametrize("address", PRIVATE)
def test_private_addresses_are_known(address: str) -> None:
    assert not is_public(address)


@pytest.mark.parametrize("address", ["8.8.8.8", "1.1.1.1", "2606:4700::1111", "64:ff9b::8.8.8.8"])
def test_public_addresses_are_known(address: str) -> None:
    assert is_public(address)


@pytest.mark.parametrize("host", ["127.0.0.1", "localhost", "2130706433", "0x7f000001", "0177.1"])
def test_every_way_to_write_this_machine_is_refused(host: str) -> None:
    with (
        public_only(allowed=False),
        pytest.raises(PrivateAddress, match="no address of the public"),
    ):
        socket.create_connection((host, 9), 1.0)


def test_the_guard_ends_and_lets_a_proxy_be() -> None:
    with public_only(allowed=False, proxy="http://127.0.0.1:3128"):
        assert socket.getaddrinfo("127.0.0.1", 3128)
    with public_only(allowed=False):
        pass
    assert socket.getaddrinfo("127.0.0.1", 9)


@pytest.mark.parametrize("named", ["http://127.0.0.1:3128", "127.0.0.1:3128"])
def test_a_proxy_of_the_environment_may_be_anywhere(
    named: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("HTTPS_PROXY", named)
    monkeypatch.setenv("NO_PROXY", "localhost")
    monkeypatch.setenv("CORP_PROXY", "http://localhost:auto")
    with public_only(allowed=False):
        assert socket.getaddrinfo("127.0.0.1", 3128)
        with pytest.raises(PrivateAddress):
            socket.getaddrinfo("localhost", 3128)
    with public_only(allowed=False, proxy="8.8.8.8:3128"), pytest.raises(PrivateAddress):
        socket.getaddrinfo("127.0.0.1", 3128)


def test_a_private_page_is_not_requested(web: Web) -> None:
    with pytest.raises(DownloadFailed, match=r"web\.private_addresses=true"):
        offer(f"{web.url}/moved/clip.mp4", "score", FormatConfig(), STRICT)
    assert web.requests == []


def test_configuration_allows_it(web: Web) -> None:
    assert offer(f"{web.url}/moved/clip.mp4", "score", FormatConfig(), PATIENT).name
    assert web.times("/good/clip.mp4")


def test_a_packed_answer_is_counted_as_it_is_unpacked(tmp_path: Path) -> None:
    calls: list[tuple[int, int | None]] = []
    hook = _watch(lambda done, total: calls.append((done, total)), WebConfig(largest_file_mb=1.0))
    hook({"status": "downloading", "downloaded_bytes": 900_000, "total_bytes": 400_000})
    assert calls == [(900_000, None)]
    with pytest.raises(DownloadFailed, match="larger than 1 MB"):
        hook({"status": "downloading", "downloaded_bytes": 1_100_000, "total_bytes": 400_000})
