"""The one place that talks to yt-dlp: what an address holds, and the file behind it.

yt-dlp's Python API, quiet, with our retries around it: a server that is busy, silent or cuts the
line is retried after 1, 2, 4 ... times the back-off (or when it says; once where the name
cannot be resolved), and a file goes on where it stopped. Every failure becomes one line of reason.
Sizes in bytes, times in seconds.
"""

import logging
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from pydantic import Field

from robojackson.clips.web.address_guard import public_only, refusal
from robojackson.clips.web.cookie_file import open_cookies
from robojackson.clips.web.download_formats import FormatConfig, Purpose, choose
from robojackson.clips.web.request_failures import explain
from robojackson.clips.web.untrusted_text import clean_text, safe_name
from robojackson.clips.web.yt_dlp_options import fixed_options, hide_ffmpeg
from robojackson.config import config_dataclass
from robojackson.errors import DownloadFailed, SearchFailed

Progress = Callable[[int, int | None], None]
Result = TypeVar("Result")
BYTES_A_MEGABYTE = 1_000_000

log = logging.getLogger(__name__)


@config_dataclass
class WebConfig:
    """Limits towards the servers of others.

    Attributes:
        retries: How often a request that failed for now is made again.
        backoff_s: Wait before the first of them, seconds; it doubles each time.
        longest_wait_s: Longest wait that a server may request, seconds.
        timeout_s: Longest silence of a server, seconds.
        longest_download_s: Longest time that one file may take, seconds.
        rate_limit_bytes_s: Fastest download, bytes a second; None is no limit.
        request_pause_s: Pause between two requests for pages, seconds.
        largest_file_mb: A file beyond this is not downloaded, megabytes.
        cookies_file: Netscape cookie file whose cookies are sent; it is never written.
        proxy: Address of a proxy that is passed through.
        private_addresses: Whether addresses that are not of the public web may be connected to.
        language: Language of the titles, two letters; empty is the site's own choice.
    """

    retries: int = Field(default=4, ge=0)
    backoff_s: float = Field(default=2.0, ge=0)
    longest_wait_s: float = Field(default=60.0, ge=0)
    timeout_s: float = Field(default=20.0, gt=0)
    longest_download_s: float = Field(default=900.0, gt=0)
    rate_limit_bytes_s: float | None = Field(default=4e6, gt=0)
    request_pause_s: float = Field(default=0.5, ge=0)
    largest_file_mb: float = Field(default=300.0, gt=0)
    cookies_file: Path | None = None
    proxy: str | None = None
    private_addresses: bool = False
    language: str = ""


@dataclass(frozen=True)
class Offer:
    """A video with the format that was chosen of it.

    Attributes:
        name: `<format>.<suffix>`, fit to be a part of a path.
        info: All that yt-dlp knows, to be handed back to it.
    """

    name: str
    info: Mapping[str, Any]


def listing(address: str, config: WebConfig) -> dict[str, Any]:
    """Return what a search or a page holds, flat: no page of a video is opened, no video
    downloaded.

    Raises:
        SearchFailed: the message has the address and the reason.
        BadConfiguration: the cookie file cannot be read.
    """
    flat = {"extract_flat": "in_playlist"}
    try:
        return _patiently(lambda: _extract(address, _options(config) | flat), config)
    except DownloadFailed as cause:
        raise SearchFailed(f"{clean_text(address)}: {cause}") from cause


def offer(url: str, purpose: Purpose, formats: FormatConfig, config: WebConfig) -> Offer:
    """Return the format of a video that would be downloaded.

    Raises:
        DownloadFailed: there is no video, or the page cannot be read; the message is the reason.
        BadConfiguration: the cookie file cannot be read.
    """
    choice = {"format": _selector(purpose, formats)}
    info = _patiently(lambda: _extract(url, _options(config) | choice), config)
    if info.get("entries") is not None:
        raise DownloadFailed("a page of several videos, not one")
    if info.get("is_live"):
        raise DownloadFailed("a live stream")
    suffix = safe_name(info.get("ext") or "mp4")
    return Offer(f"{safe_name(info.get('format_id') or 'only')}.{suffix}", info)


