"""`robojackson trackers`: the pinned file, whole or not at all, from the web or from a copy."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from robojackson.cli.trackers.tracker_files import add_tracker
from robojackson.errors import BadPolicy, DownloadFailed, MissingDependency, StoreError, UnknownName
from robojackson.pipeline import tracker_descriptions
from robojackson.pipeline.tracker_descriptions import describe_tracker, require_tracker
from robojackson.rl.trackers import onnx_network
from robojackson.rl.trackers.tracker_file import open_tracker, tracker_path
from tests.fixtures.commands import Said, in_process
from tests.fixtures.stand_in_tracker import NAME, stand_in, write_network, write_yaml
from tests.fixtures.web_server import Web, serving

FEEDBACK = dict.fromkeys(
    ("dancer", "regulator", "regulator_g1_23", "regulator_onboard", "regulator_t1"), True
)
"""Trackers without a file, or with one that ships, which are always here."""


@pytest.fixture
def network(tmp_path: Path) -> Path:
    """Return the file that the stand-in's YAML pins."""
    return stand_in(tmp_path)[0]


@pytest.fixture
def web(network: Path) -> Iterator[Web]:
    """Yield a server that has the file."""
    with serving(network.read_bytes()) as running:
        yield running


@pytest.fixture
def pin(tmp_path: Path, web: Web, monkeypatch: pytest.MonkeyPatch) -> Callable[..., Path]:
    """Return a writer of `configs/trackers/standin.yaml` for a kind of server; it returns the
    file's place."""
    monkeypatch.setenv("ROBOJACKSON_STORE", str(tmp_path / "store"))
    monkeypatch.setenv("ROBOJACKSON_CONFIGS", str(tmp_path / "configs"))

    def write(kind: str = "good", **change: object) -> Path:
        _, description = stand_in(tmp_path)
        file = replace(description.file, url=f"{web.url}/{kind}/network.onnx", **change)
        description = replace(description, file=file)
        write_yaml(description, tmp_path / "configs")
        return tracker_path(description)

    return write


