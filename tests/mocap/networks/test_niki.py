"""NIKI in both forms: official keys and masks, exact inverses, rotations from rows."""

from pathlib import Path

import numpy as np
import pytest
import torch
from scipy.spatial.transform import Rotation
from torch import Tensor

from robojackson.mocap.networks.niki import (
    OneStage,
    TwistSwing,
    from_rows,
    idle_inputs,
    niki_network,
    refine,
)
from robojackson.mocap.networks.weight_files import Weights

SMPL_KEYS = 9
Form = OneStage | TwistSwing
ERRORS = {OneStage: 32, TwistSwing: 32 + 46}


@pytest.fixture(scope="module", params=[OneStage, TwistSwing])
def network(request: pytest.FixtureRequest) -> Form:
    """Return random weights, larger than at the start of a training."""
    torch.manual_seed(0)
    form: Form = request.param().eval().double()
    with torch.no_grad():
        for parameter in form.parameters():
            parameter.mul_(1.5)
    return form


def rows(width: int, count: int = 5, seed: int = 1) -> Tensor:
    generator = torch.Generator().manual_seed(seed)
    return torch.randn(count, width, generator=generator, dtype=torch.float64)


@pytest.mark.medium
@pytest.mark.parametrize(
    ("form", "keys", "parameters"), [(OneStage, 211, 16.5e6), (TwistSwing, 396, 29.0e6)]
)
def test_a_form_has_the_published_keys_and_parameters(
    form: type[Form], keys: int, parameters: float
) -> None:
    with torch.device("meta"):
        network = form()
    count = sum(p.numel() for p in network.parameters())
    assert len(network.state_dict()) + SMPL_KEYS == keys
    assert count == pytest.approx(parameters, rel=5e-3)


@pytest.mark.parametrize(
    ("form", "key", "shape"),
    [
        (OneStage, "regressor.flow.mask", (16, 176)),
        (OneStage, "regressor.flow.t.15.4.weight", (176, 512)),
        (OneStage, "regressor.flow.s.0.2.bias", (512,)),
        (OneStage, "regressor.camnet.camera_net.9.weight", (3, 1024)),
        (OneStage, "regressor.camnet.camera_net.0.weight", (1024, 177)),
        (OneStage, "regressor.camnet.init_cam", (3,)),
        (TwistSwing, "regressor.flow_j2s.jts_masks", (16, 176)),
        (TwistSwing, "regressor.flow_j2s.shape_masks", (16,)),
        (TwistSwing, "regressor.flow_j2s.jts_nets.7.encoder.0.weight", (512, 186)),
        (TwistSwing, "regressor.flow_j2s.jts_nett.0.encoder.6.weight", (176, 512)),
        (TwistSwing, "regressor.flow_s2r.mask", (16, 190)),
        (TwistSwing, "regressor.flow_s2r.s.3.6.weight", (190, 512)),
    ],
)
def test_a_form_has_the_official_key(form: type[Form], key: str, shape: tuple[int, ...]) -> None:
    with torch.device("meta"):
        state = form().state_dict()
    assert tuple(state[key].shape) == shape


@pytest.mark.parametrize("key", ["regressor.flow.mask"])
def test_even_couplings_keep_the_odd_entries(key: str) -> None:
    mask = OneStage().state_dict()[key]
    assert mask[0, :4].tolist() == [0.0, 1.0, 0.0, 1.0]
    assert mask[1, :4].tolist() == [1.0, 0.0, 1.0, 0.0]
    assert torch.equal(mask[::2], mask[:1].expand(8, -1))


def test_forward_undoes_inverse(network: Form) -> None:
    joints, twist, betas = rows(176), rows(46, seed=2), rows(10, seed=3)
    with torch.inference_mode():
        rotations, error = network.inverse(joints, twist, betas)
        back, turned = network(rotations, error, betas)
    assert (back - joints).abs().max() < 1e-5
    assert torch.allclose(turned, twist[:, : turned.shape[1]], atol=1e-5)


def test_forward_undoes_inverse_in_single_precision() -> None:
    torch.manual_seed(0)
    network, joints, idle = TwistSwing(), rows(176).float(), torch.zeros(5, 46)
    with torch.inference_mode():
        out = network.inverse(joints, idle, idle[:, :10])
        back, _ = network(*out, idle[:, :10])
    assert (back - joints).abs().max() < 1e-5


