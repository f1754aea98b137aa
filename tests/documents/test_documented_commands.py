"""Every command of README, CONTRIBUTING and docs is accepted by the program that it names."""

import ast
import importlib.util
import re
import subprocess
import sys
from collections.abc import Sequence
from functools import cache
from inspect import signature
from pathlib import Path
from typing import Any, get_args

import pytest
import typer
import yaml

import robojackson as rj
from configs.find_config import FindConfig
from configs.study_config import Study
from flows.cli.commands import app
from robojackson.cli.options import overrides_from
from robojackson.pipeline.pipeline_config import PipelineConfig
from robojackson.pipeline.yaml_loader import load
from robojackson.rl.config.train_config import TrainConfig
from tests.documents.documented import (
    ROOT,
    Documented,
    commands,
    python_blocks,
    shell_blocks,
)

GROUP: Any = typer.main.get_command(app)
SETTINGS: dict[str, tuple[type, str | None]] = {
    "train": (TrainConfig, None),
    "pretrain": (TrainConfig, None),
    "find": (FindConfig, "finding"),
    "refresh": (FindConfig, "finding"),
    "ablation": (Study, "studies/smoke"),
}
PLACEHOLDER = re.compile(r"^[A-Z_]+(\.[a-z]+)?$")
NAMES_ONLY = ("MissingParameter", "NoArgsIsHelpError")
"""What the parser says of a command that is named without its arguments."""
NAMED = ("COMMAND", "--install-completion", "--show-completion")
"""A placeholder; what looks at the shell that it runs in."""
DEPLOYMENTS = yaml.safe_load((ROOT / "prefect.yaml").read_text())["deployments"]


def parse(words: Sequence[str]) -> tuple[str, dict[str, Any]]:
    """Return the command's path and its parameters, as the real command line parses them.

    Raises:
        UsageError (typer's): an unknown command or option, or a wrong value.
    """
    given, group, path = list(words), GROUP, []
    context = click_context(group)
    while hasattr(group, "commands") and given:
        name, command, given = group.resolve_command(context, given)
        path.append(name)
        context, group = click_context(command, context), command
    made = group.make_context(path[-1] if path else "robojackson", filled(group, given))
    return " ".join(path), made.params


def click_context(command: Any, parent: Any = None) -> Any:
    """Return the context in which a group looks for its commands."""
    return command.context_class(command, info_name=command.name, parent=parent)


def filled(command: Any, given: Sequence[str]) -> list[str]:
    """Return the words with numbers and choices in place of placeholders such as N or FORMAT."""
    options = {name: each for each in command.params for name in each.opts}
    words = list(given)
    for at, word in enumerate(words):
        option = options.get(words[at - 1]) if at else None
        if option is None or not PLACEHOLDER.match(word):
            continue
        annotation = option.type_descriptor.annotation
        if annotation in (int, float):
            words[at] = "1"
        elif choices := get_args(annotation):
            words[at] = str(choices[0])
    return words


def robojackson_commands() -> list[Documented]:
    """Return those that say more than the program's name; NAMED are no commands of the program."""
    found = [each for each in commands("robojackson") if len(each.words) > 1]
    return [each for each in found if not each.words[1].startswith(NAMED)]


@pytest.mark.parametrize("documented", robojackson_commands(), ids=str)
def test_the_command_line_accepts_every_documented_command(documented: Documented) -> None:
    try:
        name, params = parse(documented.words[1:])
    except typer.Exit:  # --help, --version
        return
    except Exception as cause:
        if documented.in_text and type(cause).__name__ in NAMES_ONLY:
            return
        raise
    pairs = [pair for pair in params.get("set_") or () if not re.search(r"\b[A-Z]+\b", pair)]
    kind, usual = SETTINGS.get(name, (PipelineConfig, "base"))
    assert load(kind, usual, overrides_from(pairs))


@pytest.mark.parametrize("wrong", ["dance --no-such x", "danse", "train a -o b --seed many"])
def test_a_wrong_command_is_noticed(wrong: str) -> None:
    with pytest.raises(Exception, match=r"(?i)no such|valid"):
        parse(wrong.split())


def test_every_command_is_on_the_page_of_commands() -> None:
    page = (ROOT / "docs" / "commands.md").read_text()
    assert [name for name in GROUP.commands if f"`robojackson {name}" not in page] == []


