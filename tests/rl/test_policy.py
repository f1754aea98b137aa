from pathlib import Path

import numpy as np
import pytest
from safetensors.numpy import save, save_file

from robojackson.errors import BadPolicy
from robojackson.rl.policy import FORMAT, Policy, load_policy


def small_policy() -> Policy:
    rng = np.random.default_rng(0)
    shapes = [(5, 8), (8, 8), (8, 3)]
    layers = tuple(
        (rng.normal(size=s).astype(np.float32), rng.normal(size=s[1]).astype(np.float32))
        for s in shapes
    )
    return Policy(layers, {"robot": "humanoid", "seed": 3})


def a_file(weight: np.ndarray, header: str) -> bytes:
    """Return a policy of one layer."""
    tensors = {"layer0.weight": weight, "layer0.bias": np.zeros(3)}
    return save({n: np.asarray(t, np.float32) for n, t in tensors.items()}, {FORMAT: header})


def test_a_saved_policy_acts_the_same(tmp_path: Path) -> None:
    path = tmp_path / "policy.safetensors"
    path.write_bytes(small_policy().to_bytes())
    observation = np.random.default_rng(1).normal(size=(7, 5)).astype(np.float32)
    loaded = load_policy(path)
    np.testing.assert_array_equal(loaded.act(observation), small_policy().act(observation))
    assert loaded.facts == {"robot": "humanoid", "seed": 3}


def test_actions_stay_inside_the_action_space() -> None:
    assert np.abs(small_policy().act(np.full((1, 5), 1e4))).max() <= 1.0


def test_a_table_in_place_of_a_policy_is_named(tmp_path: Path) -> None:
    (tmp_path / "reference.parquet").write_bytes(b"PAR1" + bytes(64))
    with pytest.raises(BadPolicy, match="is a table: give the policy"):
        load_policy(tmp_path / "reference.parquet")


@pytest.mark.parametrize("content", [b"", b"not a policy", b"PK\x03\x04" + b"\0" * 64])
def test_a_foreign_file_is_refused(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "policy.safetensors"
    path.write_bytes(content)
    with pytest.raises(BadPolicy, match=r"policy\.safetensors"):
        load_policy(path)


def test_a_missing_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(BadPolicy, match=r"nowhere\.safetensors: no such file$"):
        load_policy(tmp_path / "nowhere.safetensors")


def test_a_folder_is_called_a_folder(tmp_path: Path) -> None:
    with pytest.raises(BadPolicy, match=r"a folder, not a file$"):
        load_policy(tmp_path)
    (tmp_path / "policy.safetensors").touch()
    with pytest.raises(BadPolicy, match=r"a file; did you mean .*/policy\.safetensors\?"):
        load_policy(tmp_path)


def test_weights_of_another_network_are_refused(tmp_path: Path) -> None:
    save_file({"w": np.zeros(3, np.float32)}, tmp_path / "other.safetensors")
    with pytest.raises(BadPolicy, match="robojackson train"):
        load_policy(tmp_path / "other.safetensors")


def test_layers_that_do_not_fit_are_refused(tmp_path: Path) -> None:
    first, _, last = small_policy().layers
    wrong = Policy(((first[0], first[1]), (last[0][:4], last[1])), {})
    (tmp_path / "p.safetensors").write_bytes(wrong.to_bytes())
    with pytest.raises(BadPolicy, match="fit"):
        load_policy(tmp_path / "p.safetensors")


@pytest.mark.parametrize(
    ("header", "reason"), [("{", "cannot be read"), ("[1]", "a list, not an object")]
)
def test_a_header_that_is_no_object_is_refused(tmp_path: Path, header: str, reason: str) -> None:
    (tmp_path / "p.safetensors").write_bytes(a_file(np.zeros((5, 3)), header))
    with pytest.raises(BadPolicy, match=reason):
        load_policy(tmp_path / "p.safetensors")


@pytest.mark.parametrize(
    ("weight", "reason"),
    [(np.zeros(5), "not a matrix"), (np.full((5, 3), np.nan), "not finite")],
)
def test_weights_that_no_layer_can_have_are_refused(
    tmp_path: Path, weight: np.ndarray, reason: str
) -> None:
    (tmp_path / "p.safetensors").write_bytes(a_file(weight, "{}"))
    with pytest.raises(BadPolicy, match=reason):
        load_policy(tmp_path / "p.safetensors")


@pytest.mark.parametrize(
    ("facts", "setup"), [({"setup": "pretrain"}, "pretrain"), ({}, ""), ({"setup": 3}, "")]
)
def test_a_policy_names_the_setup_of_its_training(facts: dict[str, object], setup: str) -> None:
    assert Policy((), facts).setup == setup


@pytest.mark.parametrize(
    ("facts", "message"),
    [
        ({"seed": 3, "steps": 512}, {"seed": 3, "step": 512}),
        ({}, {"seed": 0, "step": None}),
        ({"seed": "three", "steps": [1]}, {"seed": 0, "step": None}),
        ({"seed": 2**70, "steps": -1}, {"seed": 0, "step": None}),
    ],
)
def test_a_policy_names_the_columns_of_its_training(
    facts: dict[str, object], message: dict[str, object]
) -> None:
    assert Policy((), facts).training == message
