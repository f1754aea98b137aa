"""Where a training starts from: named arrays, zips of SB3, the walkers; and that nothing is run."""

import io
import json
import pickle
import zipfile
from dataclasses import replace
from pathlib import Path

import gymnasium
import numpy as np
import onnxruntime
import pytest
import torch
from sb3_contrib import TQC
from stable_baselines3 import SAC
from stable_baselines3.common.vec_env.base_vec_env import VecEnv

from robojackson.errors import BadPolicy, MissingDependency
from robojackson.formats import onnx_policy
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.rl.config.train_config import PaperConfig, TqcConfig, TrackConfig, TrainConfig
from robojackson.rl.env.tracking_core import TrackingCore
from robojackson.rl.env.vec_env import TrackingVecEnv
from robojackson.rl.policy import Policy
from robojackson.rl.pretrained import from_sb3_zip, pretrained
from robojackson.rl.tqc.network_arrays import Networks, fitted, load_networks, widened
from robojackson.rl.tqc.trainers import make_trainer
from robojackson.rl.training import train_policy
from robojackson.rl.walkers import shipped_walker
from robojackson.robot.model import Robot

SMALL = TqcConfig(n_envs=2, warmup=8, batch=8, buffer=1000, actor=(12, 8), critic=(10,))
ran: list[str] = []


@pytest.fixture
def env(robot: Robot, sway: ReferenceMotion) -> VecEnv:
    return TrackingVecEnv(TrackingCore(robot, sway, PaperConfig(), 2, 0))


def acts(networks: Networks, seen: np.ndarray) -> np.ndarray:
    """Return the mean action of an actor, computed here."""
    hidden = seen
    for i in range(len(networks.widths("actor"))):
        layer = networks.tensors[f"actor.{i}.weight"], networks.tensors[f"actor.{i}.bias"]
        hidden = np.maximum(hidden @ layer[0] + layer[1], 0)
    return np.tanh(hidden @ networks.tensors["mean.weight"] + networks.tensors["mean.bias"])


@pytest.mark.medium
@pytest.mark.parametrize("name", ["sbx", "sb3"])
def test_a_trainer_that_starts_from_networks_has_them(env: VecEnv, name: str) -> None:
    given = make_trainer("sb3", env, SMALL, seed=1).networks()
    trainer = make_trainer(name, env, SMALL, seed=2)
    trainer.start_from(given)
    taken = trainer.networks()
    assert set(taken) == set(given)
    for key, array in given.items():
        np.testing.assert_array_equal(taken[key], array, err_msg=key)


def test_both_trainers_write_the_same_policy_from_the_same_networks(env: VecEnv) -> None:
    first, second = (make_trainer(name, env, SMALL, seed=3) for name in ("sb3", "sbx"))
    second.start_from(first.networks())
    for (w, b), (w2, b2) in zip(first.layers(), second.layers(), strict=True):
        np.testing.assert_array_equal(w, w2)
        np.testing.assert_array_equal(b, b2)


def zipped(tmp_path: Path, sde: bool = False) -> tuple[TQC, Path]:
    """Save an untrained TQC of sb3-contrib as a zip like those of the hub; return both."""
    stock = gymnasium.make("Humanoid-v5")
    net = {"net_arch": [16, 12], "clip_mean": 0.0}
    model = TQC("MlpPolicy", stock, policy_kwargs=net, use_sde=sde, seed=4, device="cpu")
    model.save(tmp_path / "theirs.zip")
    return model, tmp_path / "theirs.zip"


def test_a_zip_of_another_algorithm_is_refused(tmp_path: Path) -> None:
    """SAC has the same names, and critics of one value: TQC would drop it and learn nothing."""
    model = SAC("MlpPolicy", "Humanoid-v5", policy_kwargs={"net_arch": [8]}, device="cpu")
    model.save(tmp_path / "sac.zip")
    with pytest.raises(BadPolicy, match=r"sac\.zip.*one value, as SAC's do"):
        from_sb3_zip(tmp_path / "sac.zip")


def test_networks_whose_quantiles_would_all_be_dropped_are_refused(env: VecEnv) -> None:
    few = Networks(make_trainer("sb3", env, SMALL, seed=1).networks(), {})
    with pytest.raises(BadPolicy, match=r"25 quantiles.*start_critics=false"):
        fitted(replace(SMALL, quantiles=40, top_quantiles_to_drop=30), few, True)


@pytest.mark.parametrize("sde", [False, True])
def test_a_zip_of_sb3_acts_as_its_own_actor(tmp_path: Path, sde: bool) -> None:
    model, path = zipped(tmp_path, sde)
    seen = np.random.default_rng(0).normal(size=(5, 348)).astype(np.float32)
    theirs, _ = model.predict(seen, deterministic=True)
    np.testing.assert_allclose(0.4 * acts(from_sb3_zip(path), seen), theirs, atol=1e-5)


