"""The laws of the cache, on small stages over the real task machinery."""

import asyncio
import importlib
import json
import shutil
import sys
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from prefect import flow
from pydantic import TypeAdapter

from robojackson.mocap.recover import MocapConfig
from robojackson.mocap.temporal.temporal_lift import TemporalConfig
from robojackson.rl.config.paper_config import PaperConfig
from robojackson.rl.config.train_config import TrainConfig
from storage.artifact import Artifact
from storage.store import Store
from tasks import recover_motion, train_policy
from tasks.runtime import stage as caching
from tasks.runtime.code_digest import digest
from tests.fixtures.robots import description

FORMULA = '"""A formula."""\n\ndef formula(x):\n    """Twice."""\n    return 2 * x\n'
MODULES = {
    "__init__.py": "",
    "formula.py": FORMULA,
    "offset.py": "offset = 3\n",
    "io.py": """
from storage.store import Store
ran = []

def done(name, value):
    ran.append(name)
    return Store.from_environment().save(name, "value.txt", str(value).encode())

def value_of(artifact):
    return int(Store.from_environment().read(artifact.key))
""",
    "first.py": """
from standin import offset
from standin_io import done
from storage.artifact import Artifact
from tasks.runtime.stage import stage

@stage()
def first(number: int) -> Artifact:
    return done("first", number + offset.offset)
""",
    "second.py": """
from standin import formula
from standin_io import done, value_of
from storage.artifact import Artifact
from tasks.runtime.stage import stage

@stage()
def second(value: Artifact) -> Artifact:
    return done("second", formula.formula(value_of(value)))
""",
    "beside.py": """
from standin_io import done, value_of
from storage.artifact import Artifact
from tasks.runtime.stage import stage

@stage()
def beside(value: Artifact) -> Artifact:
    return done("beside", value_of(value) + _offset())

def _offset() -> int:
    return 7
""",
    "third.py": """
from standin_io import done, value_of
from storage.artifact import Artifact
from tasks.runtime.stage import stage

@stage(unkeyed=("hurry",))
def third(parts: dict[str, Artifact], hurry: bool = False) -> dict[str, Artifact]:
    return {"sum": done("third", sum(value_of(a) for a in parts.values()))}
""",
}