@pytest.mark.parametrize("documented", commands("make"), ids=str)
def test_make_has_every_documented_target(documented: Documented) -> None:
    words = [word for word in documented.words if not PLACEHOLDER.match(word)]
    done = subprocess.run(
        [*words, "--dry-run"], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr


@cache
def help_of(module: str) -> str:
    """Return `--help` of a module; argparse ends before any work."""
    run = [sys.executable, "-m", module, "--help"]
    done = subprocess.run(run, cwd=ROOT, capture_output=True, text=True, check=False, timeout=120)
    assert done.returncode == 0, done.stderr[-2000:]
    return done.stdout


OTHERS = ("pytest", "venv", "http.server", "webbrowser", "flows.cli")
MODULES = [
    each
    for each in commands("python")
    if each.words[1:2] == ("-m",) and each.words[2] not in OTHERS
]


@pytest.mark.slow
@pytest.mark.parametrize("documented", MODULES, ids=str)
def test_every_documented_module_has_the_options_that_are_given(documented: Documented) -> None:
    module, *words = documented.words[2:]
    assert importlib.util.find_spec(module) is not None
    options = {word.partition("=")[0] for word in words if word.startswith("--")}
    if options:
        usage = help_of(module)
        assert {each for each in options if each not in usage} == set()


def deployments() -> list[Documented]:
    return [each for each in commands("prefect") if each.words[1:3] == ("deployment", "run")]


@pytest.mark.parametrize("documented", deployments(), ids=str)
def test_every_documented_deployment_takes_the_documented_parameters(
    documented: Documented,
) -> None:
    flow, _, name = documented.words[3].partition("/")
    points = {each["name"]: each["entrypoint"] for each in DEPLOYMENTS if _flow(each) == flow}
    assert name in points, points
    module, _, function = points[name].rpartition(".")
    target = getattr(importlib.import_module(module), function)
    given = [w for before, w in zip(documented.words, documented.words[1:], strict=False)
             if before in ("-p", "--param")]  # fmt: skip
    known = set(signature(target.fn).parameters)
    assert {each.partition("=")[0] for each in given} <= known


def _flow(deployment: dict[str, Any]) -> str:
    return str(deployment["entrypoint"]).rpartition(".")[2]


def test_every_documented_pool_is_one_of_the_deployments() -> None:
    pools = {each["work_pool"]["name"] for each in DEPLOYMENTS}
    workers = [each.words for each in commands("prefect") if each.words[1:2] == ("worker",)]
    assert workers
    assert {words[words.index("--pool") + 1] for words in workers} <= pools


def test_docker_compose_has_every_documented_service() -> None:
    services = set(yaml.safe_load((ROOT / "docker-compose.yml").read_text())["services"])
    text = "\n".join(block for _, block in shell_blocks())
    scaled = set(re.findall(r"--scale (\S+?)=", text))
    ran = set(re.findall(r"docker compose run --rm (\S+)", text))
    stopped = re.findall(r"docker compose stop (.+)", text)
    assert scaled | ran
    assert scaled | ran | {name for names in stopped for name in names.split()} <= services


@pytest.mark.parametrize(("page", "block"), shell_blocks(), ids=lambda text: text[:40])
def test_every_shell_block_is_valid_shell(page: str, block: str) -> None:
    done = subprocess.run(["bash", "-n"], input=block, capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"{page}: {done.stderr}"


@pytest.mark.parametrize(("page", "block"), python_blocks(), ids=lambda text: text[:40])
def test_every_python_block_names_public_functions(page: str, block: str) -> None:
    names = {
        node.attr
        for node in ast.walk(ast.parse(block))
        if isinstance(node, ast.Attribute)
        and isinstance(node.value, ast.Name)
        and node.value.id == "rj"
    }
    assert names <= set(rj.__all__), page


def test_the_readme_is_short() -> None:
    assert len((ROOT / "README.md").read_text().splitlines()) < 150


def test_named_scripts_are_there() -> None:
    scripts = [
        Path(word)
        for each in commands("python")
        for word in each.words[1:2]
        if word.endswith(".py") and not word.startswith("PACK/")
    ]
    found = (ROOT / path if path.parent.name else ROOT / "examples" / path for path in scripts)
    assert [path for path in found if not path.is_file()] == []