def test_training_goes_on_from_a_zip_with_its_layers(
    robot: Robot, sway: ReferenceMotion, tmp_path: Path
) -> None:
    """Whatever the preset says: the layers are the zip's, and no random action is taken."""
    _, path = zipped(tmp_path)
    config = TrainConfig(mode="paper", trainer="sb3", steps=16, start=str(path), tqc=SMALL)
    train_policy(sway, robot, config, tmp_path / "run")
    learnt = load_networks(tmp_path / "run" / "networks.safetensors")
    assert (learnt.widths("actor"), learnt.widths("critic1")) == ((16, 12), (16, 12, 25))


def note(word: str) -> None:
    ran.append(word)


class Bomb:
    """Unpickling it runs `note`."""

    def __reduce__(self) -> tuple:
        return note, ("bang",)


def test_a_zip_that_would_run_code_is_refused_and_does_not(tmp_path: Path) -> None:
    path = tmp_path / "bomb.zip"
    held = {"policy_kwargs": {":type:": "dict", ":serialized:": "gASV"}}
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("data", json.dumps(held))
        archive.writestr("policy.pth", pickle.dumps(Bomb()))
    with pytest.raises(BadPolicy, match=r"bomb\.zip") as refused:
        from_sb3_zip(path)
    assert "weights_only" not in str(refused.value)
    assert "\n" not in str(refused.value)
    pickle.loads(pickle.dumps(Bomb()))
    assert ran == ["bang"]


def test_a_zip_without_weights_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "empty.zip"
    zipfile.ZipFile(path, "w").close()
    with pytest.raises(BadPolicy, match=r"empty\.zip"):
        from_sb3_zip(path)


def test_without_a_network_the_hub_is_one_clear_line(monkeypatch: pytest.MonkeyPatch) -> None:
    import huggingface_sb3

    def unreachable(*args: object) -> None:
        raise ConnectionError("no route to host\nand a long story")

    monkeypatch.setattr(huggingface_sb3, "load_from_hub", unreachable)
    with pytest.raises(MissingDependency, match=r"farama-minari.*give its path") as caught:
        pretrained("farama-minari/Humanoid-v5-TQC-simple", "paper")
    assert "\n" not in str(caught.value)


