"""Options that commands share."""

from typing import get_args, get_type_hints

import pytest

from configs.finding import FindConfig
from configs.loader import load
from configs.pipeline import PipelineConfig
from configs.study import Study
from flows import cli, learning, search, studies
from flows.options import chosen
from robojackson.rl.config import TrainConfig


@pytest.mark.parametrize(
    ("command", "cls"),
    [
        (cli.dance, PipelineConfig),
        (cli.retarget, PipelineConfig),
        (learning.train, TrainConfig),
        (search.find, FindConfig),
        (search.refresh, FindConfig),
        (studies.ablation, Study),
    ],
)
def test_the_example_of_set_changes_what_the_command_reads(command, cls: type) -> None:
    _, option = get_args(get_type_hints(command, include_extras=True)["set_"])
    example = option.help.removeprefix("Change one value: --set ").removesuffix(".")
    assert load(cls, None, chosen([example])) != load(cls, None)
