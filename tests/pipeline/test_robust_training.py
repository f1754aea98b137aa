"""The settings of `--robust` beside given ones."""

from dataclasses import replace
from pathlib import Path

import pytest

from robojackson.api.robots import load_robot
from robojackson.cli.learning.training_request import requested, robust
from robojackson.errors import BadConfiguration, UnknownName
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.pipeline.robust_training import with_defaults
from robojackson.rl.evaluation.passport import ROBUST
from tests.fixtures.deploy_policies import swaying


def test_what_is_added_gives_way_to_what_is_given() -> None:
    added = {"a.b": 1, "c.d": 2, "e": 3}
    given = {"c.d": 9, "a": {"x": 7}, "f": 8}
    assert with_defaults(added, given) == {"a.b": 1, "e": 3, **given}
    for section in ({"b": 5}, "{b: 5}"):
        assert with_defaults(added, {"a": section}) == {"a": section, "c.d": 2, "e": 3}


def test_settings_of_a_training_may_be_named_as_in_a_pass() -> None:
    assert requested(None, None, {"train.seed": 3, "train.tqc.batch": 32}).train.seed == 3


@pytest.mark.parametrize(("robot", "observation"), [(None, "full"), ("g1", "onboard")])
def test_a_robust_training_is_that_of_the_motion_s_robot_or_of_the_named_one(
    tmp_path: Path, robot: str | None, observation: str
) -> None:
    reference = tmp_path / "reference.parquet"
    swaying(load_robot("humanoid")).save(reference)
    found = robust(reference, robot, None, None, {"seed": 3, "track.random.mass": 0.2})
    train = requested(None, None, found).train
    assert train.seed == 3
    assert (train.track.random.mass, train.track.random.pushes) == (0.2, ROBUST.pushes)
    assert train.track.observation == observation
    section = {"train.track.random": "{pushes: 0.25}"}
    varied = requested("base", None, robust(reference, robot, "base", None, section)).train
    assert (varied.track.random.mass, varied.track.random.pushes) == (ROBUST.mass, 0.25)
    made_elsewhere = replace(ReferenceMotion.load(reference), robot_file="/gone/robot.yaml")
    made_elsewhere.save(tmp_path / "gone.parquet")
    if robot is None:
        with pytest.raises(UnknownName, match=r"made for /gone/robot\.yaml.*give --robot FILE"):
            robust(tmp_path / "gone.parquet", robot, None, None, {})
    with pytest.raises(BadConfiguration, match="mode=paper"):
        robust(reference, robot, None, None, {"mode": "paper"})
