"""glTF 2.0 (Khronos; ISO/IEC 12113): a scene with animated nodes as one binary file (.glb).

Metres, seconds, radians; y up, z forward, x to the left. Quaternions come in wxyz and are written
xyzw. Arrays lie behind one another in one buffer, each on a multiple of four bytes.
"""

import json
import struct
from collections.abc import Mapping, Sequence

import numpy as np
from jaxtyping import Float, Int

from robojackson.geometry.frames import SMPL_TO_WORLD
from robojackson.geometry.rotations import sign_continuous
from robojackson.geometry.surface import Surface

WORLD_TO_GLTF = SMPL_TO_WORLD.T
"""glTF has the axes of SMPL's rest pose."""
MAGIC, VERSION, HEAD_BYTES = b"glTF", 2, 12
CHUNKS = {"json": b"JSON", "bin": b"BIN\0"}
FLOAT, USHORT, UINT, UBYTE = 5126, 5123, 5125, 5121
ARRAY_BUFFER, ELEMENT_BUFFER = 34962, 34963
XYZW = [1, 2, 3, 0]
ROUGHNESS = 0.7
KINDS = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}
Facts = dict[str, object]
"""A JSON object of the file."""
STILL_M, STILL = 1e-6, 1e-7
"""What moves or turns by less (metres; parts of a quaternion) is not animated."""


