"""Pictures of people before many backgrounds, with objects in front of them.

Camera frame as in `robojackson.mocap.landmarks.pinhole_camera`: x right, y down, z forward, metres.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import moderngl
import numpy as np

from tools.pairs.people import Person, Posed

NEAR, FAR = 0.1, 60.0
SIZES = ((270, 480), (360, 480), (480, 360), (480, 270), (400, 400))
"""Width, height of a picture."""
VERTEX = """
#version 330
uniform mat4 camera;
in vec3 position; in vec3 colour;
out vec3 v_colour; out vec3 v_position;
void main() {
    gl_Position = camera * vec4(position, 1.0);
    v_colour = colour; v_position = position;
}
"""
FRAGMENT = """
#version 330
in vec3 v_colour; in vec3 v_position;
uniform vec3 key; uniform vec3 fill; uniform float ambient;
out vec4 pixel;
void main() {
    vec3 n = normalize(cross(dFdx(v_position), dFdy(v_position)));
    float light = ambient + 0.7 * max(dot(n, key), 0.0) + 0.3 * max(dot(n, fill), 0.0);
    pixel = vec4(pow(clamp(v_colour * light, 0.0, 1.0), vec3(0.8)), 1.0);
}
"""


@dataclass(frozen=True)
class View:
    """A still camera: pixels = focal * (R p + t)_xy / z + centre."""

    rotation: np.ndarray
    shift: np.ndarray
    focal: float
    width: int
    height: int

    def see(self, points: np.ndarray) -> np.ndarray:
        """Return the world to camera."""
        return points @ self.rotation.T + self.shift

    def matrix(self) -> np.ndarray:
        """Return the world to OpenGL's clip space."""
        flip = np.diag([1.0, -1.0, -1.0, 1.0])
        view = np.eye(4)
        view[:3, :3], view[:3, 3] = self.rotation, self.shift
        clip = np.zeros((4, 4))
        clip[0, 0], clip[1, 1] = 2 * self.focal / self.width, 2 * self.focal / self.height
        clip[2, 2], clip[2, 3] = -(FAR + NEAR) / (FAR - NEAR), -2 * FAR * NEAR / (FAR - NEAR)
        clip[3, 2] = -1.0
        return clip @ flip @ view


@dataclass(frozen=True)
class Angles:
    """From where a camera looks: radians, and how much of the picture the motion fills; a roll of
    None is drawn."""

    yaw: float
    pitch: float
    fills: float
    roll: float | None = None


def draw_angles(rng: np.random.Generator) -> Angles:
    """Draw a camera on any side, from 20 degrees up to 60 degrees down, near or far."""
    level = rng.uniform() < 0.5
    yaw = rng.uniform(-np.pi, np.pi)
    pitch = np.radians(rng.normal(6.0, 9.0) if level else rng.uniform(-20.0, 60.0))
    return Angles(yaw, float(pitch), float(np.exp(rng.uniform(np.log(0.35), np.log(1.15)))))


def film(posed: Posed, rng: np.random.Generator, angles: Angles) -> View:
    """Return a camera that sees the clip."""
    width, height = SIZES[rng.integers(len(SIZES))]
    points = posed.heads
    centre = (points.max((0, 1)) + points.min((0, 1))) / 2.0
    yaw, pitch, fills = angles.yaw, angles.pitch, angles.fills
    forward = np.array([-np.sin(yaw) * np.cos(pitch), np.cos(yaw) * np.cos(pitch), -np.sin(pitch)])
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    rotation = np.stack([right, np.cross(forward, right), forward])
    drawn = np.radians(rng.normal(0.0, 5.0))
    roll = drawn if angles.roll is None else angles.roll
    turn = np.array([[np.cos(roll), -np.sin(roll), 0], [np.sin(roll), np.cos(roll), 0], [0, 0, 1]])
    rotation = turn @ rotation
    focal = float(np.hypot(width, height) * np.exp(rng.uniform(np.log(0.55), np.log(1.7))))
    distance = 4.0
    for _ in range(6):
        shift = np.array([0.0, 0.0, distance]) - rotation @ centre
        seen = points @ rotation.T + shift
        z = np.maximum(seen[..., 2], 0.6)
        extent = np.abs(seen[..., :2]) / z[..., None] * focal * 2.2 / np.array([width, height])
        distance = max(distance * float(extent.max()) / fills, 1.6)
    shift += np.array([rng.normal(0, 0.04), rng.normal(0, 0.04), 0.0]) * distance
    return View(rotation, shift, focal, width, height)


def background(view: View, rng: np.random.Generator) -> np.ndarray:
    """Return a floor, a wall and blurred stuff, float RGB 0..1."""
    shape = (view.height, view.width)
    rows, columns = np.mgrid[0 : view.height, 0 : view.width]
    rays = np.stack(
        [(columns - view.width / 2) / view.focal, (rows - view.height / 2) / view.focal,
         np.ones(shape)], -1,
    )  # fmt: skip
    world = rays @ view.rotation
    eye = -view.rotation.T @ view.shift
    floor = world[..., 2] < -1e-3
    hit = eye[:2] + world[..., :2] * (-eye[2] / np.minimum(world[..., 2:], -1e-3))
    wall, ground = rng.uniform(0.1, 0.95, 3), rng.uniform(0.1, 0.95, 3)
    picture = np.where(floor[..., None], ground, wall)
    size = rng.uniform(0.3, 1.5)
    squares = np.mod(np.floor(hit / size).sum(-1), 2.0)
    picture = picture * np.where(floor, 1.0 - rng.uniform(0, 0.3) * squares, 1.0)[..., None]
    cells = rng.uniform(0, 1, (*rng.integers(2, 24, 2), 3))
    stuff = cv2.resize(cells, (view.width, view.height), interpolation=cv2.INTER_CUBIC)
    return np.clip(picture + rng.uniform(0.0, 0.35) * (stuff - 0.5), 0.0, 1.0).astype(np.float32)


