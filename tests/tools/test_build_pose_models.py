"""The bundle builder refuses what it was not made for; the shipped bundles are its own."""

import hashlib
import io
import zipfile
from pathlib import Path

import pytest

from tools.assets import build_pose_models

ASSETS = Path(__file__).resolve().parents[2] / "robojackson" / "assets"


@pytest.mark.parametrize("size", ["lite", "full"])
def test_shipped_bundle_is_the_one_that_the_tool_builds(size: str) -> None:
    content = (ASSETS / f"pose_landmarker_{size}.task").read_bytes()
    assert hashlib.sha256(content).hexdigest() == build_pose_models.BUNDLE_SHA256[size]


def test_normalisation_can_be_read_back_from_a_shipped_bundle() -> None:
    schema, metadata = build_pose_models.tflite_schema, build_pose_models.metadata_schema
    with zipfile.ZipFile(ASSETS / "pose_landmarker_lite.task") as bundle:
        network = bundle.read("pose_landmarks_detector.tflite")
    model = schema.ModelT.InitFromObj(schema.Model.GetRootAsModel(network, 0))
    entry = next(m for m in model.metadata if m.name == build_pose_models.METADATA_NAME.encode())
    raw = bytes(model.buffers[entry.buffer].data)
    root = metadata.ModelMetadataT.InitFromObj(
        metadata.ModelMetadata.GetRootAsModelMetadata(raw, 0)
    )
    options = root.subgraphMetadata[0].inputTensorMetadata[0].processUnits[0].options
    assert (list(options.mean), list(options.std)) == ([0.0], [255.0])


def test_adding_the_normalisation_twice_leaves_one_entry() -> None:
    with zipfile.ZipFile(ASSETS / "pose_landmarker_lite.task") as bundle:
        network = bundle.read("pose_landmarks_detector.tflite")
    again = build_pose_models.with_normalization(network, 0.0, 255.0)
    lengths = [
        build_pose_models.tflite_schema.Model.GetRootAsModel(m, 0).MetadataLength()
        for m in (network, again)
    ]
    assert lengths[0] == lengths[1]


def test_wrong_tarball_is_refused_before_anything_is_written(tmp_path: Path) -> None:
    fake = tmp_path / "pose.tgz"
    fake.write_bytes(b"not a tarball")
    with pytest.raises(build_pose_models.BuildError, match="expected 8bb349a7"):
        build_pose_models.build(fake, ["lite"], tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_unknown_size_is_named_with_the_known_ones(tmp_path: Path) -> None:
    with pytest.raises(build_pose_models.BuildError, match=r"'hevy'; sizes: lite, full, heavy"):
        build_pose_models.build(tmp_path / "none.tgz", ["hevy"], tmp_path)


def test_bundle_parts_are_stored_and_not_compressed() -> None:
    content = (ASSETS / "pose_landmarker_full.task").read_bytes()
    with zipfile.ZipFile(io.BytesIO(content)) as bundle:
        assert {i.compress_type for i in bundle.infolist()} == {zipfile.ZIP_STORED}


def test_without_npm_the_way_around_is_reported(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(build_pose_models.shutil, "which", lambda name: None)
    with pytest.raises(build_pose_models.BuildError, match="pass --tarball"):
        build_pose_models.fetch_tarball(tmp_path)
