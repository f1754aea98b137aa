"""Options that commands share."""

from typing import get_args, get_type_hints

import pytest

from configs.find_config import FindConfig
from configs.study_config import Study
from flows.cli import commands, search_commands, study_commands
from robojackson.cli import app, learning_commands
from robojackson.cli.options import overrides_from
from robojackson.pipeline.pipeline_config import PipelineConfig
from robojackson.pipeline.yaml_loader import load
from robojackson.rl.config.train_config import TrainConfig


@pytest.mark.parametrize(
    ("command", "cls"),
    [
        (commands.dance, PipelineConfig),
        (app.retarget, PipelineConfig),
        (learning_commands.train, TrainConfig),
        (search_commands.find, FindConfig),
        (search_commands.refresh, FindConfig),
        (study_commands.ablation, Study),
    ],
)
def test_the_example_of_set_changes_what_the_command_reads(command, cls: type) -> None:
    _, option = get_args(get_type_hints(command, include_extras=True)["set_"])
    example = option.help.removeprefix("Change one value: --set ").removesuffix(".")
    assert load(cls, None, overrides_from([example])) != load(cls, None)
