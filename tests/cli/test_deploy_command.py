"""`robojackson export POLICY --to deploy`: what it writes, and what it refuses in one line."""

import json
from pathlib import Path

import pytest

from robojackson.api.deploy_pack import write_deploy_pack
from robojackson.api.pack_parts import write_pack
from robojackson.api.policy_ingredients import motion_ingredients
from robojackson.cli.exporting import PackInputs, export, licences_from
from robojackson.errors import BadConfiguration, BadPolicy, StoreError
from robojackson.files.file_tree import FileTree
from robojackson.formats.deploy.licence_passport import Ingredient
from robojackson.motion.reference_motion import poses_sha256
from robojackson.rl.policy import Policy, load_policy
from robojackson.rl.policy_facts import networks_sha256
from tests.fixtures.commands import in_process, robojackson
from tests.fixtures.deploy_policies import random_policy, swaying
from tests.fixtures.robots import stock

FILES = {"policy.onnx", "policy_obs.onnx", "motion.npz", "deploy.yaml", "robot.xml", "run.py",
         "simulated_robot.py", "README.md", "LICENCES.md", "licences.json"}  # fmt: skip
COLUMNS = ("case", "strict_success", "success", "skill", "site_error_m", "kept")
ROWS = [("nominal", 1.0, 1.0, 0.5, 0.02, 1.0), ("gains x 0.8", 0.75, 0.8, 0.4, 0.03, None)]


def cases(weakest: float) -> list[dict[str, object]]:
    """Return a passport of two rows."""
    found = [dict(zip(COLUMNS, row, strict=True)) for row in ROWS]
    found[1]["strict_success"] = weakest
    return found


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Return a policy with its motion beside it."""
    reference = swaying(stock())
    reference.save(tmp_path / "reference.parquet")
    random_policy(stock(), reference).save(tmp_path / "policy.safetensors")
    return tmp_path


def test_the_command_writes_the_pack_and_reports_what_is_unknown(folder: Path) -> None:
    words = ("export", folder / "policy.safetensors", "--to", "deploy", "-o", folder / "pack")
    result = in_process(*words, "--json")
    assert result.code == 0, result.err
    answer = json.loads(result.out)
    assert {path.name for path in (folder / "pack").iterdir()} == FILES | {"licences"}
    assert answer["verdict"]["kind"] == "incomplete"
    assert "no sim-to-sim passport" in answer["verdict"]["sentence"]
    assert "licences unknown: clip, body models" in answer["verdict"]["sentence"].replace(
        "body models, clip", "clip, body models"
    )


def test_an_evaluation_beside_the_policy_brings_its_passport(folder: Path) -> None:
    (folder / "evaluation.json").write_text(json.dumps({"success": 1.0, "passport": cases(0.75)}))
    own = {"clip": "own", "motion": "own", "body models": "Apache-2.0"}
    inputs = PackInputs(licences=own)
    made = export(folder / "policy.safetensors", "deploy", folder / "pack", pack=inputs)
    assert json.loads((folder / "pack" / "passport.json").read_text()) == cases(0.75)
    assert "| gains x 0.8 | 75 | 80 | 0.4 | 30 | - |" in (folder / "pack" / "README.md").read_text()
    assert made["weakest_case"] == "gains x 0.8"
    assert "gains x 0.8, strict success 75 %" in made["verdict"]["sentence"]
    (folder / "evaluation.json").write_text(json.dumps({"success": 1.0, "passport": cases(1.0)}))
    made = export(folder / "policy.safetensors", "deploy", folder / "pack", pack=inputs)
    assert made["verdict"]["kind"] == "written"


@pytest.mark.parametrize("whose", [{"tracker": "regulator"}, {"networks_sha256": "0" * 64}])
def test_an_evaluation_of_a_tracker_or_of_other_networks_is_not_in_the_pack(
    folder: Path, whose: dict[str, str]
) -> None:
    policy, pack = folder / "policy.safetensors", folder / "pack"
    found = {"success": 1.0, "passport": cases(0.75), **whose}
    (folder / "evaluation.json").write_text(json.dumps(found))
    made = export(policy, "deploy", pack, pack=PackInputs(licences={}))
    assert "no sim-to-sim passport" in made["verdict"]["sentence"]
    with pytest.raises(BadConfiguration, match="not an evaluation of"):
        write_deploy_pack(policy, pack, evaluation=folder / "evaluation.json")
    found["networks_sha256"] = networks_sha256(load_policy(policy))
    found.pop("tracker", None)
    (folder / "evaluation.json").write_text(json.dumps(found))
    made = write_deploy_pack(policy, pack, evaluation=folder / "evaluation.json")
    assert made["passport_cases"] == 2


def test_an_evaluation_on_another_motion_is_not_in_the_pack(folder: Path) -> None:
    policy, pack, file = (
        folder / name for name in ("policy.safetensors", "pack", "evaluation.json")
    )
    found = {"success": 1.0, "passport": cases(0.75)}
    other = poses_sha256(swaying(stock(), cyclic=False))
    file.write_text(json.dumps({**found, "reference_sha256": other}))
    assert write_deploy_pack(policy, pack)["passport_cases"] == 0
    with pytest.raises(BadConfiguration, match=rf"another motion \(sha256 {other[:12]}, here"):
        write_deploy_pack(policy, pack, evaluation=file)
    own = poses_sha256(swaying(stock()))
    file.write_text(json.dumps({**found, "reference_sha256": own}))
    assert write_deploy_pack(policy, pack, evaluation=file)["passport_cases"] == 2


def test_a_pack_without_a_network_needs_no_runtime_for_networks(folder: Path) -> None:
    machine, reference = stock(), folder / "reference.parquet"
    for network in (True, False):
        found = motion_ingredients(reference, machine, network=network)
        assert ("onnxruntime" in {one.name for one in found}) == network


def test_a_pack_takes_the_place_of_another(folder: Path) -> None:
    pack = folder / "pack"
    for name in ("policy_obs.onnx", "passport.json", "own_notes.txt"):
        (pack / name).parent.mkdir(exist_ok=True)
        (pack / name).write_bytes(b"of an earlier pack")
    clip = [Ingredient("clip", "dance.mp4", "own")]
    write_pack(pack, {"deploy.yaml": b""}, clip, None)
    assert (pack / "passport.json").exists(), "the folder held no pack"
    write_pack(pack, {"deploy.yaml": b"", "policy.onnx": b"new"}, clip, None)
    assert {path.name for path in pack.iterdir()} == {"deploy.yaml", "policy.onnx", "own_notes.txt"}


def test_files_of_something_else_are_not_replaced(folder: Path) -> None:
    """A project's own README.md and run.py were overwritten without a word."""
    own = folder / "project" / "README.md"
    own.parent.mkdir()
    own.write_text("mine")
    with pytest.raises(StoreError, match=r"README\.md: of something else.*folder \(-o\)") as caught:
        write_deploy_pack(folder / "policy.safetensors", own.parent)
    assert "\n" not in str(caught.value)
    assert [path.name for path in own.parent.iterdir()] == ["README.md"]
    assert own.read_text() == "mine"