def names_in(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def test_the_file_is_downloaded_once_and_can_be_run(pin, web: Web, network: Path) -> None:
    path = pin()
    first, again = add_tracker(NAME), add_tracker(NAME)
    assert (first["added"], again["added"], first["licence"]) == (True, False, "ours")
    assert path.read_bytes() == network.read_bytes()
    assert len(web.requests) == 1
    assert names_in(path.parent) == ["network.onnx"]


def test_without_what_runs_it_nothing_is_downloaded(
    pin, web: Web, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The file was fetched and shared first; it then was each dance's default, which failed."""
    path = pin()
    monkeypatch.setattr(onnx_network, "has_runtime", lambda: False)
    with pytest.raises(MissingDependency, match=r"pip install 'robojackson\[trackers\]'"):
        add_tracker(NAME)
    assert (web.requests, path.exists()) == ([], False)


def test_a_network_that_cannot_run_here_is_no_default(pin, monkeypatch) -> None:
    pin()
    add_tracker(NAME)
    both = [describe_tracker(NAME), replace(describe_tracker("regulator"), robot="humanoid")]
    monkeypatch.setattr(tracker_descriptions, "default_trackers", lambda robot: both)
    found = []
    for runs in (True, False):
        monkeypatch.setattr(tracker_descriptions, "has_runtime", lambda runs=runs: runs)
        found.append(require_tracker("humanoid"))
    assert [each and each.name for each in found] == [NAME, "regulator"]


def test_a_download_that_was_cut_off_goes_on_where_it_ended(pin, web: Web, network: Path) -> None:
    path = pin("half-once")
    add_tracker(NAME)
    half = len(network.read_bytes()) // 2
    assert [requested for _, requested in web.requests] == [None, f"bytes={half}-"]
    assert path.read_bytes() == network.read_bytes()


def test_the_same_command_goes_on_from_what_an_earlier_one_left(pin, web, network: Path) -> None:
    path = pin()
    path.parent.mkdir(parents=True)
    path.with_name("network.onnx.part").write_bytes(network.read_bytes()[:100])
    add_tracker(NAME)
    assert web.requests[0][1] == "bytes=100-"
    assert path.read_bytes() == network.read_bytes()
    assert names_in(path.parent) == ["network.onnx"]


def test_a_server_that_ends_too_early_is_one_line_and_keeps_the_part(pin) -> None:
    path = pin("wrong-length")
    with pytest.raises(DownloadFailed, match=r"cut off after [\d,]+ of [\d,]+ bytes") as caught:
        add_tracker(NAME)
    assert "the same command goes on" in str(caught.value)
    assert names_in(path.parent) == ["network.onnx.part"]


@pytest.mark.parametrize("pinned", [{"sha256": "0" * 64}, {"size": 100}, {"size": 100_000}])
def test_another_file_than_the_pinned_one_leaves_nothing_that_is_used(pin, pinned) -> None:
    path = pin(**pinned)
    with pytest.raises(DownloadFailed) as caught:
        add_tracker(NAME)
    assert "\n" not in str(caught.value)
    assert not path.exists()


def test_a_wrong_digest_names_both(pin) -> None:
    pin(sha256="0" * 64)
    with pytest.raises(DownloadFailed, match=r"its sha256 is [0-9a-f]{64}, expected 0{64}"):
        add_tracker(NAME)


@pytest.mark.parametrize(("kind", "words"), [("missing", "HTTP 404"), ("broken", "HTTP 503")])
def test_a_refusal_is_one_line_with_its_code(pin, kind: str, words: str) -> None:
    pin(kind)
    with pytest.raises(DownloadFailed, match=words):
        add_tracker(NAME)


def test_offline_is_one_line(pin) -> None:
    path = pin()
    write_yaml_for_a_closed_port(path, pin)
    with pytest.raises(DownloadFailed, match=r"cannot be downloaded: .*; check the network"):
        add_tracker(NAME)


def write_yaml_for_a_closed_port(path: Path, pin: Callable[..., Path]) -> None:
    """Let the YAML name a port at which no one answers."""
    yaml = next((path.parents[3] / "configs" / "trackers").glob("*.yaml"))
    lines = yaml.read_text().splitlines()
    result = ["  url: http://127.0.0.1:9/x" if "  url:" in line else line for line in lines]
    yaml.write_text("\n".join(result))


def test_a_copy_that_the_user_has_is_checked_and_taken(pin, web: Web, network: Path) -> None:
    path = pin()
    assert add_tracker(NAME, network)["added"] is True
    assert (path.read_bytes(), web.requests) == (network.read_bytes(), [])


def test_a_foreign_copy_is_one_line(pin, tmp_path: Path) -> None:
    path = pin()
    other = write_network(tmp_path / "other.onnx", 5, 2)
    with pytest.raises(BadPolicy, match="is not the file that tracker 'standin' pins"):
        add_tracker(NAME, other)
    with pytest.raises(StoreError, match="cannot read"):
        add_tracker(NAME, tmp_path / "none.onnx")
    assert not path.exists()
    assert not path.parent.exists()


def test_an_altered_file_is_refused_and_added_again(pin, tmp_path: Path, network: Path) -> None:
    path = pin()
    add_tracker(NAME)
    path.write_bytes(network.read_bytes()[:-1])
    with pytest.raises(BadPolicy, match="altered; run: robojackson trackers add standin"):
        open_tracker(stand_in(tmp_path)[1])
    assert add_tracker(NAME)["added"] is True


def test_without_the_file_the_error_is_the_command_that_brings_it(pin, tmp_path: Path) -> None:
    pin()
    with pytest.raises(BadPolicy, match=r"not installed .*; run: robojackson trackers add standin"):
        open_tracker(stand_in(tmp_path)[1])


def test_an_unknown_tracker_lists_those_that_are(pin) -> None:
    pin()
    with pytest.raises(
        UnknownName,
        match=r"unknown tracker 'twist3'.*regulator_onboard, regulator_t1, standin, twist2",
    ):
        add_tracker("twist3")


def test_the_list_says_robot_licence_training_and_whether_it_is_here(pin, network: Path) -> None:
    pin()
    before, found = listed(), in_process("trackers").out
    assert before == {**FEEDBACK, "standin": False, "twist2": False}
    assert all(word in found for word in ("g1", "MIT", "AMASS", "robojackson trackers add twist2"))
    assert in_process("trackers", "add", NAME, "--file", network).code == 0
    assert listed() == {**FEEDBACK, "standin": True, "twist2": False}


def test_a_tracker_without_a_file_has_nothing_to_add() -> None:
    result = in_process("trackers", "add", "regulator", "--json")
    assert (result.code, result.answer["added"], result.answer["file"]) == (0, False, "")
    with pytest.raises(BadPolicy, match="'regulator' takes no file"):
        add_tracker("regulator", Path("README.md"))


def listed() -> dict[str, bool]:
    result: Said = in_process("trackers", "--json")
    return {each["tracker"]: each["ready"] for each in result.answer["trackers"]}
