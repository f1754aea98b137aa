"""The loader reads what YAML says and refuses what it does not know."""

import math
from pathlib import Path
from typing import Annotated, Any, Literal

import pytest
from pydantic import Field

from configs.find_config import FindConfig
from robojackson.config import config_dataclass
from robojackson.errors import BadConfiguration, UnknownName
from robojackson.pipeline import configuration_files, yaml_loader
from robojackson.pipeline.pipeline_config import PipelineConfig
from robojackson.rl.config.train_config import TrainConfig


@config_dataclass
class Inner:
    """A section."""

    width: float = 0.5
    cyclic: Literal["auto", "yes", "no"] = "auto"


@config_dataclass
class Outer:
    """A configuration."""

    seed: int = Field(0, ge=0)
    inner: Inner = Field(default_factory=Inner)
    maybe: Inner | None = None
    sites: dict[str, Inner] = Field(default_factory=dict)
    speed: Literal["auto"] | Annotated[float, Field(ge=0.25)] = "auto"


@pytest.fixture
def write(tmp_path: Path):
    def _write(text: str) -> Path:
        path = tmp_path / "given.yaml"
        path.write_text(text)
        return path

    return _write


def test_a_file_changes_only_what_it_names(write) -> None:
    assert yaml_loader.load(Outer, write("inner: {width: 0.25}")) == Outer(inner=Inner(width=0.25))


def test_an_empty_file_is_all_defaults(write) -> None:
    assert yaml_loader.load(Outer, write("# nothing\n")) == Outer()


@pytest.mark.parametrize(
    ("text", "path", "close"),
    [
        ("sed: 3", "sed", "seed"),
        ("inner: {widht: 0.1}", "inner.widht", "width"),
        ("maybe: {cylic: no}", "maybe.cylic", "cyclic"),
        ("sites: {hand: {wdth: 1}}", "sites.hand.wdth", ""),
    ],
)
def test_an_unknown_key_is_refused_with_file_and_path(write, text, path, close) -> None:
    given = write(text)
    with pytest.raises(BadConfiguration) as caught:
        yaml_loader.load(Outer, given)
    message = str(caught.value)
    assert str(given) in message
    assert f"unknown key '{path}'" in message
    assert not close or f"Did you mean '{close}'?" in message
    assert "\n" not in message


def test_a_wrong_value_is_refused_with_its_path_and_itself(write) -> None:
    with pytest.raises(BadConfiguration, match=r"'inner\.width' is 'wide'"):
        yaml_loader.load(Outer, write("inner: {width: wide}"))


def test_a_value_out_of_its_range_is_refused(write) -> None:
    with pytest.raises(BadConfiguration, match="greater than or equal to 0"):
        yaml_loader.load(Outer, write("seed: -1"))


def test_a_value_that_fits_no_alternative_is_reported_all_of_them(write) -> None:
    result = r"'speed' is -1: Input should be 'auto' or greater than or equal to 0\.25$"
    with pytest.raises(BadConfiguration, match=result):
        yaml_loader.load(Outer, write("speed: -1"))


@pytest.mark.parametrize("key", ["sed", "inner.widht", "inner.widht.more"])
def test_a_bad_override_is_blamed_on_itself_and_not_on_the_file(write, key: str) -> None:
    with pytest.raises(BadConfiguration) as caught:
        yaml_loader.load(Outer, write("seed: 1"), {"inner.cyclic": "no", key: "3"})
    assert str(caught.value).startswith(f"--set {key}: unknown key")


@pytest.mark.parametrize(("cls", "within"), [(TrainConfig, ""), (PipelineConfig, "train.")])
def test_values_that_do_not_go_together_are_named_and_no_others(cls: type, within: str) -> None:
    given = {"seed": "2", "tqc.policy_delay": "2", "tqc.updates_per_round": "25"}
    with pytest.raises(BadConfiguration) as caught:
        yaml_loader.load(cls, None, {within + key: value for key, value in given.items()})
    message = str(caught.value)
    blamed = f"{within}tqc.policy_delay, {within}tqc.updates_per_round"
    assert message.startswith(f"--set {blamed}: ")
    assert message.endswith("25, must be a multiple of tqc.policy_delay, 2")