class GltfScene:
    """A file under construction: add nodes, then `to_bytes`."""

    def __init__(self, name: str) -> None:
        self._binary = bytearray()
        self._lists: dict[str, list[Facts]] = {
            key: [] for key in ("nodes", "meshes", "materials", "accessors", "bufferViews", "skins")
        }
        self._name, self._roots = name, list[int]()
        self._children: dict[int, list[int]] = {}
        self._channels: list[Facts] = []
        self._samplers: list[Facts] = []

    def material(self, name: str, rgb: Sequence[float]) -> int:
        """Add a matt colour, sRGB 0..1; return its number."""
        linear = [float(value) ** 2.2 for value in rgb]
        surface = {
            "baseColorFactor": [*linear, 1.0], "metallicFactor": 0.0, "roughnessFactor": ROUGHNESS,
        }  # fmt: skip
        return self._add("materials", {"name": name, "pbrMetallicRoughness": surface})

    def mesh(
        self,
        name: str,
        parts: Sequence[tuple[Surface, int]],
        joints: Sequence[Int[np.ndarray, " V"]] = (),
    ) -> int:
        """Add surfaces with their materials; return the number of the mesh.

        Args:
            joints: For each part, the joint of the skin that each vertex follows.
        """
        primitives = []
        for index, (surface, material) in enumerate(parts):
            attributes = {
                "POSITION": self._array(surface.vertices, FLOAT, ARRAY_BUFFER, extent=True),
                "NORMAL": self._array(surface.normals, FLOAT, ARRAY_BUFFER),
            }
            if joints:
                follows = np.zeros((len(surface.vertices), 4))
                follows[:, 0] = joints[index]
                attributes["JOINTS_0"] = self._array(follows, UBYTE, ARRAY_BUFFER)
                weights = np.tile([1.0, 0.0, 0.0, 0.0], (len(follows), 1))
                attributes["WEIGHTS_0"] = self._array(weights, FLOAT, ARRAY_BUFFER)
            kind = UINT if len(surface.vertices) > 0xFFFF else USHORT
            corners = self._array(surface.faces.reshape(-1, 1), kind, ELEMENT_BUFFER)
            primitives += [{"attributes": attributes, "indices": corners, "material": material}]
        return self._add("meshes", {"name": name, "primitives": primitives})

    def node(
        self,
        name: str,
        parent: int | None = None,
        place: Float[np.ndarray, "3"] | None = None,
        turn: Float[np.ndarray, "4"] | None = None,
        **of: int,
    ) -> int:
        """Add a node below another, or at the top; return its number.

        Args:
            place, turn: Relative to the parent; metres, quaternion wxyz.
            of: Numbers of its mesh and skin.
        """
        facts: Facts = {"name": name, **of}
        if place is not None:
            facts["translation"] = np.asarray(place, float).tolist()
        if turn is not None:
            facts["rotation"] = np.asarray(turn, float)[XYZW].tolist()
        number = self._add("nodes", facts)
        if parent is None:
            self._roots.append(number)
        else:
            children = self._children.setdefault(parent, [])
            children.append(number)
            self._lists["nodes"][parent]["children"] = children
        return number

    def skin(self, name: str, joints: Sequence[int], binds: Float[np.ndarray, "J 3"]) -> int:
        """Add a skin whose joints are unturned at these places when it is bound."""
        inverse = np.tile(np.eye(4), (len(joints), 1, 1))
        inverse[:, :3, 3] = -binds
        columns = inverse.transpose(0, 2, 1).reshape(-1, 16)
        facts = {"name": name, "joints": list(joints), "skeleton": joints[0]}
        return self._add("skins", facts | {"inverseBindMatrices": self._array(columns, FLOAT)})

    def clock(self, times_s: Float[np.ndarray, " T"]) -> int:
        """Add the times of key frames, ascending; return their number for `animate`."""
        return self._array(np.asarray(times_s)[:, None], FLOAT, extent=True)

    def animate(
        self,
        node: int,
        clock: int,
        places: Float[np.ndarray, "T 3"] | None = None,
        turns: Float[np.ndarray, "T 4"] | None = None,
    ) -> None:
        """Move and turn (wxyz) a node relative to its parent; it begins at the first key frame."""
        facts = self._lists["nodes"][node]
        if places is not None:
            facts["translation"] = np.asarray(places[0], float).tolist()
            if np.ptp(places, axis=0).max() > STILL_M:
                self._channel(node, clock, "translation", places)
        if turns is not None:
            turns = sign_continuous(np.asarray(turns, float))
            turns = turns / np.linalg.norm(turns, axis=1, keepdims=True)
            facts["rotation"] = turns[0, XYZW].tolist()
            if np.ptp(turns, axis=0).max() > STILL:
                self._channel(node, clock, "rotation", turns[:, XYZW])

    def to_bytes(self) -> bytes:
        """Return the file."""
        content: Facts = {
            "asset": {"version": "2.0", "generator": "RoboJackson"},
            "scene": 0,
            "scenes": [{"name": self._name, "nodes": self._roots}],
            "buffers": [{"byteLength": len(self._binary)}],
            **{key: values for key, values in self._lists.items() if values},
        }
        if self._channels:
            tracks = {"channels": self._channels, "samplers": self._samplers}
            content["animations"] = [{"name": self._name, **tracks}]
        text = json.dumps(content, separators=(",", ":"), allow_nan=False).encode()
        chunks = b"".join(
            struct.pack("<I4s", len(padded), CHUNKS[kind]) + padded
            for kind, padded in (("json", _padded(text, b" ")), ("bin", bytes(self._binary)))
        )
        return struct.pack("<4sII", MAGIC, VERSION, HEAD_BYTES + len(chunks)) + chunks

    def _channel(self, node: int, clock: int, path: str, values: np.ndarray) -> None:
        sampler = {"input": clock, "output": self._array(values, FLOAT), "interpolation": "LINEAR"}
        self._samplers.append(sampler)
        target = {"node": node, "path": path}
        self._channels.append({"sampler": len(self._samplers) - 1, "target": target})

    def _array(
        self, values: np.ndarray, kind: int, target: int | None = None, extent: bool = False
    ) -> int:
        """Add rows of numbers; return their number."""
        types = {FLOAT: np.float32, USHORT: np.uint16, UINT: np.uint32, UBYTE: np.uint8}
        rows = np.ascontiguousarray(values, types[kind])
        view = {"buffer": 0, "byteOffset": len(self._binary), "byteLength": rows.nbytes}
        if target is not None:
            view["target"] = target
        self._binary += _padded(rows.astype(rows.dtype.newbyteorder("<")).tobytes(), b"\0")
        facts: Facts = {
            "bufferView": self._add("bufferViews", view), "componentType": kind,
            "count": len(rows), "type": KINDS[rows.shape[1]],
        }  # fmt: skip
        if extent:
            facts |= {"min": rows.min(0).tolist(), "max": rows.max(0).tolist()}
        return self._add("accessors", facts)

    def _add(self, key: str, facts: Mapping[str, object]) -> int:
        self._lists[key].append(dict(facts))
        return len(self._lists[key]) - 1


def _padded(data: bytes, filler: bytes) -> bytes:
    return data + filler * (-len(data) % 4)
