"""glTF: read back by the letter of the specification, nodes and skin are where the motion has them.

The reader here knows nothing of the writer: header, chunks, accessors, the tree of nodes, skins.
"""

import json
import struct
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from robojackson.body.forward_kinematics import forward
from robojackson.body.skeleton import JOINT_NAMES, REST_JOINTS
from robojackson.formats import gltf_person, gltf_robot
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.motion.smpl_sequence import SmplSequence

TYPES = {5121: np.uint8, 5123: np.uint16, 5125: np.uint32, 5126: np.float32}
WIDTHS = {"SCALAR": 1, "VEC3": 3, "VEC4": 4, "MAT4": 16}
FROM_GLTF = np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])
"""z forward, x left, y up to x forward, y left, z up."""


@dataclass
class Read:
    """A .glb."""

    content: dict[str, Any]
    binary: bytes

    def array(self, number: int) -> np.ndarray:
        facts = self.content["accessors"][number]
        view = self.content["bufferViews"][facts["bufferView"]]
        assert view["byteOffset"] % 4 == 0
        kind, width = TYPES[facts["componentType"]], WIDTHS[facts["type"]]
        count = facts["count"] * width
        return np.frombuffer(self.binary, kind, count, view["byteOffset"]).reshape(-1, width)

    def node(self, name: str) -> int:
        (found,) = [k for k, node in enumerate(self.content["nodes"]) if node["name"] == name]
        return found

    def frames(self) -> int:
        clock = self.content["animations"][0]["samplers"][0]["input"]
        return self.content["accessors"][clock]["count"]

    def world(self) -> np.ndarray:
        """Return the matrices of all nodes at every key frame (T, nodes, 4, 4), glTF's axes."""
        nodes, count = self.content["nodes"], self.frames()
        local = np.tile(np.eye(4), (count, len(nodes), 1, 1))
        for k, node in enumerate(nodes):
            turn = node.get("rotation", [0, 0, 0, 1])
            local[:, k, :3, :3] = Rotation.from_quat(turn).as_matrix()
            local[:, k, :3, 3] = node.get("translation", [0, 0, 0])
        animation = self.content["animations"][0]
        for channel in animation["channels"]:
            values = self.array(animation["samplers"][channel["sampler"]]["output"])
            node = channel["target"]["node"]
            if channel["target"]["path"] == "rotation":
                assert np.linalg.norm(values, axis=1) == pytest.approx(1.0, abs=1e-5)
                local[:, node, :3, :3] = Rotation.from_quat(values).as_matrix()
            else:
                local[:, node, :3, 3] = values
        world = local.copy()

        def descend(node: int) -> None:
            for child in nodes[node].get("children", []):
                world[:, child] = world[:, node] @ local[:, child]
                descend(child)

        for root in self.content["scenes"][0]["nodes"]:
            descend(root)
        return world


def read(data: bytes) -> Read:
    magic, version, length = struct.unpack_from("<4sII", data)
    assert (magic, version, length) == (b"glTF", 2, len(data))
    size, kind = struct.unpack_from("<I4s", data, 12)
    assert (kind, size % 4) == (b"JSON", 0)
    content = json.loads(data[20 : 20 + size])
    rest, kind = struct.unpack_from("<I4s", data, 20 + size)
    assert (kind, rest % 4) == (b"BIN\0", 0)
    binary = data[28 + size :]
    assert len(binary) == rest == content["buffers"][0]["byteLength"]
    return Read(content, binary)


@pytest.fixture(scope="module")
def turning() -> SmplSequence:
    """Return a person who walks along a curve and moves every joint."""
    rng, frames = np.random.default_rng(3), 20
    times = np.linspace(0, 1, frames)[:, None]
    upright = Rotation.from_matrix(FROM_GLTF)
    root = (
        Rotation.from_rotvec(np.hstack([0 * times, 0 * times, 4 * times])) * upright
    ).as_rotvec()
    pose = 0.6 * rng.normal(size=(1, 69)) * np.sin(6 * times + rng.uniform(0, 6, 69))
    transl = np.hstack([times, 0.5 * times**2, 0.9 + 0.1 * times])
    vectors = np.concatenate([root, pose], 1).reshape(-1, 3)
    local = Rotation.from_rotvec(vectors).as_matrix().reshape(frames, 24, 3, 3)
    points = forward(local, REST_JOINTS, transl + REST_JOINTS[0]).points
    return SmplSequence(
        fps=25.0, global_orient=root, body_pose=pose, transl=transl, joints=points[:, :24],
        keypoints_w=points, confidence=np.ones((frames, 29)), contact=np.zeros((frames, 4), int),
        valid=np.ones(frames, bool), betas=np.zeros(10), rest_joints=REST_JOINTS,
    )  # fmt: skip