class Standin:
    """A package of four stages, and one pass through them: first -> second, beside -> third."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.ran: list[str] = importlib.import_module("standin_io").ran

    def rewrite(self, module: str, old: str, new: str) -> None:
        """Edit a module of the package, and load it again as another process would."""
        path = self.folder / f"{module}.py"
        text = path.read_text()
        assert old in text
        path.write_text(text.replace(old, new))
        shutil.rmtree(self.folder / "__pycache__", ignore_errors=True)
        importlib.reload(sys.modules[f"standin.{module}"])

    def run(self, number: int = 3, hurry: bool = False) -> tuple[list[str], dict[str, Artifact]]:
        """Return the names of the tasks that executed, and the results of all."""
        names = ("first", "second", "beside", "third")
        task = {name: getattr(importlib.import_module(f"standin.{name}"), name) for name in names}

        @flow(name="standin")
        async def everything() -> dict[str, Artifact]:
            one = task["first"](number)
            two, side = task["second"](one), task["beside"](one)
            total = task["third"]({"two": two, "side": side}, hurry)
            return {"first": one, "second": two, "beside": side, "third": total["sum"]}

        self.ran.clear()
        results = asyncio.run(everything())
        return list(self.ran), results

    def value(self, artifact: Artifact) -> int:
        """Return the number that a stage saved."""
        return int(Store.from_environment().read(artifact.key))


@pytest.fixture
def standin(
    tmp_path: Path, records: None, store_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> Iterator[Standin]:
    folder = tmp_path / "standin"
    folder.mkdir()
    for name, text in MODULES.items():
        (tmp_path / "standin_io.py" if name == "io.py" else folder / name).write_text(text)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(caching, "digest", partial(digest, package="standin", folder=folder))
    yield Standin(folder)
    for name in [name for name in sys.modules if name.startswith("standin")]:
        del sys.modules[name]


ALL = ["first", "second", "beside", "third"]


@pytest.mark.medium
def test_a_second_run_executes_nothing(standin: Standin) -> None:
    assert (standin.run()[0], standin.run()[0]) == (ALL, [])


@pytest.mark.medium
def test_another_configuration_executes_everything(standin: Standin) -> None:
    standin.run(3)
    assert standin.run(4)[0] == ALL


@pytest.mark.medium
def test_a_parameter_without_influence_executes_nothing(standin: Standin) -> None:
    standin.run(hurry=False)
    assert standin.run(hurry=True)[0] == []


def alter(path: Path) -> None:
    path.write_bytes(b"8")


@pytest.mark.medium
@pytest.mark.parametrize("harm", [Path.unlink, alter], ids=["deleted", "altered"])
@pytest.mark.parametrize("name", ALL)
def test_a_harmed_artifact_runs_its_task_alone_when_the_content_returns(
    standin: Standin, store_folder: Path, name: str, harm: Callable[[Path], None]
) -> None:
    _, results = standin.run()
    harm(store_folder / results[name].key)
    assert standin.run() == ([name], results)


@pytest.mark.medium
def test_a_formula_with_another_result_runs_its_stage_and_what_depends_on_it(
    standin: Standin,
) -> None:
    standin.run()
    standin.rewrite("formula", "2 * x", "5 * x")
    assert standin.run()[0] == ["second", "third"]


@pytest.mark.medium
def test_a_changed_helper_in_the_file_of_a_stage_runs_it_again(standin: Standin) -> None:
    standin.run()
    standin.rewrite("beside", "return 7", "return 9")
    assert standin.run()[0] == ["beside", "third"]


@pytest.mark.medium
def test_a_formula_with_the_same_result_runs_its_stage_alone(standin: Standin) -> None:
    standin.run()
    standin.rewrite("formula", "2 * x", "x + x")
    assert standin.run()[0] == ["second"]


@pytest.mark.medium
def test_a_deleted_artifact_that_comes_back_different_runs_all_that_depends_on_it(
    standin: Standin, store_folder: Path
) -> None:
    _, results = standin.run()
    (store_folder / results["first"].key).unlink()
    sys.modules["standin.offset"].offset = 4
    assert standin.run()[0] == ALL


@pytest.mark.medium
@pytest.mark.parametrize(
    ("old", "new"), [("2 * x", "2 * x  # doubled"), ("Twice.", "The double, metres.")]
)
def test_a_comment_or_a_docstring_runs_nothing(standin: Standin, old: str, new: str) -> None:
    standin.run()
    standin.rewrite("formula", old, new)
    assert standin.run()[0] == []


@pytest.mark.medium
def test_two_tasks_with_equal_inputs_do_not_collide(standin: Standin) -> None:
    _, results = standin.run(3)
    assert [standin.value(results[name]) for name in ("second", "beside")] == [12, 13]


def test_a_model_is_part_of_the_key(tmp_path: Path) -> None:
    keys = {
        caching.KeyRecipe("s", "", (), lambda parameters, m=model: [m], ()).key({})
        for model in ("a", "b")
    }
    assert len(keys) == 2


def test_a_version_is_part_of_the_key(monkeypatch: pytest.MonkeyPatch) -> None:
    stage = caching.KeyRecipe("s", "", (), lambda parameters: [], ())
    before = stage.key({})
    monkeypatch.setattr(caching, "versions", lambda: dict.fromkeys(caching.VERSIONED, "99"))
    assert stage.key({}) != before


def test_the_layout_of_tables_is_part_of_the_key(monkeypatch: pytest.MonkeyPatch) -> None:
    """A table with a column less than its schema could not be read out of the cache."""
    stage = caching.KeyRecipe("s", "", (), lambda parameters: [], ())
    before = stage.key({})
    monkeypatch.setattr(caching, "layout", lambda: "another column")
    assert stage.key({}) != before


def test_the_weights_of_the_temporal_network_are_part_of_the_key(tmp_path: Path) -> None:
    weights = tmp_path / "mine.safetensors"
    config = MocapConfig(temporal=TemporalConfig(weights=str(weights)))
    keys = []
    for content in (b"a", b"b"):
        weights.write_bytes(content)
        keys.append(recover_motion._models({"config": config}))
    assert keys[0] != keys[1]


def test_the_key_of_a_training_holds_the_minutes_that_were_requested() -> None:
    """Not those that the clock left, so that the same call again does not train again."""
    recipe = train_policy.train_policy.recipe
    robot = description("humanoid")
    given = {"config": TrainConfig(minutes=20.0), "robot": robot} | {"whole_pass": True}
    given |= {"limit_s": None}
    clocks = [None, *(train_policy.TrainingTime(at, 10.0) for at in (0.0, 1e9))]
    keys = {recipe.key({**given, "time_left": clock}) for clock in clocks}
    other = recipe.key({**given, "config": TrainConfig(minutes=30.0)})
    alone = recipe.key({**given, "whole_pass": False})
    assert len(keys) == 1
    assert len(keys | {other, alone}) == 3


def test_the_place_of_an_artifact_is_not_part_of_the_key() -> None:
    stage = caching.KeyRecipe("s", "", (), lambda parameters: [], ())
    here, there = (Artifact(key=key, sha256="0" * 64) for key in ("a/x", "b/y"))
    assert stage.key({"clip": here}) == stage.key({"clip": there})


def test_a_path_is_refused_as_an_input() -> None:
    with pytest.raises(TypeError, match="no content"):
        caching.identity({"clip": Path("a.mp4")})


def test_a_configuration_from_the_database_has_the_key_that_it_was_sent_with() -> None:
    """PostgreSQL's `jsonb` keeps the parameters of a run and orders their keys by itself."""
    sent = TrainConfig(paper=PaperConfig())
    plain = TypeAdapter(TrainConfig).dump_python(sent, mode="json")
    taken = TypeAdapter(TrainConfig).validate_python(_by_length(plain))
    assert list(taken.paper.weights) != list(sent.paper.weights)
    assert json.dumps(caching.identity(taken)) == json.dumps(caching.identity(sent))


def _by_length(value: Any) -> Any:
    """Return a value with its keys as `jsonb` has them: shorter ones first."""
    if not isinstance(value, dict):
        return value
    return {key: _by_length(value[key]) for key in sorted(value, key=lambda k: (len(k), k))}