def test_a_pack_that_was_interrupted_is_written_again(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    written: list[str] = []
    monkeypatch.setattr(FileTree, "write", lambda tree, name, content: written.append(name))
    write_deploy_pack(folder / "policy.safetensors", folder / "pack")
    assert written[0] == "deploy.yaml", "by which the folder is a pack"


def test_a_policy_that_sees_what_no_robot_measures_is_refused(folder: Path) -> None:
    random_policy(stock(), swaying(stock()), "full").save(folder / "full.safetensors")
    with pytest.raises(BadPolicy, match=r"train with --set track\.observation=onboard") as caught:
        export(folder / "full.safetensors", "deploy", folder / "pack")
    assert "\n" not in str(caught.value)
    assert not (folder / "pack").exists()


@pytest.mark.parametrize("facts", [{"mode": "paper"}, {"control": {"law": "hold"}}])
def test_another_mode_or_law_is_refused(folder: Path, facts: dict) -> None:
    policy = random_policy(stock(), swaying(stock()))
    Policy(policy.layers, {**policy.facts, **facts}).save(folder / "other.safetensors")
    with pytest.raises(BadPolicy, match="needs mode track, law pd"):
        export(folder / "other.safetensors", "deploy", folder / "pack")


def test_a_policy_that_needs_the_feedback_of_the_full_state_is_refused(folder: Path) -> None:
    """A pack cannot hold it: the robot would get another controller than the one evaluated."""
    policy = random_policy(stock(), swaying(stock()))
    control = {**policy.facts["control"], "feedback": 1.0}  # type: ignore[dict-item]
    Policy(policy.layers, {**policy.facts, "control": control}).save(folder / "fed.safetensors")
    with pytest.raises(BadPolicy, match=r"root_state=estimated"):
        export(folder / "fed.safetensors", "deploy", folder / "pack")


def test_another_motion_than_the_policys_is_refused(folder: Path) -> None:
    swaying(stock(), cyclic=False).save(folder / "reference.parquet")
    with pytest.raises(BadPolicy, match=r"is not the motion .* give it with --reference"):
        export(folder / "policy.safetensors", "deploy", folder / "pack")


def test_a_policy_without_its_motion_names_the_option(folder: Path) -> None:
    (folder / "reference.parquet").rename(folder / "elsewhere.parquet")
    with pytest.raises(StoreError, match="--reference FILE"):
        export(folder / "policy.safetensors", "deploy", folder / "pack")
    inputs = PackInputs(reference=folder / "elsewhere.parquet")
    assert export(folder / "policy.safetensors", "deploy", folder / "pack", pack=inputs)["files"]


def test_options_of_the_pack_are_refused_for_another_format(folder: Path) -> None:
    inputs = PackInputs(licences={"clip": "own"})
    with pytest.raises(BadConfiguration, match="for --to deploy"):
        export(folder / "policy.safetensors", "onnx", folder / "policy.onnx", pack=inputs)


def test_a_declared_licence_needs_its_kind() -> None:
    assert licences_from(["clip=CC-BY-4.0", "body models = MIT"]) == {
        "clip": "CC-BY-4.0",
        "body models": "MIT",
    }
    with pytest.raises(BadConfiguration, match="expected KIND=LICENCE"):
        licences_from(["CC-BY-4.0"])


@pytest.mark.slow
def test_the_help_lists_the_pack_among_the_formats_of_policies() -> None:
    result = robojackson("export", "--help")
    assert "a policy: deploy, onnx" in " ".join(result.out.replace("│", " ").split())
