"""Every command of the program is run by a test, not only parsed: which one stands here.

`test_documented_commands` parses each documented command with all of its options; the tests below
run the commands with clips, budgets and stores of a test.
"""

import pytest

from tests.documents.documented import ROOT, commands
from tests.documents.test_documented_commands import GROUP

TUTORIAL = "tests/documents/test_tutorial.py"
STAGES = "tests/cli/test_stages.py"
ROBOTS = "tests/cli/test_robot_commands.py"
RUN_BY = {
    "ablation": ("tests/deploy/test_documented_server.py", 'robojackson("ablation", '),
    "backup": ("tests/flows/cli/test_backup_commands.py", 'invoke("backup", '),
    "catalogue": ("tests/flows/test_find.py", 'robojackson("catalogue", '),
    "clean": ("tests/flows/cli/test_clean_command.py", 'in_process("clean", '),
    "dance": ("tests/deploy/test_documented_server.py", 'robojackson("dance", '),
    "deploy": ("tests/package/test_deployed_wheel.py", '("robojackson", "deploy", '),
    "doctor": (TUTORIAL, '("doctor",)'),
    "evaluate": (STAGES, 'robojackson("evaluate", '),
    "export": ("tests/cli/test_exporting.py", 'robojackson("export", '),
    "find": ("tests/flows/test_find.py", 'robojackson("find", '),
    "gallery": ("tests/flows/cli/test_gallery_command.py", 'in_process("gallery", '),
    "import": ("tests/cli/test_importing.py", 'robojackson("import", '),
    "licences": (TUTORIAL, '("licences",)'),
    "metrics": (TUTORIAL, '("metrics",)'),
    "mocap": (STAGES, 'robojackson("mocap", '),
    "perform": ("tests/cli/trackers/test_perform.py", '"perform", '),
    "pretrain": ("tests/flows/test_pretrain.py", "pretrain.pretrain.fn("),
    "refresh": ("tests/flows/test_refresh.py", "refresh(dances, "),
    "restore": ("tests/flows/cli/test_backup_commands.py", 'invoke("restore", '),
    "retarget": (STAGES, 'robojackson("retarget", '),
    "robots": (ROBOTS, '"robojackson", "robots", '),
    "robots add": (ROBOTS, 'in_process("robots", "add", '),
    "robots check": (ROBOTS, 'robojackson("robots", "check", '),
    "robots new": (ROBOTS, 'in_process("robots", "new", '),
    "score": (STAGES, 'robojackson("score", '),
    "server": ("tests/deploy/test_documented_server.py", '"robojackson", "server", '),
    "trackers": ("tests/cli/trackers/test_tracker_commands.py", 'in_process("trackers"'),
    "trackers add": (
        "tests/cli/trackers/test_tracker_commands.py",
        'in_process("trackers", "add", ',
    ),
    "train": (STAGES, 'robojackson("train", '),
    "view": ("tests/cli/pictures/test_view_command.py", 'in_process("view", '),
}
"""File and call that run a command; `pretrain` and `refresh` are run as the flows they start."""


def command_names() -> set[str]:
    """Return all commands of the program, those of a group as `robots add`."""
    below = {
        f"{name} {each}"
        for name, command in GROUP.commands.items()
        for each in getattr(command, "commands", ())
    }
    return set(GROUP.commands) | below


def test_a_test_is_named_for_every_command() -> None:
    assert set(RUN_BY) == command_names()


@pytest.mark.parametrize("name", RUN_BY)
def test_the_named_file_runs_the_command(name: str) -> None:
    file, call = RUN_BY[name]
    assert call in (ROOT / file).read_text(encoding="utf-8")


def test_every_documented_command_is_among_them() -> None:
    documented = {
        each.words[1] for each in commands("robojackson")
        if len(each.words) > 1 and each.words[1].islower() and not each.words[1].startswith("-")
    }  # fmt: skip
    assert documented <= {name.split()[0] for name in RUN_BY}