def test_every_body_is_where_mujoco_has_it(swaying: ReferenceMotion, model: mujoco.MjModel) -> None:
    found, data = read(gltf_robot.write(swaying, model)), mujoco.MjData(model)
    world = found.world()
    assert found.frames() == len(swaying)
    for step in range(0, len(swaying), 7):
        data.qpos[:] = swaying.qpos[step]
        mujoco.mj_kinematics(model, data)
        for body in range(1, model.nbody):
            placed = world[step, found.node(model.body(body).name)]
            assert FROM_GLTF @ placed[:3, 3] == pytest.approx(data.xpos[body], abs=1e-5)
            turn = FROM_GLTF @ placed[:3, :3]
            assert turn == pytest.approx(data.xmat[body].reshape(3, 3), abs=1e-5)


def test_the_robots_tree_is_mujocos(swaying: ReferenceMotion, model: mujoco.MjModel) -> None:
    nodes = read(gltf_robot.write(swaying, model)).content["nodes"]
    for body in range(2, model.nbody):
        parent = model.body(int(model.body_parentid[body])).name
        (above,) = [node for node in nodes if node["name"] == parent]
        assert model.body(body).name in [nodes[child]["name"] for child in above["children"]]


def test_drawn_parts_fill_the_boxes_that_mujoco_has_around_them(
    swaying: ReferenceMotion, model: mujoco.MjModel
) -> None:
    found = read(gltf_robot.write(swaying, model))
    for body in range(1, model.nbody):
        node = found.content["nodes"][found.node(model.body(body).name)]
        parts = found.content["meshes"][node["mesh"]]["primitives"]
        placed = np.concatenate([found.array(part["attributes"]["POSITION"]) for part in parts])
        corners = []
        for geom in np.flatnonzero(model.geom_bodyid == body):
            turn = Rotation.from_quat(np.roll(model.geom_quat[geom], -1))
            middle, half = model.geom_aabb[geom, :3], model.geom_aabb[geom, 3:]
            signs = np.array(np.meshgrid(*[(-1, 1)] * 3)).reshape(3, -1).T
            corners.append(turn.apply(middle + signs * half) + model.geom_pos[geom])
        corners = np.concatenate(corners)
        assert (placed.min(0) >= corners.min(0) - 1e-4).all()
        assert (placed.max(0) <= corners.max(0) + 1e-4).all()
        assert np.ptp(placed, axis=0).max() > 0.9 * np.ptp(corners, axis=0).max() - 0.05


def test_every_joint_is_where_the_person_has_it(turning: SmplSequence) -> None:
    found = read(gltf_person.write(turning))
    world = found.world()
    for joint, name in enumerate(JOINT_NAMES):
        placed = world[:, found.node(name), :3, 3] @ FROM_GLTF.T
        assert placed == pytest.approx(turning.joints[:, joint], abs=1e-5)


def test_the_skin_follows_its_joints(turning: SmplSequence) -> None:
    """Bound in the rest pose; posed, a part's corners keep their distance from both its ends."""
    found = read(gltf_person.write(turning))
    (skin,), world = found.content["skins"], found.world()
    inverse = found.array(skin["inverseBindMatrices"]).reshape(-1, 4, 4).transpose(0, 2, 1)
    assert [found.content["nodes"][k]["name"] for k in skin["joints"]] == list(JOINT_NAMES)
    for part in found.content["meshes"][0]["primitives"]:
        attributes = part["attributes"]
        corners = found.array(attributes["POSITION"])
        joint = found.array(attributes["JOINTS_0"])[:, 0]
        assert found.array(attributes["WEIGHTS_0"]).sum(1) == pytest.approx(1.0)
        for frame in (0, 11, 19):
            matrix = world[frame, skin["joints"]] @ inverse
            posed = np.einsum("vij,vj->vi", matrix[joint], np.c_[corners, np.ones(len(corners))])
            own = FROM_GLTF @ posed[:, :3].T
            apart = np.linalg.norm(own.T - turning.joints[frame, joint], axis=1)
            rest = np.linalg.norm(corners - REST_JOINTS[joint], axis=1)
            assert apart == pytest.approx(rest, abs=1e-5)


def test_times_are_seconds_from_zero_on(turning: SmplSequence) -> None:
    found = read(gltf_person.write(turning))
    clock = found.content["animations"][0]["samplers"][0]["input"]
    assert found.array(clock)[:, 0] == pytest.approx(np.arange(20) / 25.0)
    assert found.content["accessors"][clock]["max"] == pytest.approx([19 / 25])


def test_faces_look_outward(swaying: ReferenceMotion, model: mujoco.MjModel) -> None:
    found = read(gltf_robot.write(swaying, model))
    for mesh in found.content["meshes"]:
        for part in mesh["primitives"]:
            corners = found.array(part["attributes"]["POSITION"])
            faces = corners[found.array(part["indices"]).reshape(-1, 3)]
            across = np.cross(faces[:, 1] - faces[:, 0], faces[:, 2] - faces[:, 0])
            middle = faces.mean(1) - corners.mean(0)
            assert (np.einsum("ij,ij->i", across, middle) > 0).all()
