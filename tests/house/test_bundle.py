"""The clips and models in the repository are those that their provenance describes."""

import hashlib
import re
from pathlib import Path

import av
import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]
CLIPS = ROOT / "clips"
ASSETS = ROOT / "robojackson" / "assets"
FRAMES = {
    "hip_shake": 120, "dance_a": 98, "dance_b": 77, "walk": 78,
    "person_cam1": 100, "person_cam2": 100, "person_cam3": 100, "person_cam4": 100,
    "heldout/kick": 47, "heldout/spin": 133, "heldout/dance_a_aside": 98,
    "heldout/dance_b_aside": 77, "heldout/walk_aside": 78,
}  # fmt: skip
DANCERS = tuple(name for name in FRAMES if not name.startswith("person"))


def listed(folder: Path) -> dict[str, str]:
    rows = re.findall(
        r"\| `(\S+)` \| [\d,]+ \| `(\w{64})` \|", (folder / "PROVENANCE.md").read_text()
    )
    return dict(rows)


def truth(name: str) -> dict[str, np.ndarray]:
    return dict(np.load(CLIPS / f"{name}_gt.npz"))


def hip_shake_track(joint: str) -> np.ndarray:
    data = truth("hip_shake")
    return data["joints"][:, list(data["names"]).index(joint)]


@pytest.mark.parametrize("folder", [CLIPS, ASSETS])
def test_provenance_lists_every_file_and_no_other(folder: Path) -> None:
    found = (f for f in folder.rglob("*") if f.is_file() and f.suffix not in (".md", ".py"))
    files = {f.relative_to(folder).as_posix() for f in found}
    files.discard("pose_landmarker_heavy.task")  # built on request
    assert files == set(listed(folder))


@pytest.mark.parametrize("folder", [CLIPS, ASSETS])
def test_files_have_the_listed_digests(folder: Path) -> None:
    expected = listed(folder)
    actual = {name: hashlib.sha256((folder / name).read_bytes()).hexdigest() for name in expected}
    assert actual == expected


@pytest.mark.medium
@pytest.mark.parametrize("name", FRAMES)
def test_clip_decodes_to_the_stated_number_of_frames(name: str) -> None:
    with av.open(str(CLIPS / f"{name}.mp4")) as container:
        assert sum(1 for _ in container.decode(video=0)) == FRAMES[name]


@pytest.mark.parametrize("name", DANCERS)
def test_ground_truth_has_one_row_a_frame(name: str) -> None:
    data = truth(name)
    assert len(data["joints"]) == len(data["all_bones"]) == FRAMES[name]


@pytest.mark.parametrize("name", DANCERS)
def test_camera_of_the_ground_truth_sees_every_joint(name: str) -> None:
    data = truth(name)
    points = np.concatenate([data["joints"], np.ones((*data["joints"].shape[:2], 1))], -1)
    clip = points @ (data["proj"] @ data["view"]).T
    assert np.abs(clip[..., :2] / clip[..., 3:]).max() < 1.0


@pytest.mark.parametrize("joint", ["L_Ankle", "R_Ankle"])
def test_hip_shake_feet_stay_planted(joint: str) -> None:
    track = hip_shake_track(joint)
    assert np.ptp(track, axis=0).max() < 1e-4  # metres


def test_hip_shake_continues_over_the_seam_with_its_velocity() -> None:
    joints = truth("hip_shake")["joints"]
    cycle_offset = np.concatenate([joints, joints, joints])
    second_difference = np.linalg.norm(np.diff(cycle_offset, n=2, axis=0), axis=-1).max(1)
    seam = second_difference[len(joints) - 2 : len(joints) + 1].max()
    inside = second_difference[: len(joints) - 2].max()
    assert seam <= inside


def test_hip_shake_shifts_the_hips_by_twelve_centimetres() -> None:
    hips = (hip_shake_track("L_Hip") + hip_shake_track("R_Hip")) / 2
    assert 0.12 < np.ptp(hips[:, 0]) < 0.16  # metres, x is left


def test_hip_shake_keeps_the_hips_between_the_feet() -> None:
    hips = (hip_shake_track("L_Hip") + hip_shake_track("R_Hip"))[:, 0] / 2
    left, right = hip_shake_track("L_Ankle")[:, 0], hip_shake_track("R_Ankle")[:, 0]
    assert np.all((right + 0.1 < hips) & (hips < left - 0.1))
