"""Sampled paths: what is found is what the physics does, and the regulator along it keeps to it."""

from collections.abc import Callable

import numpy as np
import pytest

from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.rl.config.train_config import ControlConfig
from robojackson.rl.feedback import path_search, sampled_regulator
from robojackson.rl.feedback.driven_clip import driven_clip
from robojackson.rl.feedback.keypoint_rule import KeypointRule
from robojackson.rl.feedback.nominal_path import Gains, Linear, Path
from robojackson.rl.feedback.path_search import PathSearch
from robojackson.rl.feedback.path_trial import Held, Trial
from robojackson.rl.feedback.regulator import advance, regulator, riccati
from robojackson.rl.feedback.standing_feet import Feet
from robojackson.rl.sim.motors import residual_scale
from robojackson.rl.sim.reference_clip import Clip
from robojackson.rl.sim.simulation import Simulation
from robojackson.robot.model import Robot

pytestmark = [pytest.mark.medium, pytest.mark.xdist_group("path_search")]
LED = ControlConfig(feedforward=1.0, feedback=0.0)
STEPS = 40


@pytest.fixture(autouse=True)
def _few(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(path_search, "SAMPLES", 24)
    monkeypatch.setattr(path_search, "KEPT", 6)
    monkeypatch.setattr(sampled_regulator, "EFFORTS", (1.0,))


@pytest.fixture(scope="module")
def clip(robot: Robot, sway: ReferenceMotion) -> Clip:
    return driven_clip(robot, sway, LED)


@pytest.fixture(scope="module")
def sim(robot: Robot) -> Simulation:
    return Simulation(robot, LED, 1)


@pytest.fixture(scope="module")
def plain(robot: Robot, sim: Simulation, clip: Clip) -> tuple[Gains, Path, Linear]:
    return regulator(sim, clip, residual_scale(robot, ControlConfig()), Feet(robot).count)


@pytest.fixture
def found(
    robot: Robot,
    sim: Simulation,
    clip: Clip,
    plain: tuple[Gains, Path, Linear],
    monkeypatch: pytest.MonkeyPatch,
) -> Callable[[], Gains]:
    """What is taken for the motion, whose own regulator is not computed again."""
    monkeypatch.setattr(sampled_regulator, "regulator", lambda *given: plain)
    action = residual_scale(robot, ControlConfig())
    return lambda: sampled_regulator.sampled_regulator(robot, sim, clip, action)


def searched(
    robot: Robot, sim: Simulation, plain: tuple[Gains, Path, Linear], seed: int
) -> tuple[Path, Path]:
    """Return the motion's first steps as a path, and one that was found beside it."""
    action, feet = residual_scale(robot, ControlConfig()), Feet(robot)
    _, path, linear = plain
    path = Path(path.qpos[:STEPS], path.qvel[:STEPS], path.targets[:STEPS])
    law = riccati(linear, action, cyclic=True)
    rule = KeypointRule(robot)
    search = PathSearch(sim, action, feet, rule, path, np.random.default_rng(seed))
    return path, search.run(path, law, 0)[0]


def test_the_physics_follows_the_path_that_is_found(
    robot: Robot, sim: Simulation, plain: tuple[Gains, Path, Linear]
) -> None:
    path, found = searched(robot, sim, plain, 0)
    assert len(found) > 2 * path_search.WINDOW
    np.testing.assert_array_equal(found.qpos[0], path.qpos[0])
    qpos, qvel = advance(sim, found.qpos[:-1], found.qvel[:-1], found.targets[:-1])
    np.testing.assert_allclose(qpos, found.qpos[1:], atol=1e-6)
    np.testing.assert_allclose(qvel, found.qvel[1:], atol=1e-4)
    again = searched(robot, sim, plain, 0)[1]
    np.testing.assert_array_equal(again.qpos, found.qpos)


def test_a_path_is_joined_to_the_motion(
    robot: Robot, sim: Simulation, plain: tuple[Gains, Path, Linear]
) -> None:
    path, found = searched(robot, sim, plain, 0)
    feet = Feet(robot)
    search = PathSearch(sim, np.ones(17), feet, KeypointRule(robot), path, np.random.default_rng(0))
    joined = search.joined(path, found, 0, 10)
    np.testing.assert_array_equal(joined.qpos[:10], found.qpos[:10])
    np.testing.assert_array_equal(joined.qpos[10:], path.qpos[10:])


def test_few_robots_go_on_from_one_parent() -> None:
    score = np.arange(40.0)
    rows = path_search._best(score, np.repeat([0, 1], 20), np.zeros(40))
    assert (rows < path_search.CHILDREN).sum() <= path_search.CHILDREN
    assert list(rows) == sorted(rows)


def test_robots_that_broke_the_rule_go_on_only_if_too_few_kept_it() -> None:
    score, broken = np.arange(40.0), np.where(np.arange(40) < 36, 2.0, 0.0)
    broken[0] = 1.0
    rows = path_search._best(score, np.arange(40), broken)
    np.testing.assert_array_equal(rows, [36, 37, 38, 39, 0, 1][: path_search.KEPT])


def test_feet_that_stand_decide_how_far_a_robot_is_from_its_place(robot: Robot) -> None:
    feet = Feet(robot)
    qpos = np.tile(robot.standing, (2, 1))
    places = feet.places(qpos)
    qpos[1, :2] += [0.3, -0.2]
    np.testing.assert_allclose(feet.apart(qpos, places), [[0, 0], [0.3, -0.2]], atol=1e-9)
    qpos[1, :2] -= [0.3, -0.2]
    qpos[1, 7:][robot.joint_names.index("left_hip_y")] -= 0.8  # one leg raised forwards
    assert np.abs(feet.apart(qpos, places)[1]).max() < 0.02


@pytest.mark.slow
def test_the_regulator_that_brings_more_robots_to_the_end_by_the_rule_is_taken(
    found: Callable[[], Gains],
    plain: tuple[Gains, Path, Linear],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(sampled_regulator, "PASSES", 1)
    monkeypatch.setattr(sampled_regulator, "PASSES_A_S", 0.0)
    monkeypatch.setattr(sampled_regulator, "CYCLES_S", 0.0)
    monkeypatch.setattr(sampled_regulator, "TRIES", 1)
    monkeypatch.setattr(sampled_regulator, "refinements", lambda *given: ())
    for shares, anchored in (((0.9,), False), ((0.5, 0.4), False), ((0.5, 0.6), True)):
        held = iter(Held(share, 1.0, 1.0) for share in shares)
        monkeypatch.setattr(Trial, "held", lambda *given, held=held: next(held))
        gains = found()
        assert bool(np.isfinite(gains.places).all()) == anchored
        assert gains.held == max(shares)
        if not anchored:
            np.testing.assert_array_equal(gains.gain, plain[0].gain)


def test_no_search_follows_one_that_holds_nearly_all(
    found: Callable[[], Gains],
    plain: tuple[Gains, Path, Linear],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    held = iter([0.0, 0.5, 0.95, 1.0])
    monkeypatch.setattr(sampled_regulator, "_searched", lambda *given: (*plain[1:], False))
    monkeypatch.setattr(sampled_regulator, "_followed", lambda *given: given[-2:])
    monkeypatch.setattr(sampled_regulator, "_gains", lambda *given: plain[0])
    monkeypatch.setattr(Trial, "held", lambda *given: Held(next(held), 1.0, 1.0))
    assert found().held == 0.95
    assert next(held) == 1.0, "a search more than needed"


@pytest.mark.parametrize(
    ("shares", "taken"),
    [
        ((0.97, 1.0, 1.0), 1.0),
        ((0.6, 0.9, 0.93), 0.5),
        ((0.6, 0.9, 0.97), 0.25),
        ((0.9, 0.87, 0.8), 0.5),
        ((0.9, 0.6, 0.5), 1.0),
        ((0.0, 0.0, 0.5), 1.0),
    ],
)
def test_a_stiffer_regulator_is_taken_unless_another_holds_clearly_more(
    found: Callable[[], Gains],
    clip: Clip,
    robot: Robot,
    plain: tuple[Gains, Path, Linear],
    monkeypatch: pytest.MonkeyPatch,
    shares: tuple[float, ...],
    taken: float,
) -> None:
    efforts, held = (1.0, 0.5, 0.25), iter(shares)
    monkeypatch.setattr(sampled_regulator, "EFFORTS", efforts)
    monkeypatch.setattr(sampled_regulator, "ENOUGH", 0.0)
    monkeypatch.setattr(Trial, "held", lambda *given: Held(next(held), 1.0, 1.0))
    gains = found()
    action = residual_scale(robot, ControlConfig())
    law = riccati(plain[2], action / np.sqrt(taken), clip.cyclic)
    np.testing.assert_allclose(gains.gain, law.gain, rtol=1e-6)
    assert gains.held == shares[efforts.index(taken)]


@pytest.mark.parametrize(
    ("shares", "searches"), [((0.1, 0.2, 0.3, 0.4, 0.45), 4), ((0.1, 0.6), 2), ((0.6,), 1)]
)
def test_a_long_motion_is_searched_again_only_while_little_is_held(
    found: Callable[[], Gains],
    plain: tuple[Gains, Path, Linear],
    monkeypatch: pytest.MonkeyPatch,
    shares: tuple[float, ...],
    searches: int,
) -> None:
    held, done = iter([0.0, *shares]), list[int]()

    def searched(*given: object) -> tuple[Path, Linear, bool]:
        done.append(1)
        return (*plain[1:], False)

    monkeypatch.setattr(sampled_regulator, "TRIED_S", 0.0)
    monkeypatch.setattr(sampled_regulator, "_searched", searched)
    monkeypatch.setattr(sampled_regulator, "_followed", lambda *given: given[-2:])
    monkeypatch.setattr(sampled_regulator, "_gains", lambda *given: plain[0])
    monkeypatch.setattr(Trial, "held", lambda *given: Held(next(held), 1.0, 1.0))
    assert found().held == max(shares[:searches])
    assert len(done) == searches


def test_a_path_nearer_to_the_motion_is_taken_if_it_holds_about_as_many_robots(
    found: Callable[[], Gains],
    plain: tuple[Gains, Path, Linear],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    refined = [plain[1:], plain[1:]]
    monkeypatch.setattr(sampled_regulator, "_searched", lambda *given: (*plain[1:], True))
    monkeypatch.setattr(sampled_regulator, "refinements", lambda *given: refined)
    monkeypatch.setattr(sampled_regulator, "TRIES", 1)
    monkeypatch.setattr(sampled_regulator, "replace", lambda best, held: best)
    shares_taken = (
        ((0.8, 0.77, 0.75), "nearer"),
        ((0.8, 0.75, 0.85), "nearest"),
        ((0.9, 0.87, 0.86), "searched"),
    )
    for shares, taken in shares_taken:
        held, names = iter([0.1, *shares]), iter(["searched", "nearer", "nearest"])
        monkeypatch.setattr(sampled_regulator, "_followed", lambda *given: given[-2:])
        monkeypatch.setattr(sampled_regulator, "_gains", lambda *given, names=names: next(names))
        monkeypatch.setattr(Trial, "held", lambda *given, held=held: Held(next(held), 1.0, 1.0))
        assert found() == taken


def test_a_path_nearer_to_the_motion_that_brings_none_to_the_end_is_not_taken(
    found: Callable[[], Gains],
    plain: tuple[Gains, Path, Linear],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    names = iter(["searched", "nearer"])
    held = iter([Held(0.0, 0.0, 0.1), Held(0.0, 0.94, 0.95), Held(0.02, 0.02, 0.3)])
    monkeypatch.setattr(sampled_regulator, "_searched", lambda *given: (*plain[1:], True))
    monkeypatch.setattr(sampled_regulator, "refinements", lambda *given: [plain[1:]])
    monkeypatch.setattr(sampled_regulator, "TRIES", 1)
    monkeypatch.setattr(sampled_regulator, "replace", lambda best, held: best)
    monkeypatch.setattr(sampled_regulator, "_followed", lambda *given: given[-2:])
    monkeypatch.setattr(sampled_regulator, "_gains", lambda *given: next(names))
    monkeypatch.setattr(Trial, "held", lambda *given: next(held))
    assert found() == "searched"


class Falls:
    """A search whose robots always fall after so many steps, wherever they begin."""

    def __init__(self, reach: int) -> None:
        self.reach, self.tried = reach, list[tuple[int, int]]()

    def run(
        self, path: Path, law: object, begin: int, breadth: int, progress: object
    ) -> tuple[Path, bool]:
        """Return the path up to the fall."""
        self.tried.append((begin, breadth))
        rows = slice(begin, min(self.reach, len(path)))
        return Path(path.qpos[rows], path.qvel[rows], path.targets[rows]), False

    def joined(self, path: Path, found: Path, begin: int, kept: int) -> Path:
        """Return the path itself."""
        return path


def test_a_search_that_does_not_advance_gets_broader_begins_earlier_and_ends(
    plain: tuple[Gains, Path, Linear], sim: Simulation, monkeypatch: pytest.MonkeyPatch
) -> None:
    _, path, linear = plain
    repeated = Path(*(np.tile(part, (6, 1)) for part in (path.qpos, path.qvel, path.targets)))
    monkeypatch.setattr(sampled_regulator, "_with", lambda linear, *rest: linear)
    monkeypatch.setattr(sampled_regulator, "riccati", lambda *given: None)
    search = Falls(reach=360)
    sampled_regulator._searched(
        search,
        sim,
        repeated,
        linear,
        np.ones(1),
        0.015,
        lambda *given: None,  # type: ignore[arg-type]
    )
    begins, breadths = zip(*search.tried, strict=True)
    assert breadths == (1, 1, 2, 3, 4)
    assert list(begins[1:]) == sorted(begins[1:], reverse=True)
    assert begins[1] > begins[-1] > 0