def test_the_hubs_zip_is_requested_by_its_own_name(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    import huggingface_sb3

    _, path = zipped(tmp_path)
    requests: list[tuple[str, str]] = []

    def fetch(repository: str, name: str) -> str:
        requests.append((repository, name))
        return str(path)

    monkeypatch.setattr(huggingface_sb3, "load_from_hub", fetch)
    found = pretrained("farama-minari/Humanoid-v5-TQC-simple", "paper")
    assert requests == [("farama-minari/Humanoid-v5-TQC-simple", "humanoid-v5-TQC-simple.zip")]
    assert found is not None
    assert found.observation_size == 348


@pytest.mark.parametrize("start", ["nowhere/at/all.zip", "out/networks.safetensors", "my/own.zip"])
def test_a_start_that_does_not_exist_is_refused_without_asking_the_hub(start: str) -> None:
    with pytest.raises(BadPolicy, match="no such file"):
        pretrained(start, "paper")


def test_networks_of_another_mode_are_refused(
    robot: Robot, sway: ReferenceMotion, tmp_path: Path
) -> None:
    _, path = zipped(tmp_path)
    config = TrainConfig(trainer="sb3", steps=16, start=str(path), tqc=SMALL)
    with pytest.raises(BadPolicy, match="takes 348 observations"):
        train_policy(sway, robot, config, tmp_path / "run")


def test_networks_whose_inputs_have_another_order_are_refused(
    robot: Robot, sway: ReferenceMotion, tmp_path: Path
) -> None:
    """As many numbers, of which an actor of the robot's own measurements takes the first."""
    config = TrainConfig(steps=16, start="walker", tqc=SMALL, track=TrackConfig("onboard"))
    with pytest.raises(BadPolicy, match=r"observes full .* onboard.*observation=full"):
        train_policy(sway, robot, config, tmp_path / "run")


def test_widened_networks_ignore_what_they_do_not_know(env: VecEnv) -> None:
    rng = np.random.default_rng(5)
    narrow = Networks(make_trainer("sb3", env, SMALL, seed=1).networks(), {})
    wide = widened(narrow, 400)
    seen, more = rng.normal(size=(3, 348)), rng.normal(size=(3, 52))
    np.testing.assert_allclose(
        acts(wide, np.concatenate([seen, more], 1)), acts(narrow, seen), atol=1e-6
    )
    assert wide.tensors["critic1.0.weight"].shape[0] == 400 + 17
    np.testing.assert_array_equal(
        wide.tensors["critic1.0.weight"][400:], narrow.tensors["critic1.0.weight"][348:]
    )


def test_networks_read_back_are_those_written(env: VecEnv, tmp_path: Path) -> None:
    given = Networks(make_trainer("sb3", env, SMALL, seed=1).networks(), {"steps": 3})
    (tmp_path / "networks.safetensors").write_bytes(given.to_bytes())
    found = load_networks(tmp_path / "networks.safetensors")
    assert found.facts == {"steps": 3}
    assert all(np.array_equal(found.tensors[name], given.tensors[name]) for name in given.tensors)


DAMAGES = {
    "critic2.norm.0.offset is missing": ("critic2.norm.0.offset", None),
    "target1.0.weight is missing": ("target1.0.weight", None),
    "actor.1.bias is missing": ("actor.1.bias", None),
    "mean.weight is missing or not a matrix": ("mean.weight", None),
    "critic1.0.weight is missing or not a matrix": ("critic1.0.weight", np.ones(3)),
    "critic3.0.weight, which belongs to no layer": ("critic3.0.weight", np.ones((2, 2))),
    r"critic1.norm.0.scale has the shape \(4,\).*need \(10,\)": (
        "critic1.norm.0.scale",
        np.ones(4),
    ),
    r"critic2.0.weight has the shape \(9, 10\)": ("critic2.0.weight", np.ones((9, 10))),
    r"log_alpha has the shape \(2,\)": ("log_alpha", np.ones(2)),
    "log_std.bias holds values that are not finite": ("log_std.bias", np.full(17, np.nan)),
}


@pytest.mark.parametrize("message", DAMAGES)
def test_networks_that_are_not_whole_are_refused_and_nothing_is_left(
    robot: Robot, sway: ReferenceMotion, env: VecEnv, tmp_path: Path, message: str
) -> None:
    """What is missing would stay random, unseen; what does not fit would end in a traceback."""
    tensors = make_trainer("sb3", env, replace(SMALL, layer_norm=True), seed=1).networks()
    name, array = DAMAGES[message]
    tensors.pop(name, None)
    path = tmp_path / "networks.safetensors"
    path.write_bytes(Networks(tensors | ({} if array is None else {name: array}), {}).to_bytes())
    config = TrainConfig(mode="paper", steps=16, start=str(path), tqc=SMALL)
    with pytest.raises(BadPolicy, match=message):
        train_policy(sway, robot, config, tmp_path / "run")
    assert not (tmp_path / "run").exists()


def test_an_actor_alone_is_whole(env: VecEnv, tmp_path: Path) -> None:
    tensors = make_trainer("sb3", env, SMALL, seed=1).networks()
    kept = {n: t for n, t in tensors.items() if n.split(".")[0] in ("actor", "mean", "log_std")}
    path = tmp_path / "networks.safetensors"
    path.write_bytes(Networks(kept, {}).to_bytes())
    assert load_networks(path).widths("actor") == SMALL.actor


def test_a_zip_that_lacks_a_layer_is_refused(tmp_path: Path) -> None:
    _, path = zipped(tmp_path)
    with zipfile.ZipFile(path) as archive:
        files = {name: archive.read(name) for name in archive.namelist()}
    state = torch.load(io.BytesIO(files["policy.pth"]), weights_only=True)
    state = {name: value for name, value in state.items() if not name.startswith("critic.qf1.2")}
    held = io.BytesIO()
    torch.save(state, held)
    with zipfile.ZipFile(path, "w") as archive:
        for name, content in (files | {"policy.pth": held.getvalue()}).items():
            archive.writestr(name, content)
    with pytest.raises(BadPolicy, match=r"theirs\.zip"):
        from_sb3_zip(path)


@pytest.mark.parametrize("mode", ["paper", "track"])
def test_the_shipped_walker_fits_its_mode(robot: Robot, sway: ReferenceMotion, mode: str) -> None:
    walker = pretrained("walker", mode)
    assert walker is not None
    config = TrainConfig(mode=mode)  # type: ignore[arg-type]
    core = TrackingCore(robot, sway, config.environment, 1, 0)
    assert (walker.observation_size, walker.action_size) == (core.observation_size, 17)
    assert fitted(config.tqc, walker, critics=True) == config.tqc
    assert shipped_walker(mode).stat().st_size < 10e6


def small_policy() -> Policy:
    rng = np.random.default_rng(0)
    layers = tuple((rng.normal(size=s), rng.normal(size=s[1])) for s in [(5, 8), (8, 6), (6, 3)])
    return Policy(layers, {"robot": "humanoid", "seed": 3})


def test_a_policy_acts_the_same_as_onnx() -> None:
    policy = small_policy()
    session = onnxruntime.InferenceSession(
        onnx_policy.write(policy), providers=["CPUExecutionProvider"]
    )
    seen = np.random.default_rng(1).normal(size=(7, 5)).astype(np.float32)
    (action,) = session.run(["action"], {"observation": seen})
    np.testing.assert_allclose(action, policy.act(seen), atol=1e-5)


def test_the_onnx_file_says_what_the_policy_was_trained_for() -> None:
    import onnx

    model = onnx.load(io.BytesIO(onnx_policy.write(small_policy())))
    assert json.loads(model.metadata_props[0].value) == {"robot": "humanoid", "seed": 3}