def test_a_bad_file_is_blamed_though_an_override_was_given(write) -> None:
    given = write("sed: 1")
    with pytest.raises(BadConfiguration) as caught:
        yaml_loader.load(Outer, given, {"inner.cyclic": "no"})
    assert str(caught.value).startswith(f"{given}: ")


def test_yes_and_no_are_words(write) -> None:
    assert yaml_loader.load(Outer, write("inner: {cyclic: yes}")).inner.cyclic == "yes"


@pytest.mark.parametrize("text", ["1e-4", "1.0e-4", "0.0001"])
def test_a_number_may_be_written_with_an_exponent(write, text) -> None:
    assert yaml_loader.load(Outer, write(f"inner: {{width: {text}}}")).inner.width == 1e-4


def test_a_key_that_stands_twice_is_refused(write) -> None:
    with pytest.raises(
        BadConfiguration, match=r"yaml: line 2, column 1: key 'seed' is listed twice$"
    ):
        yaml_loader.load(Outer, write("seed: 1\nseed: 2\n"))


def test_a_mistake_is_named_with_its_place_and_without_the_text_around_it(write) -> None:
    expected = (
        r"yaml: line 2, column 5: expected ',' or '\]', but got ':' "
        r"\(while parsing a flow sequence that begins at line 1, column 8\)$"
    )
    with pytest.raises(BadConfiguration, match=expected):
        yaml_loader.load(Outer, write("inner: [a, b\nseed: 3\n"))


@pytest.mark.parametrize("text", ["- 1\n- 2\n", "just words", "inner: [", "\tseed: 1"])
def test_what_is_not_keys_and_values_is_refused_in_one_line(write, text) -> None:
    given = write(text)
    with pytest.raises(BadConfiguration) as caught:
        yaml_loader.load(Outer, given)
    assert str(given) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_an_override_wins_over_the_file(write) -> None:
    loaded = yaml_loader.load(Outer, write("seed: 1"), {"seed": "7", "inner.width": "0.125"})
    assert (loaded.seed, loaded.inner.width) == (7, 0.125)


def test_an_override_with_an_unknown_key_is_refused(write) -> None:
    with pytest.raises(BadConfiguration, match=r"inner\.hight"):
        yaml_loader.load(Outer, write(""), {"inner.hight": "1"})


def test_an_empty_name_is_one_of_its_folder() -> None:
    with pytest.raises(UnknownName, match=r"unknown robot '' .*Known: .*humanoid"):
        configuration_files.find("robots/")


def test_an_unknown_name_lists_the_known_ones() -> None:
    with pytest.raises(UnknownName, match=r"unknown robot 'c3po'.*humanoid"):
        yaml_loader.load(Outer, "robots/c3po")


@pytest.mark.parametrize(
    ("config", "listed"), [(FindConfig, "finding"), (PipelineConfig, "base, polish, smoke")]
)
@pytest.mark.parametrize("name", ["nosuch", "nosuch.yaml"])
def test_an_unknown_name_lists_the_configurations_of_its_class(
    config: type, listed: str, name: str
) -> None:
    with pytest.raises(UnknownName, match=f"Known: {listed}$"):
        yaml_loader.load(config, name)


@pytest.mark.parametrize(("folder", "kind"), [("studies", "study"), ("moves", "move")])
def test_what_is_unknown_is_called_what_it_is(folder: str, kind: str) -> None:
    with pytest.raises(UnknownName, match=f"unknown {kind} 'nosuch'"):
        configuration_files.find(f"{folder}/nosuch")