def occluders(
    seen: np.ndarray, limbs: list[list[int]], view: View, fps: float, rng: np.random.Generator
) -> np.ndarray:
    """Return the boxes (T, N, 4) of pixels x0 y0 x1 y1 over a limb for 0.2 to 1 s; NaN where there
    is none."""
    count = len(seen)
    boxes = np.full((count, 3, 4), np.nan)
    if rng.uniform() < 0.45:
        return boxes
    pixels = seen[..., :2] / seen[..., 2:] * view.focal + [view.width / 2, view.height / 2]
    for number in range(int(rng.integers(1, 4))):
        limb = pixels[:, limbs[rng.integers(len(limbs))]]
        start, length = rng.integers(0, count), int(fps * rng.uniform(0.2, 1.0))
        span = slice(start, min(start + length, count))
        low, high = limb[span].min(1), limb[span].max(1)
        if rng.uniform() < 0.5:
            low, high = (np.broadcast_to(edge, low.shape) for edge in (low.min(0), high.max(0)))
        margin = 0.05 * view.height * rng.uniform(0.2, 1.5)
        boxes[span, number] = np.concatenate([low - margin, high + margin], -1)
    return boxes


class Studio:
    """One OpenGL context for all pictures; edges are softened after drawing, which is cheap."""

    def __init__(self, triangles: np.ndarray, vertices: int) -> None:
        self.context = moderngl.create_context(standalone=True, backend="egl")  # type: ignore[arg-type]
        self.context.enable(moderngl.DEPTH_TEST)
        self.program = self.context.program(vertex_shader=VERTEX, fragment_shader=FRAGMENT)
        self.points = self.context.buffer(reserve=vertices * 12)
        self.paint = self.context.buffer(reserve=vertices * 12)
        faces = self.context.buffer(np.ascontiguousarray(triangles, np.int32).tobytes())
        layout = [(self.points, "3f", "position"), (self.paint, "3f", "colour")]
        self.array = self.context.vertex_array(self.program, layout, faces)
        self.targets: dict[tuple[int, int], moderngl.Framebuffer] = {}

    def frames(
        self, person: Person, posed: Posed, view: View, boxes: np.ndarray,
        rng: np.random.Generator, stride: int = 1,
    ) -> Iterator[np.ndarray]:  # fmt: skip
        """Yield the pictures of each `stride`-th frame, RGB bytes."""
        target = self._target(view.width, view.height)
        self.paint.write(person.colour.astype("f4").tobytes())
        self.program["camera"] = tuple(view.matrix().T.ravel())
        for name in ("key", "fill"):
            direction = rng.normal(0.0, 1.0, 3) + [0.0, -0.8, 0.8]
            self.program[name] = tuple(direction / np.linalg.norm(direction))
        self.program["ambient"] = rng.uniform(0.2, 0.6)
        back, paints = background(view, rng), rng.uniform(0, 1, (boxes.shape[1], 3))
        noise = rng.exponential(0.012) * rng.normal(0, 1, (3, view.height, view.width, 3))
        noise = noise.astype(np.float32)
        grey, gain = rng.uniform() < 0.08, rng.uniform(0.6, 1.15)
        blur = float(rng.uniform() < 0.25) * rng.uniform(0.3, 1.2)
        for frame in range(0, len(posed.heads), stride):
            self.points.write(person.skin(posed, frame).astype("f4").tobytes())
            target.use()
            target.clear(0.0, 0.0, 0.0, 0.0)
            self.array.render()
            raw = np.frombuffer(target.read(components=4), np.uint8)
            drawn = cv2.GaussianBlur(raw.reshape(view.height, view.width, 4)[::-1], (3, 3), 0.6)
            drawn = drawn.astype(np.float32) * np.float32(1.0 / 255.0)
            picture = back * (1.0 - drawn[..., 3:]) + drawn[..., :3]
            for box, paint in zip(boxes[frame], paints, strict=True):
                if np.isfinite(box).all():
                    x0, y0, x1, y1 = np.maximum(box, 0).astype(int)
                    picture[y0:y1, x0:x1] = paint
            if blur > 0.0:
                picture = cv2.GaussianBlur(picture, (0, 0), blur)
            picture *= np.float32(gain)
            picture += noise[frame % 3]
            if grey:
                picture = np.repeat(picture.mean(-1, keepdims=True), 3, -1)
            yield (np.clip(picture, 0.0, 1.0) * 255.0).astype(np.uint8)

    def _target(self, width: int, height: int) -> moderngl.Framebuffer:
        if (width, height) not in self.targets:
            context, size = self.context, (width, height)
            self.targets[size] = context.framebuffer(
                [context.renderbuffer(size, 4)], context.depth_renderbuffer(size)
            )
        return self.targets[width, height]