def test_inverse_undoes_forward(network: Form) -> None:
    rotations, betas = rows(144), rows(10, seed=3)
    error = rows(ERRORS[type(network)], seed=2)
    with torch.inference_mode():
        joints, twist = network(rotations, error, betas)
        back, z = network.inverse(joints, twist, betas)
    assert (back - rotations).abs().max() < 1e-5
    assert (z - error).abs().max() < 1e-5


def test_the_first_coupling_is_the_published_formula() -> None:
    """One coupling by hand, through the raw weights: the tanh is on the scale alone."""
    torch.manual_seed(0)
    network = OneStage()
    state = network.state_dict()
    values = torch.randn(1, 176)
    with torch.inference_mode():
        found = network.inverse(values, torch.zeros(1, 46), torch.zeros(1, 10))
        expected = values
        for index in range(16):
            mask = state["regressor.flow.mask"][index]
            net = {
                name: _by_hand(state, f"regressor.flow.{name}.{index}", expected * mask)
                for name in "st"
            }
            changed = expected * torch.exp(torch.tanh(net["s"])) + net["t"]
            expected = mask * expected + (1.0 - mask) * changed
    assert torch.allclose(torch.cat(found, 1), expected, atol=1e-5)


def test_the_shape_does_not_reach_the_swing(network: Form) -> None:
    """The published shape masks are zero."""
    joints, twist = rows(176), rows(46, seed=2)
    with torch.inference_mode():
        thin, _ = network.inverse(joints, twist, torch.zeros(5, 10, dtype=torch.float64))
        stout, _ = network.inverse(joints, twist, rows(10, seed=3))
    assert torch.equal(thin, stout)


@pytest.mark.parametrize("count", [1, 15, 17, 35])
def test_a_clip_of_any_length_keeps_all_its_frames(network: Form, count: int) -> None:
    out = refine(network, *_inputs(count))
    assert out.rotations.shape == (count, 24, 3, 3)


def test_a_frame_does_not_depend_on_the_others(network: Form) -> None:
    inputs = _inputs(9)
    alone = refine(network, *(part[3:4] for part in inputs))
    assert np.abs(refine(network, *inputs).rotations[3] - alone.rotations[0]).max() < 1e-5


def test_the_origin_of_the_joints_does_not_matter(network: Form) -> None:
    joints, *others = _inputs(4)
    moved = refine(network, joints + np.array([0.3, -1.0, 4.0]), *others)
    assert np.abs(refine(network, joints, *others).rotations - moved.rotations).max() < 1e-4


def test_six_numbers_are_the_first_two_rows_of_a_rotation() -> None:
    truth = Rotation.random(20, random_state=0).as_matrix()
    stretched = truth[:, :2] * np.array([[2.0], [0.5]])
    stretched[:, 1] += 0.7 * truth[:, 0]
    assert np.abs(from_rows(stretched.reshape(20, 6)) - truth).max() < 1e-12


def test_idle_inputs_repeat_with_their_seed_and_are_zero_without_noise() -> None:
    first, second = (idle_inputs(4, 1e-3, np.random.default_rng(7)) for _ in range(2))
    assert first.shape == (4, 60)
    assert np.array_equal(first, second)
    assert not idle_inputs(4, 0.0, np.random.default_rng(7)).any()


def test_a_file_of_a_form_gives_back_its_network(network: Form) -> None:
    kind = "niki_one_stage" if isinstance(network, OneStage) else "niki_twist_swing"
    loaded = niki_network(Weights(Path("niki.pth"), kind, _single(network), {}))
    inputs = _inputs(3)
    expected = refine(network, *inputs).rotations
    assert np.abs(refine(loaded, *inputs).rotations - expected).max() < 1e-3


def _single(network: Form) -> dict[str, Tensor]:
    """Return the weights as they are published."""
    return {key: value.float() for key, value in network.state_dict().items()}


def _inputs(count: int) -> tuple[np.ndarray, ...]:
    generator = np.random.default_rng(count)
    shapes = ((29, 3), (29,), (23, 2), (10,), (60,))
    return tuple(0.3 * generator.standard_normal((count, *shape)) for shape in shapes)


def _by_hand(state: dict[str, Tensor], name: str, values: Tensor) -> Tensor:
    for layer in (0, 2, 4):
        values = values @ state[f"{name}.{layer}.weight"].T + state[f"{name}.{layer}.bias"]
        if layer < 4:
            values = torch.where(values > 0, values, 0.01 * values)
    return values