def fetch(chosen: Offer, folder: Path, config: WebConfig, progress: Progress | None = None) -> Path:
    """Return the file of an offer; what an interrupted download left in the folder is continued.

    Raises:
        DownloadFailed: the message is the reason.
        BadConfiguration: the cookie file cannot be read.
    """
    target = folder / chosen.name
    template = str(target).replace("%", "%%")
    limit = int(config.largest_file_mb * BYTES_A_MEGABYTE)
    own = {
        "outtmpl": {"default": template},
        "format": str(chosen.info.get("format_id") or "best"),
        "max_filesize": limit,
        "ratelimit": config.rate_limit_bytes_s,
        "progress_hooks": [_watch(progress, config)],
    }
    _patiently(lambda: _download(chosen.info, _options(config) | own), config)
    if not target.is_file():
        raise DownloadFailed(f"larger than {config.largest_file_mb:g} MB, or nothing was sent")
    return target


def entries(info: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """Return the videos of a listing and of the listings in it, such as the tabs of a channel; a
    page of one video is a listing of one."""
    found = info.get("entries")
    if found is None:
        return [info]
    return [video for entry in found if entry for video in entries(entry)]


def _options(config: WebConfig) -> dict[str, Any]:
    """Return the options of one attempt: yt-dlp uses up the stream of cookies."""
    options = fixed_options() | {
        "socket_timeout": config.timeout_s,
        "sleep_interval_requests": config.request_pause_s,
    }
    if config.proxy:
        options["proxy"] = config.proxy
    if config.language:
        options["extractor_args"] = {"youtube": {"lang": [config.language]}}
        options["http_headers"] |= {"Accept-Language": config.language}
    if config.cookies_file:
        options["cookiefile"] = open_cookies(config.cookies_file)
    return options


def _extract(address: str, options: dict[str, Any]) -> dict[str, Any]:
    from yt_dlp import YoutubeDL

    with YoutubeDL(options) as ydl:
        info = ydl.extract_info(address, download=False)
        result: dict[str, Any] = ydl.sanitize_info(info)
        return result


def _download(info: Mapping[str, Any], options: dict[str, Any]) -> None:
    from yt_dlp import YoutubeDL

    hide_ffmpeg()
    with YoutubeDL(options) as ydl:
        ydl.process_ie_result(dict(info), download=True)


def _selector(purpose: Purpose, formats: FormatConfig) -> Callable[[Mapping[str, Any]], Any]:
    """Return our choice in the form that yt-dlp expects."""

    def select(context: Mapping[str, Any]) -> Any:
        chosen = choose(context["formats"], purpose, formats)
        return [] if chosen is None else [chosen]

    return select


def _watch(progress: Progress | None, config: WebConfig) -> Callable[[Mapping[str, Any]], None]:
    """Return a hook for yt-dlp that passes bytes on and stops a download that takes too long."""
    began = time.monotonic()

    def hook(state: Mapping[str, Any]) -> None:
        done = int(state.get("downloaded_bytes") or 0)  # decoded: a packed answer grows
        if progress and state.get("status") in ("downloading", "finished"):
            total = state.get("total_bytes") or state.get("total_bytes_estimate")
            progress(done, int(total) if total and done <= total else None)
        if done > config.largest_file_mb * BYTES_A_MEGABYTE:
            raise DownloadFailed(f"larger than {config.largest_file_mb:g} MB")
        if state.get("status") == "downloading":
            spent = time.monotonic() - began
            if spent > config.longest_download_s:
                raise DownloadFailed(f"not finished after {spent:.0f} s")

    return hook


def _patiently(attempt: Callable[[], Result], config: WebConfig) -> Result:
    """Return the result of an attempt, repeated while the failure may be temporary."""
    from yt_dlp.utils import YoutubeDLError

    for number in range(config.retries + 1):
        try:
            with public_only(config.private_addresses, config.proxy):
                return attempt()
        except (YoutubeDLError, OSError, ValueError, RecursionError) as cause:
            if refused := refusal(cause):
                raise refused from cause
            reason, transient, retry_after_s, most = explain(cause)
            if not transient or number >= min(config.retries, most):
                tried = f" ({number + 1} attempts)" if number else ""
                raise DownloadFailed(f"{reason}{tried}") from cause
            wait_s = min(max(config.backoff_s * 2**number, retry_after_s), config.longest_wait_s)
            log.info("%s; retrying in %.3g s", reason, wait_s)
            time.sleep(wait_s)
    raise AssertionError("unreachable")
