"""From a network's numbers to a motion on the floor, with networks that know the truth."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from scipy.spatial.transform import Rotation

from robojackson.body.forward_kinematics import forward, split
from robojackson.body.skeleton import AIM_CHILD, REST_JOINTS
from robojackson.metrics import pose_error
from robojackson.mocap.landmarks.blazepose import repair
from robojackson.mocap.landmarks.pinhole_camera import Pinhole, guess_focal
from robojackson.mocap.networks import crop_to_camera, niki, person_crop
from robojackson.mocap.networks.hybrik_net import HybrikNet, NetworkOutput
from robojackson.mocap.networks.inference import Networks, estimate
from robojackson.mocap.networks.network_config import NetworkConfig
from robojackson.mocap.networks.network_motion import network_motion, resampled
from robojackson.mocap.pose.known_twist import pose_keypoints
from robojackson.mocap.recover import MocapConfig, recover_motion
from robojackson.motion.landmark_track import LandmarkTrack
from robojackson.motion.smpl_sequence import SmplSequence

CONFIG = NetworkConfig(hybrik="exact.pth", flip_test=False, update_scale=False, batch=5)
FRAMES = 40
Truth = tuple[np.ndarray, np.ndarray]


class Exact(HybrikNet):
    """Answers with prepared rows, crop after crop."""

    def __init__(self, uvd: np.ndarray, twist: np.ndarray, scale: np.ndarray) -> None:
        super().__init__(features=1, camera=1)
        self.rows = (uvd, twist, scale)
        self.next = 0

    def forward(self, crops: torch.Tensor, flip_test: bool = False) -> NetworkOutput:
        here = slice(self.next, self.next + len(crops))
        self.next += len(crops)
        uvd, twist, scale = (torch.from_numpy(rows[here]) for rows in self.rows)
        certain = torch.zeros(uvd.shape[:2])
        return NetworkOutput(uvd, certain, certain, twist, torch.zeros(len(uvd), 10), scale)


@pytest.fixture(scope="module")
def track(hip_shake: LandmarkTrack) -> LandmarkTrack:
    """Return the first frames of the hip-shake."""
    return replace(
        hip_shake,
        landmarks=hip_shake.landmarks[:FRAMES],
        world_landmarks=hip_shake.world_landmarks[:FRAMES],
        visibility=hip_shake.visibility[:FRAMES],
    )


@pytest.fixture(scope="module")
def dancer(track: LandmarkTrack) -> SmplSequence:
    """Return a motion that stands for the truth: our own mocap of the track."""
    return recover_motion(track, MocapConfig())


@pytest.fixture(scope="module")
def truth(dancer: SmplSequence) -> Truth:
    """Return the dancer before the camera: local rotations, and points on our rest skeleton where
    the landmarks are."""
    rows = np.concatenate([dancer.global_orient, dancer.body_pose], 1).reshape(-1, 3)
    local = Rotation.from_rotvec(rows).as_matrix().reshape(FRAMES, 24, 3, 3)
    to_world = np.array(dancer.camera["rotation_w"])
    local[:, 0] = to_world.T @ local[:, 0]
    points = forward(local, dancer.rest_joints[None], np.zeros((FRAMES, 3))).points
    place = (dancer.keypoints_w[:, 0] - np.array(dancer.camera["position_w"])) @ to_world
    return local, points + place[:, None]


@pytest.fixture(scope="module")
def lens(track: LandmarkTrack) -> Pinhole:
    return Pinhole(guess_focal(track.width, track.height), track.width, track.height)


def exact_network(truth: Truth, track: LandmarkTrack, lens: Pinhole, rest: np.ndarray) -> HybrikNet:
    """Return a network that finds the truth through each frame's own lens, as a perfect one
    would."""
    local, points = truth
    boxes = person_crop.person_boxes(repair(track).image)
    view = crop_to_camera.View(boxes, lens.width, lens.height)
    depth = points[:, :1, 2:] * (view.focal_px / lens.focal_px)[:, None, None]
    root = np.concatenate([points[:, :1, :2], depth], -1)
    near = points - points[:, :1] + root
    middle = np.array([lens.width, lens.height]) / 2.0
    pixels = near[..., :2] / near[..., 2:] * view.focal_px[:, None, None] + middle
    uv = (pixels - boxes[:, None, :2]) / boxes[:, None, 2:]
    uvd = np.concatenate([uv, (near[..., 2:] - depth) / crop_to_camera.DEPTH_M], -1)
    bones = np.stack([rest[AIM_CHILD[j]] - rest[j] for j in range(1, 24)])
    _, twist = split(local[:, 1:], np.broadcast_to(bones, (FRAMES, 23, 3)))
    scale = crop_to_camera.FOCAL_PX / (person_crop.SIDE_PX * depth[:, 0, 0])
    return Exact(uvd, 3.0 * twist, scale)


def images(track: LandmarkTrack) -> list[np.ndarray]:
    return [np.zeros((track.height, track.width, 3), np.uint8)] * FRAMES


def test_a_perfect_network_gives_the_person_before_the_camera(
    truth: Truth, track: LandmarkTrack, lens: Pinhole, dancer: SmplSequence
) -> None:
    networks = Networks(exact_network(truth, track, lens, dancer.rest_joints), None, None, ())
    marks = repair(track)
    found = estimate(images(track), marks, None, lens, track.fps, 15.0, networks, CONFIG)
    assert np.abs(found.keypoints - truth[1]).max() < 1e-6


def test_a_perfect_network_gives_the_motion_on_the_floor(
    truth: Truth, track: LandmarkTrack, lens: Pinhole, dancer: SmplSequence
) -> None:
    networks = Networks(
        exact_network(truth, track, lens, dancer.rest_joints), None, None, ("by the truth",)
    )
    found = network_motion(track, images(track), networks, MocapConfig(), CONFIG)
    assert 1e3 * pose_error.pa_mpjpe(found.joints, dancer.joints) < 15.0
    assert found.notes[0] == "by the truth"
    assert abs(float(np.median(found.joints[:, 0, 2] - dancer.joints[:, 0, 2]))) < 0.03


def test_frames_without_a_person_are_bridged(
    truth: Truth, track: LandmarkTrack, lens: Pinhole, dancer: SmplSequence
) -> None:
    marks = track.landmarks.copy()
    marks[10:14] = np.nan
    gap = replace(track, landmarks=marks)
    network = exact_network(truth, gap, lens, dancer.rest_joints)
    assert isinstance(network, Exact)
    network.rows[0][10:14] = 0.0
    networks = Networks(network, None, None, ())
    found = network_motion(gap, images(track), networks, MocapConfig(), CONFIG)
    error = np.linalg.norm(found.joints[8:16] - dancer.joints[8:16], axis=-1)
    assert error.mean() < 0.1
    assert not found.valid[10:14].any()


def test_weak_frames_of_a_network_are_left_out_on_request(
    truth: Truth, track: LandmarkTrack, lens: Pinhole, dancer: SmplSequence
) -> None:
    """Frames whose network puts the body beside the landmarks are bridged, too."""
    off = []
    for leave_out in (False, True):
        network = exact_network(truth, track, lens, dancer.rest_joints)
        assert isinstance(network, Exact)
        network.rows[0][10:14, :, :2] += np.random.default_rng(0).normal(0.0, 0.3, size=(29, 2))
        networks = Networks(network, None, None, ())
        mocap = MocapConfig(leave_out_weak=leave_out)
        found = network_motion(track, images(track), networks, mocap, CONFIG)
        off.append(np.linalg.norm(found.joints - dancer.joints, axis=-1)[10:14].mean())
    assert not found.valid[10:14].any()
    assert any("left out" in note for note in found.notes)
    assert off[1] < 0.5 * off[0]


def test_a_variable_frame_rate_is_made_even(
    truth: Truth, track: LandmarkTrack, lens: Pinhole, dancer: SmplSequence
) -> None:
    times = np.arange(FRAMES) / track.fps
    times[1:-1] += 0.4 / track.fps * np.where(np.arange(FRAMES - 2) % 2, 1.0, -1.0)
    uneven = replace(track, time_s=times)
    networks = Networks(exact_network(truth, track, lens, dancer.rest_joints), None, None, ())
    found = estimate(images(track), repair(track), None, lens, track.fps, 15.0, networks, CONFIG)
    moved = resampled(found, uneven)
    expected = np.interp(np.arange(FRAMES) / track.fps, times, found.keypoints[:, 18, 0])
    assert np.abs(moved.keypoints[:, 18, 0] - expected).max() < 1e-12
    assert resampled(found, track) is found


def test_a_clip_with_damaged_frames_is_made_even(
    truth: Truth, track: LandmarkTrack, lens: Pinhole, dancer: SmplSequence
) -> None:
    """Frames that were left out come back between their neighbours."""
    times = np.arange(FRAMES) / track.fps
    times[FRAMES // 2 :] += 3 / track.fps
    damaged = replace(track, time_s=times)
    networks = Networks(exact_network(truth, track, lens, dancer.rest_joints), None, None, ())
    found = network_motion(damaged, images(track), networks, MocapConfig(), CONFIG)
    assert len(found) == FRAMES + 3
    error = found.joints[FRAMES // 2 + 5 + 3 :] - dancer.joints[FRAMES // 2 + 5 :]
    assert np.linalg.norm(error, axis=-1).mean() < 0.1


def test_of_a_camera_that_moved_the_crops_are_where_the_person_is_in_each_frame(
    truth: Truth, track: LandmarkTrack, lens: Pinhole, dancer: SmplSequence
) -> None:
    pan = np.linspace(0.0, 0.1, FRAMES)  # of the width, to the left in the frames
    seen = np.array(track.landmarks)
    seen[..., 0] -= pan[:, None]
    back = np.repeat(np.eye(3)[None], FRAMES, 0)
    back[:, 0, 2] = pan * track.width
    moved = replace(track, landmarks=seen, to_first=back)
    network = exact_network(truth, track, lens, dancer.rest_joints)
    cut: list[np.ndarray] = []

    def watched(image: np.ndarray, box: np.ndarray) -> np.ndarray:
        cut.append(box)
        return np.zeros((256, 256, 3), np.uint8)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(person_crop, "cut", watched)
        still = network_motion(
            track, images(track), Networks(network, None, None, ()), MocapConfig(), CONFIG
        )
        at_rest, cut[:] = np.array(cut), []
        network = exact_network(truth, track, lens, dancer.rest_joints)
        found = network_motion(
            moved, images(track), Networks(network, None, None, ()), MocapConfig(), CONFIG
        )
    assert np.array(cut)[:, 0] == pytest.approx(at_rest[:, 0] - pan * track.width)
    assert found.joints == pytest.approx(still.joints, abs=1e-6)
    assert (still.camera.get("moved"), found.camera["moved"]) == (None, True)


def test_given_twists_come_back_out_of_the_solve(truth: Truth, dancer: SmplSequence) -> None:
    local, points = truth
    rest = dancer.rest_joints
    bones = np.broadcast_to(
        np.stack([rest[AIM_CHILD[j]] - rest[j] for j in range(1, 24)]), (FRAMES, 23, 3)
    )
    _, twist = split(local[:, 1:], bones)
    body = pose_keypoints(points, twist, np.ones((FRAMES, 29)), rest, "adaptive")
    assert np.abs(body.local - local).max() < 1e-6


def test_niki_turns_the_persons_own_bones(
    track: LandmarkTrack, lens: Pinhole, truth: Truth, dancer: SmplSequence
) -> None:
    torch.manual_seed(0)
    network = exact_network(truth, track, lens, dancer.rest_joints)
    networks = Networks(network, niki.TwistSwing().eval().double(), None, ())
    marks = repair(track)
    found = estimate(images(track), marks, None, lens, track.fps, 15.0, networks, CONFIG)
    bones = np.linalg.norm(found.keypoints[:, AIM_CHILD[4]] - found.keypoints[:, 4], axis=-1)
    own = np.linalg.norm(found.rest[AIM_CHILD[4]] - found.rest[4])
    assert np.abs(bones - own).max() < 1e-9
    assert np.abs(found.keypoints[:, 0] - truth[1][:, 0]).max() < 1e-6
    assert found.rest.shape == REST_JOINTS.shape
