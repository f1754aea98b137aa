"""Starts from networks of the hub, with a local server that speaks the hub's protocol."""

from pathlib import Path

import gymnasium
import huggingface_hub.file_download
import pytest
from sb3_contrib import TQC

from robojackson.errors import BadPolicy, MissingDependency
from robojackson.files import tables
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.pipeline.yaml_loader import load
from robojackson.rl.config.train_config import TrainConfig
from robojackson.rl.pretrained import pretrained
from robojackson.rl.tqc.network_arrays import load_networks
from robojackson.rl.training import train_policy
from robojackson.robot.model import Robot
from tests.fixtures.commands import robojackson
from tests.fixtures.hub import serving

pytestmark = pytest.mark.xdist_group("hub")

REPOSITORY = "somebody/Humanoid-v5-TQC-tiny"
ZIP = f"{REPOSITORY}/resolve/main/humanoid-v5-TQC-tiny.zip"
BRIEF = {"mode": "paper", "trainer": "sb3", "steps": 16, "tqc.batch": 8}
REFUSAL = f"start '{REPOSITORY}' cannot be fetched from the hub"


@pytest.fixture(scope="module")
def theirs(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """Return a zip that sb3-contrib wrote."""
    path = tmp_path_factory.mktemp("theirs") / "model.zip"
    stock = gymnasium.make("Humanoid-v5")
    TQC("MlpPolicy", stock, policy_kwargs={"net_arch": [16, 12]}, device="cpu").save(path)
    return path.read_bytes()


def at(address: str, cache: Path, patch: pytest.MonkeyPatch) -> None:
    """Set the hub's address and cache, as HF_ENDPOINT and HF_HOME do at start-up."""
    constants = huggingface_hub.constants
    usual = constants.HUGGINGFACE_CO_URL_TEMPLATE.removeprefix(constants.ENDPOINT)
    patch.setattr(constants, "ENDPOINT", address)
    patch.setattr(huggingface_hub.file_download, "HUGGINGFACE_CO_URL_TEMPLATE", address + usual)
    patch.setattr(constants, "HF_HUB_CACHE", str(cache))


@pytest.mark.medium
def test_training_starts_from_a_repository_of_the_hub(
    robot: Robot,
    sway: ReferenceMotion,
    theirs: bytes,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """With the layers of the zip, which is requested once and then lies in the cache."""
    config = load(TrainConfig, None, {**BRIEF, "start": REPOSITORY})
    with serving({ZIP: theirs}) as (address, requests):
        at(address, tmp_path / "cache", monkeypatch)
        for name in ("first", "second"):
            train_policy(sway, robot, config, tmp_path / name)
            learnt = load_networks(tmp_path / name / "networks.safetensors")
            assert (learnt.widths("actor"), learnt.widths("critic1")) == ((16, 12), (16, 12, 25))
    assert requests.count(f"GET /{ZIP}") == 1


def test_a_repository_that_the_hub_has_not_is_one_clear_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with serving({}) as (address, _):
        at(address, tmp_path, monkeypatch)
        with pytest.raises(MissingDependency, match=REFUSAL) as caught:
            pretrained(REPOSITORY, "paper")
    assert "\n" not in str(caught.value)


def test_a_file_of_the_hub_that_is_no_zip_of_sb3_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with serving({ZIP: b"<html>log in first</html>"}) as (address, _):
        at(address, tmp_path, monkeypatch)
        with pytest.raises(BadPolicy, match=r"humanoid-v5-TQC-tiny\.zip"):
            pretrained(REPOSITORY, "paper")


@pytest.mark.slow
def test_the_command_says_in_one_line_that_the_hub_cannot_be_reached(
    sway: ReferenceMotion, tmp_path: Path
) -> None:
    with serving({}) as (address, _):
        pass  # now nothing listens there
    (tmp_path / "reference.parquet").write_bytes(tables.encode(sway))
    words = ("train", tmp_path / "reference.parquet", "-o", tmp_path / "run", "--force")
    options = [f"--set={key}={value}" for key, value in {**BRIEF, "start": REPOSITORY}.items()]
    cache = {"HF_HOME": str(tmp_path / "cache"), "HF_ENDPOINT": address}
    result = robojackson(*words, *options, **cache)
    assert result.code != 0
    assert "Traceback" not in result.err
    assert " ".join(result.err.split()).count(REFUSAL) == 1
