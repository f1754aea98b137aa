"""List the trackers of `configs/trackers`, and install the file of one."""

from pathlib import Path

from robojackson.errors import BadPolicy, StoreError
from robojackson.files.download import download
from robojackson.files.file_tree import FileTree, in_one_line
from robojackson.files.local_folder import sha256_of_file
from robojackson.files.store_files import copy_file_here, is_whole, share_file
from robojackson.pipeline.folder_lock import A_MOMENT, locked
from robojackson.pipeline.tracker_descriptions import describe_tracker, needs_runtime, tracker_names
from robojackson.rl.trackers.onnx_network import require_runtime
from robojackson.rl.trackers.tracker_description import TrackerDescription, TrackerFile
from robojackson.rl.trackers.tracker_file import (
    is_present,
    open_tracker,
    tracker_key,
    tracker_path,
)

LOCK = ".add.lock"
Entry = dict[str, str | bool]
"""Facts of a tracker by name."""


def list_trackers() -> list[Entry]:
    """Return every tracker: its robot, its licence, its training motions, whether it is
    installed."""
    return [_entry(describe_tracker(name)) for name in tracker_names()]


def tracker_lines(found: list[Entry]) -> list[str]:
    """Return the list of trackers as lines."""
    lines: list[str] = []
    width = max((len(str(entry["tracker"])) for entry in found), default=0)
    for entry in found:
        name = entry["tracker"]
        state = "ready" if entry["ready"] else f"robojackson trackers add {name}"
        lines.append(f"{name:<{width}} {entry['robot']:<8} {state}")
        facts = {"licence": entry["licence"], "trained on": entry["trained_on"]}
        lines += [f"{'':<{width}} {key:<10} {value}" for key, value in facts.items()]
        lines.append(f"{'':<{width}} {entry['homepage']}")
    return lines


def add_tracker(name: str, file: Path | None = None) -> Entry:
    """Install the file of a tracker in the store, for every machine that works with it; the
    expected file is not downloaded again.

    Args:
        file: A copy on this machine, instead of a download.

    Raises:
        UnknownName: there is no such tracker.
        DownloadFailed: the file cannot be downloaded, or the server sends another.
        BadPolicy: the copy is not the expected file.
        StoreError: the store cannot be written.
        MissingDependency: what runs it is not installed; nothing was downloaded.
    """
    tracker = describe_tracker(name)
    if needs_runtime(tracker):
        require_runtime()
    pinned, path, key = tracker.file, tracker_path(tracker), tracker_key(tracker)
    entry = {"tracker": name, "file": str(path or ""), "licence": tracker.licence}
    if pinned is None or pinned.url is None or path is None or key is None:
        if file is not None:
            raise BadPolicy(f"tracker {name!r} takes no file: it ships; leave out --file")
        open_tracker(tracker)
        return {**entry, "added": False}
    if file is not None and not path.is_file():
        _require_pinned(name, pinned, file)
    with in_one_line(f"cannot write {path.parent}"):
        path.parent.mkdir(parents=True, exist_ok=True)
    with locked(path.parent, LOCK, A_MOMENT, "another download of a tracker"):
        copy_file_here(key, pinned.sha256)
        if is_whole(path, pinned.sha256):
            return {**entry, "added": share_file(key)}
        if file is not None:
            _require_pinned(name, pinned, file)
            FileTree(path.parent).write(path.name, file)
        else:
            with in_one_line(f"cannot write {path}"):
                download(pinned.url, path, pinned.size, pinned.sha256)
        share_file(key)
    open_tracker(tracker)  # report a file that cannot be run now
    return {**entry, "added": True}


def _require_pinned(name: str, pinned: TrackerFile, file: Path) -> None:
    with in_one_line(f"cannot read {file}", StoreError):
        digest = sha256_of_file(file)
    if digest != pinned.sha256:
        raise BadPolicy(
            f"{file} is not the file that tracker {name!r} pins: its sha256 is {digest}, "
            f"expected {pinned.sha256}; {pinned.url} is its address"
        )


def _entry(tracker: TrackerDescription) -> Entry:
    facts = {key: getattr(tracker, key) for key in ("robot", "licence", "trained_on", "homepage")}
    return {"tracker": tracker.name, **facts, "ready": is_present(tracker)}