def test_a_folder_of_configurations_that_is_not_there_is_an_error(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """A worker runs elsewhere: its relative path would mean the shipped ones."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("ROBOJACKSON_CONFIGS", "mine")
    with pytest.raises(BadConfiguration, match=r"'mine'.*needs an absolute path"):
        configuration_files.find("base")


def test_a_name_does_not_lead_out_of_the_package() -> None:
    with pytest.raises(UnknownName):
        configuration_files.find("../tests/configs/given")


def test_a_link_to_a_configuration_elsewhere_is_one_of_its_folder(monkeypatch, tmp_path) -> None:
    (tmp_path / "shared.yaml").write_text("seed: 7\n")
    for inner in ("configs", "configs/setups"):
        (tmp_path / inner).mkdir()
        (tmp_path / inner / "own.yaml").symlink_to(tmp_path / "shared.yaml")
    monkeypatch.delenv("ROBOJACKSON_CONFIGS", raising=False)
    monkeypatch.chdir(tmp_path)
    found = [configuration_files.find(name) for name in ("own", "setups/own")]
    assert found == [tmp_path / "configs/own.yaml", tmp_path / "configs/setups/own.yaml"]
    with pytest.raises(UnknownName):
        configuration_files.find("../shared")


def test_names_are_found_from_any_folder(monkeypatch, tmp_path) -> None:
    monkeypatch.chdir(tmp_path)
    assert configuration_files.find("robots/humanoid").is_file()


@pytest.mark.parametrize(
    ("given", "expected_message"),
    [
        ({"tqc.quantiles": 2}, "must leave some of the 2 quantiles"),
        ({"tqc.buffer": 2000}, "room for 1984 transitions .* begin after 2000: raise buffer"),
        ({"tqc.buffer": 1000, "tqc.n_envs": 200, "tqc.warmup": 9, "tqc.n_steps": 5}, "the 5 trans"),
        ({"mode": "paper", "paper.curiosity": "formula"}, "set curiosity=formula instead"),
        ({"track.reward.curiosity": "formula"}, "set curiosity=formula instead"),
        ({"track.random.integrators": ["RK5"]}, "integrators"),
        ({"mode": "paper", "paper.weights": {}}, "one at least must count"),
    ],
)
def test_numbers_with_which_nothing_would_be_learnt_are_refused(
    given: dict[str, Any], expected_message: str
) -> None:
    with pytest.raises(BadConfiguration, match=expected_message):
        yaml_loader.load(TrainConfig, None, given)


@pytest.mark.parametrize(
    ("key", "value"),
    [
        *[("evaluate.threads", 0), ("evaluate.joint_noise", -1.0), ("evaluate.seed", -1)],
        *[("evaluate.max_lag", -0.1), ("evaluate.seconds", math.inf)],
        *[("mocap.cutoff_hz", -1.0), ("mocap.depth_cutoff_hz", 0.0), ("mocap.focal_px", -5.0)],
        *[("mocap.bone_trust", math.nan), ("mocap.focal_px", math.inf), ("mocap.bone_trust", 5.0)],
        *[("retarget.seed", -1), ("retarget.solver.damping", math.inf)],
        *[("retarget.weights.height", math.inf), ("train.seed", 2**32), ("train.seed", 2**31)],
        *[("train.track.episode_seconds", math.inf), ("train.track.reward.joints", math.nan)],
        *[("train.track.reward.sites_width", 0.0), ("train.tqc.learning_rate", math.inf)],
    ],
)
def test_numbers_that_no_stage_can_use_are_refused(key: str, value: float) -> None:
    with pytest.raises(BadConfiguration, match=key.rpartition(".")[2]):
        yaml_loader.load(PipelineConfig, None, {key: value})


@pytest.mark.parametrize(
    ("text", "seed"), [("010", 10), ("0o10", 8), ("0x10", 16), ("+7", 7), ("1000", 1000)]
)
def test_whole_numbers_are_those_of_yaml_1_2(text: str, seed: int) -> None:
    assert yaml_loader.load(Outer, None, {"seed": text}).seed == seed


@pytest.mark.medium
@pytest.mark.parametrize("text", ["1:30", "2024-13-45", "{[1]: 2}", "9" * 5000, "[" * 3000])
def test_what_is_no_value_is_reported_with_its_key(text: str) -> None:
    with pytest.raises(BadConfiguration, match="seed"):
        yaml_loader.load(Outer, None, {"seed": text})


@pytest.fixture
def extended(tmp_path: Path) -> Path:
    """Return a folder of configurations with a file that others extend."""
    text = "seed: 3\ninner: {width: 0.25, cyclic: no}\nspeed: 0.5\n"
    (tmp_path / "whole.yaml").write_text(text)
    return tmp_path


def test_a_file_that_extends_another_replaces_whole_keys(extended: Path) -> None:
    (extended / "part.yaml").write_text("extends: whole.yaml\ninner: {width: 0.5}\n")
    found = yaml_loader.load(Outer, extended / "part.yaml")
    assert found == Outer(seed=3, inner=Inner(width=0.5, cyclic="auto"), speed=0.5)


def test_a_name_is_extended_as_it_is_loaded(extended: Path, monkeypatch) -> None:
    monkeypatch.setenv("ROBOJACKSON_CONFIGS", str(extended))
    (extended / "part.yaml").write_text("extends: whole\nseed: 4\n")
    assert yaml_loader.load(Outer, "part") == Outer(4, Inner(0.25, "no"), speed=0.5)


@pytest.mark.parametrize(
    ("own", "wrong", "key"),
    [
        ("seed: 1", "whole.yaml", "inner.widht"),
        ("inner: {lenght: 1.0}", "part.yaml", "inner.lenght"),
        ("sped: 1.0", "whole.yaml", "inner.widht"),
    ],
)
def test_a_wrong_key_is_named_with_the_file_that_it_stands_in(
    extended: Path, own: str, wrong: str, key: str
) -> None:
    (extended / "whole.yaml").write_text("inner: {widht: 0.25}\n")
    (extended / "part.yaml").write_text(f"extends: whole.yaml\n{own}\n")
    with pytest.raises(BadConfiguration, match=rf"/{wrong}: unknown key '{key}'"):
        yaml_loader.load(Outer, extended / "part.yaml")


@pytest.mark.parametrize(
    ("base", "expected_message"),
    [
        ("part.yaml", r"part\.yaml: extends is 'part\.yaml', which extends this file"),
        ("gone", r"part\.yaml: extends is 'gone': unknown configuration 'gone'"),
        ("3", r"part\.yaml: extends is 3: "),
    ],
)
def test_a_base_that_cannot_be_is_reported_with_the_file_that_names_it(
    extended: Path, base: str, expected_message: str
) -> None:
    (extended / "part.yaml").write_text(f"extends: {base}\n")
    with pytest.raises(BadConfiguration, match=expected_message):
        yaml_loader.load(Outer, extended / "part.yaml")


def test_a_key_of_one_section_is_found_there() -> None:
    with pytest.raises(BadConfiguration, match=r"'phases'\. Did you mean 'evaluate\.phases'\?"):
        yaml_loader.load(PipelineConfig, "base", {"phases": 24})


@pytest.mark.parametrize("inner", ["reward", "reward.hands"])
def test_a_path_of_one_section_is_found_there_before_a_similar_key(inner: str) -> None:
    with pytest.raises(BadConfiguration) as caught:
        yaml_loader.load(PipelineConfig, "base", {f"track.{inner}": {} if inner == "reward" else 1})
    assert f"Did you mean 'train.track.{inner}'?" in str(caught.value)


def test_a_path_is_suggested_as_far_as_there_is_one() -> None:
    with pytest.raises(BadConfiguration, match=r"Did you mean 'train\.track\.reward'\?"):
        yaml_loader.load(PipelineConfig, "base", {"track.reward.hats": 1})


def test_a_value_that_a_rule_of_ours_refuses_is_explained_by_the_rule_alone() -> None:
    with pytest.raises(BadConfiguration, match=r"'tqc.entropy' is 'auto_0': auto_0 begins at zero"):
        yaml_loader.load(TrainConfig, None, {"tqc.entropy": "auto_0"})


@pytest.mark.parametrize("section_first", [True, False])
def test_a_key_wins_over_its_whole_section(section_first: bool) -> None:
    """An option such as --seed is a key; a section that is typed after it must not undo it."""
    given: list[tuple[str, object]] = [("train", "{steps: 100000}"), ("train.seed", 5)]
    found = yaml_loader.load(PipelineConfig, "base", dict(given if section_first else given[::-1]))
    assert (found.train.seed, found.train.steps) == (5, 100_000)
