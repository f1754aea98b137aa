"""The walkers that trainings start from, as short as a training can be."""

import json
import shlex
from pathlib import Path

from flows import walker
from robojackson.rl.networks import load_networks

TINY = {
    "trainer": "sb3",
    "steps": 64,
    "seed": 3,
    **{"tqc.n_envs": 2, "tqc.warmup": 16, "tqc.batch": 8, "tqc.updates_per_round": 1},
}


def test_a_walker_for_the_papers_mode_takes_all_348_observations(tmp_path: Path) -> None:
    made = walker.pretrain("paper", tmp_path, None, TINY)
    networks = load_networks(Path(made["walker"]))
    assert networks.observation_size == 348
    assert not networks.tensors["actor.0.weight"][45:].any()
    told = json.loads((tmp_path / "walker.json").read_text())
    assert shlex.split(told["command"])[:4] == ["robojackson", "pretrain", "--kind", "paper"]
    assert (told["seed"], told["steps"]) == (3, 64)
    assert told["evaluation"]["episode_return"] > 0
    assert [point["step"] for point in told["curve"]] == sorted(p["step"] for p in told["curve"])
