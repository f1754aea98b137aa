"""Laws of the training: torch and numpy are one network, batches keep what they must."""

from dataclasses import fields
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import torch
from safetensors.torch import load_file, save_file
from scipy.spatial.transform import Rotation

from robojackson.body.forward_kinematics import unit
from robojackson.errors import BadWeights
from robojackson.mocap.temporal import error_flow, features, temporal_lift, temporal_network
from robojackson.mocap.temporal.features import ClipView
from robojackson.motion.smpl_sequence import AIR, PLANTED, SLIDING
from tools.pairs.sources import RefusedMotion
from tools.temporal import batches, calibration, fit, join, train_temporal
from tools.temporal.batches import Batch
from tools.temporal.depth_errors import Change, body_offsets, misjudged
from tools.temporal.examples import Example, flattened
from tools.temporal.filming import HIPS
from tools.temporal.fit_flow import cleaned, discrepancy, flow_losses
from tools.temporal.net import Flow, Lifter, found_in, lifter_of
from tools.temporal.random_numbers import RandomNumbers


@pytest.fixture(scope="module", params=[(160, 4), (96, 6)])
def twins(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> tuple[Lifter, Flow, error_flow.Weights]:
    torch.manual_seed(1)
    width, blocks = request.param
    lifter, coupled = Lifter(width, blocks).eval(), Flow(width)
    for part in (lifter, coupled):
        for value in part.parameters():
            torch.nn.init.normal_(value, std=0.05)
    path = tmp_path_factory.mktemp("weights") / "random.safetensors"
    train_temporal.save(lifter.half().float(), coupled.half().float(), path)
    return lifter, coupled, temporal_network.load(path)


def person(frames: int = 60, motion: str = "jump", known: bool = False) -> Example:
    rng = np.random.default_rng(9)
    up = np.tile([0.0, -1.0, 0.0], (frames, 1))
    truth = rng.normal(0.0, 0.4, (1, 33, 3)) + 0.05 * rng.normal(size=(frames, 33, 3))
    truth[:, features.HIPS] -= truth[:, features.HIPS].mean(1, keepdims=True)
    distance = np.full(frames, 4.0)
    sight = ClipView(
        flat=flattened(truth, distance),
        local=truth,
        visibility=np.ones((frames, 33)),
        axes=np.tile(np.eye(3), (frames, 1, 1)),
        root=np.outer(distance, [0.0, 0.0, 1.0]),
        up=up if known else np.zeros((frames, 3)),
    )
    contact = np.tile([PLANTED, AIR, SLIDING, AIR], (frames, 1))
    return Example(sight, truth, np.ones(frames, bool), distance, motion, up, contact)


def batch_of(example: Example) -> Batch:
    whole = batches.table([example])
    return batches.windows(whole, torch.zeros(4, dtype=torch.long), 40, RandomNumbers([2]))


def arrays(batch: Batch) -> SimpleNamespace:
    """Return the parts of a batch as numpy arrays."""
    return SimpleNamespace(**{f.name: getattr(batch, f.name).numpy() for f in fields(batch)})


def changed_by(how: Change, batch: Batch, seed: int) -> SimpleNamespace:
    """Return the windows, changed, as numpy arrays."""
    return arrays(batches.change(batch, how, RandomNumbers([seed])))


def test_torch_and_numpy_are_the_same_lifter(
    twins: tuple[Lifter, Flow, error_flow.Weights],
) -> None:
    lifter, _, weights = twins
    sight = person().sight
    ours = temporal_network.run(sight, weights)
    found = found_in(lifter, sight)
    assert np.abs(found.correction.numpy() - ours.correction).max() < 1e-3
    assert np.abs(found.log_spread.numpy() - np.log(ours.spread)).max() < 1e-3
    assert np.abs(found.up.numpy() - ours.up).max() < 1e-3
    assert np.abs(found.log_tilt.numpy() - np.log(ours.tilt)).max() < 1e-3


def test_torch_and_numpy_are_the_same_flow(twins: tuple[Lifter, Flow, error_flow.Weights]) -> None:
    _, coupled, weights = twins
    rng = np.random.default_rng(3)
    error, seen = rng.normal(size=(5, 36)), rng.normal(size=(5, coupled.read.in_features))
    with torch.no_grad():
        z, _ = coupled(torch.from_numpy(error).float(), torch.from_numpy(seen).float())
    assert np.abs(z.numpy() - error_flow.to_embedding(error, seen, weights)).max() < 1e-4


def test_the_flow_in_torch_can_be_inverted(twins: tuple[Lifter, Flow, error_flow.Weights]) -> None:
    _, coupled, _ = twins
    error, seen = torch.randn(5, 36), torch.randn(5, coupled.read.in_features)
    assert (coupled.inverse(coupled(error, seen)[0], seen) - error).abs().max() < 1e-5


def test_the_volume_is_the_determinant(twins: tuple[Lifter, Flow, error_flow.Weights]) -> None:
    _, coupled, _ = twins
    error, seen = torch.randn(36), torch.randn(coupled.read.in_features)
    jacobian = torch.autograd.functional.jacobian(lambda x: coupled(x, seen)[0], error)
    assert torch.allclose(torch.logdet(jacobian), coupled(error, seen)[1], atol=1e-4)


def test_batches_give_the_numbers_that_the_stage_gives() -> None:
    example = person(batches.LONGEST)
    rows = batches.table([example]).numbers()[0].numpy()
    assert np.allclose(rows, features.numbers(example.sight), atol=1e-5)


def test_changed_windows_are_still_seen_as_they_are() -> None:
    how = Change(
        40, shift_m=0.0, tilt_deg=(0.0, 0.0), depth=0.0, depth_shift_m=0.0, shake_m=0.0,
        body_m=0.0, body_limb_m=0.0,
        hidden=0.0, metre=0.0, bad_depth=0.0, no_depth=0.0, strides=(1.0, 0.0, 0.0),
    )  # fmt: skip
    changed = changed_by(how, batch_of(person()), 4)
    away = changed.distance[..., None, None]
    ideal = changed.truth[..., :2] * away / (away + changed.truth[..., 2:])
    assert np.allclose(changed.flat, ideal, atol=1e-4)
    assert np.allclose(changed.local, changed.truth, atol=1e-4)


def test_errors_in_body_axes_turn_with_the_body() -> None:
    still = np.repeat(batch_of(person()).truth[:1, :1].numpy(), 30, axis=1)
    turns = Rotation.from_rotvec(np.outer(np.arange(30) / 10.0, [0.3, 0.8, 0.1])).as_matrix()
    turning = still @ np.swapaxes(turns, -1, -2)[:, :].astype(np.float32)
    wrong = body_offsets(torch.from_numpy(turning), Change(), RandomNumbers([2])).numpy()
    back = wrong @ turns.astype(np.float32)
    assert np.abs(back - back[:, :1]).max() < 1e-5
    assert np.abs(wrong - wrong[:, :1]).max() > 0.01
    assert np.abs(wrong[:, :, HIPS].mean(2)).max() < 1e-6


def test_a_mirrored_window_exchanges_the_feet() -> None:
    whole = arrays(batch_of(person()))
    changed = changed_by(Change(40, roll_deg=0.0), batch_of(person()), 6)
    same = (changed.contact == whole.contact).all((1, 2))
    other = (changed.contact == whole.contact[..., [2, 3, 0, 1]]).all((1, 2))
    assert (same ^ other).all()
    assert same.any()
    assert other.any()


def test_a_detector_without_depth_sees_the_image_alone() -> None:
    local = np.random.default_rng(5).normal(size=(3, 20, 23, 3)).astype(np.float32)
    how = Change(tilt_deg=(0.0, 0.0), bad_depth=0.0, no_depth=1.0)
    seen = misjudged(torch.from_numpy(local), how, RandomNumbers([6])).numpy()
    assert (seen[..., 2] == 0.0).all()
    assert np.allclose(seen[..., :2], local[..., :2], atol=1e-6)


def test_hidden_limbs_are_not_visible() -> None:
    how = Change(frames=40, hidden=1.0)
    changed = changed_by(how, batch_of(person()), 5)
    assert (changed.visibility.min((1, 2)) == 0.0).all()


def test_a_hidden_limb_is_bridged_straight_between_the_frames_around() -> None:
    seen = (torch.randn(64, 40, 23, 2), torch.randn(64, 40, 23, 3), torch.ones(64, 40, 23))
    how = Change(hidden=1.0, hidden_s=(0.4, 0.4))
    flat, local, visibility = (part.numpy() for part in batches.hide(seen, how, RandomNumbers([8])))
    gone = visibility == 0.0
    assert np.array_equal(flat[~gone], seen[0].numpy()[~gone])
    assert np.array_equal(local[~gone], seen[1].numpy()[~gone])
    inner = gone[:, :-2] & gone[:, 1:-1] & gone[:, 2:]
    bend = np.abs(np.diff(local, 2, axis=1)).max(-1)
    straight = bend[inner] < 1e-5
    assert 0.8 < straight.mean() <= 1.0  # two limbs, or one twice: a bridge over a bridge bends
    assert np.isfinite(local).all()
    assert set(gone.sum((1, 2)) // 48) <= {0, 1, 2}


def test_the_truth_of_a_hidden_limb_stays() -> None:
    how = Change(40, roll_deg=0.0, size=0.0, metre=0.0, shift_m=0.0, shake_m=0.0, hidden=1.0)
    whole = arrays(batch_of(person()))
    changed = changed_by(how, batch_of(person()), 6)
    same = np.abs(changed.truth - whole.truth).max((1, 2, 3)) < 1e-6
    mirrored = np.abs(changed.truth[:, :, batches.SWAP] * [-1, 1, 1] - whole.truth)
    assert (same | (mirrored.max((1, 2, 3)) < 1e-6)).all()


def test_pairs_of_a_reported_motion_are_refused() -> None:
    with pytest.raises(RefusedMotion, match="dance_a"):
        train_temporal.check_motions([person(motion="dance_a+gestures")])


def test_invented_pairs_are_not_refused() -> None:
    train_temporal.check_motions([person(motion="invented"), person(motion="jump")])


def test_discrepancy_detects_another_distribution() -> None:
    torch.manual_seed(7)
    a, b = torch.randn(200, 4), torch.randn(200, 4)
    assert discrepancy(a, b + 1.0) > 5.0 * discrepancy(a, b).abs()


def test_the_same_seeds_draw_the_same_batch() -> None:
    where, config = fit.source([person()], None), fit.FitConfig(batch=3, change=Change(frames=20))
    drawn = [where.draw(config, 0.0, RandomNumbers(seeds)) for seeds in ([1, 2], [1, 2], [1, 3])]
    assert torch.equal(drawn[0].numbers(), drawn[1].numbers())
    assert not torch.equal(drawn[0].numbers(), drawn[2].numbers())


@pytest.mark.slow
def test_a_saved_state_goes_on_where_it_was(tmp_path: Path) -> None:
    config = fit.FitConfig(steps=4, batch=2, change=Change(frames=20))
    where = fit.source([person()], None)

    def nothing(now: fit.Progress, step_s: float) -> None:
        pass

    straight = fit.begin([person()], config, 1)
    for part in straight.net.modules():
        if isinstance(part, torch.nn.Dropout):
            part.p = 0.0
    fit.fit(straight, where, config, 1, nothing)
    halved = fit.begin([person()], config, 1)
    resumed = fit.begin([person()], config, 2)
    for progress in (halved, resumed):
        for part in progress.net.modules():
            if isinstance(part, torch.nn.Dropout):
                part.p = 0.0
    stop_early(halved, where, config, nothing)
    train_temporal.keep(halved, tmp_path / "state.pt")
    train_temporal.resume(resumed, tmp_path / "state.pt")
    fit.fit(resumed, where, config, 1, nothing)
    pairs = zip(straight.mean.values(), resumed.mean.values(), strict=True)
    assert all(torch.allclose(a, b, atol=1e-6) for a, b in pairs)


def stop_early(progress: object, where: object, config: object, watch: object) -> None:
    """Take two of the four steps of the same schedule."""
    assert isinstance(progress, fit.Progress)
    assert isinstance(where, fit.Source)
    assert isinstance(config, fit.FitConfig)
    for step in range(2):
        rng = RandomNumbers([1, 2, step])
        share = float(np.interp(step, [0, config.steps], config.invented))
        fit.learn(progress, where.draw(config, share, rng), config)


@pytest.mark.parametrize("known", [False, True])
def test_a_known_up_moves_with_its_window_and_an_unknown_one_stays_nothing(known: bool) -> None:
    found = changed_by(Change(), batch_of(person(known=known)), 5)
    if not known:
        assert not found.shown.any()
        return
    angle = np.degrees(np.arccos(np.clip(np.sum(unit(found.shown) * found.up, -1), -1.0, 1.0)))
    assert 0.1 < angle.max() < 8.0
    assert np.ptp(angle, axis=1).max() < 1e-3
    assert np.abs(np.diff(found.shown, axis=1)).max() < 1e-6


def test_a_lifter_that_does_not_read_up_is_widened_and_answers_as_before(
    twins: tuple[Lifter, Flow, error_flow.Weights], tmp_path: Path
) -> None:
    lifter, coupled, _ = twins
    path, old = tmp_path / "new.safetensors", tmp_path / "old.safetensors"
    train_temporal.save(lifter, coupled, path)
    arrays = load_file(path)
    for name in ("mean", "scale", "enter.weight"):
        arrays[name] = arrays[name][..., :-3].contiguous()
    save_file(arrays, old)
    again = lifter_of(lifter.state_dict()).eval()
    again.load_state_dict(train_temporal.widened(old), strict=False)
    found, result = (
        net.features(torch.from_numpy(features.numbers(sight)[None].astype(np.float32)))
        for net, sight in ((lifter, person().sight), (again, person(known=True).sight))
    )
    assert torch.allclose(found, result, atol=2e-2)


def test_joined_networks_answer_with_their_mean(tmp_path: Path) -> None:
    paths = [tmp_path / "one.safetensors", tmp_path / "two.safetensors"]
    for path, width in zip(paths, (48, 64), strict=True):
        lifter = Lifter(width, 5)
        torch.nn.init.normal_(lifter.leave.weight, std=0.02)
        train_temporal.save(lifter, Flow(width), path)
    out = ["-o", str(tmp_path / "both.safetensors"), "--shares", "3", "1"]
    assert join.main([*map(str, paths), *out]) == 0
    both = temporal_network.load(tmp_path / "both.safetensors")
    own = [temporal_network.load(path) for path in paths]
    sight = person(known=True).sight
    found = temporal_lift.correct(sight, both)
    each = [temporal_lift.correct(sight, weights) for weights in own]
    mean = 0.75 * each[0].correction + 0.25 * each[1].correction
    assert np.abs(each[0].correction - each[1].correction).max() > 0.01
    assert np.abs(found.correction - mean).max() < 1e-5
    assert np.array_equal(found.features, each[0].features)
    assert np.allclose(found.tilt, each[0].tilt ** 0.75 * each[1].tilt ** 0.25, rtol=1e-5)


def test_a_calibrated_spread_holds_two_thirds_of_the_errors(
    twins: tuple[Lifter, Flow, error_flow.Weights],
) -> None:
    lifter = lifter_of(twins[0].state_dict())
    lifter.load_state_dict(twins[0].state_dict())
    examples = [person()]
    calibration.apply(lifter, calibration.factors(lifter, examples))
    again = calibration.factors(lifter, examples)
    assert np.abs(np.log(again)).max() < 0.35
    assert np.median(np.abs(np.log(again))) < 0.02


def test_the_first_network_of_a_joined_file_begins_a_training() -> None:
    arrays = train_temporal.widened(temporal_lift.WEIGHTS)
    config = fit.FitConfig(width=len(arrays["enter.bias"]), blocks=8)
    progress = fit.begin([person()], config, 1)
    train_temporal.begin_with(progress, temporal_lift.WEIGHTS)
    assert torch.equal(progress.mean["leave.weight"], arrays["leave.weight"])
    with pytest.raises(BadWeights, match="another size"):
        train_temporal.begin_with(fit.begin([person()], fit.FitConfig(), 1), temporal_lift.WEIGHTS)


def test_a_joined_file_is_not_joined_again() -> None:
    with pytest.raises(BadWeights, match="several networks already"):
        join.joined([temporal_lift.WEIGHTS, temporal_lift.WEIGHTS], [1.0, 1.0])


def test_the_losses_of_the_flow_are_finite_and_see_the_clean_clip() -> None:
    torch.manual_seed(3)
    lifter, coupled, batch = Lifter(48, 5).eval(), Flow(48), batch_of(person())
    found = flow_losses(coupled, lifter, batch, RandomNumbers([1]))
    assert set(found) == {"inverse", "forward", "boundary", "independence"}
    assert all(torch.isfinite(value) for value in found.values())
    clean = flow_losses(coupled, lifter, cleaned(batch), RandomNumbers([1]))
    assert clean["boundary"] == found["boundary"]
