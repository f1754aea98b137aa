"""Files of weights: what is loaded, what is refused, and what the user is reported."""

import pickle
from pathlib import Path

import pytest
import torch
from safetensors.torch import save_file

from robojackson.errors import BadConfiguration, BadWeights
from robojackson.mocap.networks.inference import device_of
from robojackson.mocap.networks.network_config import NetworkConfig
from robojackson.mocap.networks.niki import OneStage, niki_network
from robojackson.mocap.networks.weight_files import install, read_weights, recognise


@pytest.fixture(scope="module")
def weights() -> dict[str, torch.Tensor]:
    torch.manual_seed(0)
    return dict(OneStage().state_dict())


def saved(path: Path, content: object) -> Path:
    torch.save(content, path)
    return path


class Trap:
    """Would write a file if it were unpickled."""

    def __init__(self, target: Path) -> None:
        self.target = target

    def __reduce__(self) -> tuple[object, tuple[str]]:
        return Path.touch, (self.target,)  # type: ignore[return-value]


@pytest.mark.parametrize("wrapper", [None, "model", "state_dict"])
def test_a_state_dict_loads_bare_or_wrapped(
    tmp_path: Path, weights: dict[str, torch.Tensor], wrapper: str | None
) -> None:
    content = weights if wrapper is None else {wrapper: weights, "epoch": 3}
    found = read_weights(saved(tmp_path / "niki.pth", content), "niki")
    assert set(found.tensors) == set(weights)


def test_the_prefix_of_parallel_training_goes_away(
    tmp_path: Path, weights: dict[str, torch.Tensor]
) -> None:
    prefixed = {f"module.{key}": value for key, value in weights.items()}
    found = read_weights(saved(tmp_path / "niki.pth", prefixed), "niki")
    assert set(found.tensors) == set(weights)


def test_safetensors_hold_the_same_weights(
    tmp_path: Path, weights: dict[str, torch.Tensor]
) -> None:
    save_file({k: v.contiguous() for k, v in weights.items()}, tmp_path / "niki.safetensors")
    found = read_weights(tmp_path / "niki.safetensors", "niki")
    assert all(torch.equal(found.tensors[key], value) for key, value in weights.items())


def test_the_tables_of_the_body_are_kept_apart(
    tmp_path: Path, weights: dict[str, torch.Tensor]
) -> None:
    with_body = weights | {"regressor.smpl_layer.v_template": torch.zeros(6890, 3)}
    found = read_weights(saved(tmp_path / "niki.pth", with_body), "niki")
    assert (set(found.body), set(found.tensors)) == ({"v_template"}, set(weights))


def test_half_precision_weights_are_widened(
    tmp_path: Path, weights: dict[str, torch.Tensor]
) -> None:
    half = {key: value.half() for key, value in weights.items()}
    network = niki_network(read_weights(saved(tmp_path / "niki.pth", half), "niki"))
    assert {p.dtype for p in network.parameters()} == {torch.float64}


def test_code_in_a_file_is_refused_and_does_not_run(tmp_path: Path) -> None:
    target = tmp_path / "executed"
    path = saved(tmp_path / "trap.pth", {"model": Trap(target)})
    with pytest.raises(BadWeights, match="could run code"):
        read_weights(path, "hybrik")
    assert not target.exists()


def test_a_plain_pickle_is_refused_and_does_not_run(tmp_path: Path) -> None:
    target = tmp_path / "executed"
    path = tmp_path / "trap.pkl"
    path.write_bytes(pickle.dumps(Trap(target)))
    with pytest.raises(BadWeights):
        read_weights(path, "hybrik")
    assert not target.exists()


@pytest.mark.parametrize("suffix", [".pth", ".safetensors"])
def test_a_truncated_file_is_reported(
    tmp_path: Path, weights: dict[str, torch.Tensor], suffix: str
) -> None:
    path = tmp_path / f"whole{suffix}"
    if suffix == ".pth":
        torch.save(weights, path)
    else:
        save_file({k: v.contiguous() for k, v in weights.items()}, path)
    cut = tmp_path / f"cut{suffix}"
    cut.write_bytes(path.read_bytes()[:1_000_000])
    with pytest.raises(BadWeights, match="download it again"):
        read_weights(cut, "niki")


@pytest.mark.parametrize("content", [b"", b"\x00" * 64, b"<html>quota exceeded</html>"])
def test_something_else_than_weights_is_reported(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "weights.pth"
    path.write_bytes(content)
    with pytest.raises(BadWeights, match=r"weights\.pth"):
        read_weights(path, "hybrik")


def test_a_missing_file_is_reported(tmp_path: Path) -> None:
    with pytest.raises(BadWeights, match="no such file"):
        read_weights(tmp_path / "nowhere.pth", "hybrik")


def test_a_foreign_network_is_reported_by_its_keys(tmp_path: Path) -> None:
    path = saved(tmp_path / "foreign.pth", {"backbone.conv1.weight": torch.zeros(1)})
    with pytest.raises(BadWeights, match=r"hybrik_hrnet48.*backbone\.conv1\.weight"):
        read_weights(path, "hybrik")


def test_niki_in_the_place_of_hybrik_is_reported(
    tmp_path: Path, weights: dict[str, torch.Tensor]
) -> None:
    with pytest.raises(BadWeights, match="holds niki_one_stage, expected weights of hybrik"):
        read_weights(saved(tmp_path / "niki.pth", weights), "hybrik")


def test_missing_unexpected_and_misshapen_keys_are_named(
    tmp_path: Path, weights: dict[str, torch.Tensor]
) -> None:
    changed = dict(weights)
    del changed["regressor.flow.s.3.2.bias"]
    changed["regressor.extra"] = torch.zeros(2)
    changed["regressor.flow.t.0.0.bias"] = torch.zeros(7)
    found = read_weights(saved(tmp_path / "niki.pth", changed), "niki")
    with pytest.raises(BadWeights) as caught:
        install(OneStage(), found)
    message = str(caught.value)
    assert "1 missing (regressor.flow.s.3.2.bias)" in message
    assert "1 unexpected (regressor.extra)" in message
    assert "regressor.flow.t.0.0.bias is (7,), expected (512,)" in message


def test_weights_that_are_not_finite_are_reported(
    tmp_path: Path, weights: dict[str, torch.Tensor]
) -> None:
    spoilt = dict(weights)
    spoilt["regressor.flow.s.0.0.bias"] = torch.full((512,), torch.nan)
    with pytest.raises(BadWeights, match=r"not finite in regressor\.flow\.s\.0\.0\.bias"):
        read_weights(saved(tmp_path / "niki.pth", spoilt), "niki")


@pytest.mark.parametrize(
    ("keys", "kind"),
    [
        (("preact.stage4.0.branches.3.0.conv1.weight", "decphi.weight"), "hybrik_hrnet48"),
        (("regressor.flow_j2s.jts_masks", "regressor.flow_s2r.mask"), "niki_twist_swing"),
    ],
)
def test_a_variant_is_recognised_by_its_keys(keys: tuple[str, ...], kind: str) -> None:
    assert recognise(keys, Path("file")) == kind


def test_niki_alone_is_refused() -> None:
    with pytest.raises(Exception, match=r"give network\.hybrik, too"):
        NetworkConfig(niki="niki.pth")


def test_a_gpu_that_is_not_there_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(torch.cuda, "is_available", lambda: False)
    with pytest.raises(BadConfiguration, match="PyTorch sees no GPU"):
        device_of(NetworkConfig(hybrik="x", device="cuda"))
