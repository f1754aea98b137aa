"""One person on a checkered floor before a plain backdrop, drawn without a screen.

World: z up, metres, the floor at z = 0. Matrices take column vectors, as OpenGL does; the camera
looks along its own -z.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import moderngl
import numpy as np
from jaxtyping import Float, UInt8

from tools.render.anny_body import Body, PosedBody

SKIN, SHIRT, TROUSERS = (0.80, 0.60, 0.50), (0.72, 0.13, 0.12), (0.12, 0.16, 0.32)
SHOES, HAIR, EYES = (0.90, 0.90, 0.90), (0.13, 0.08, 0.05), (0.95, 0.95, 0.95)
FLOOR, BACKDROP = (0.62, 0.55, 0.47), (0.70, 0.74, 0.78)
"""Linear RGB, 0..1."""
WAIST_ABOVE_ROOT = 0.06
CROWN_ABOVE_HEAD_BONE = 0.115
NAPE_BEHIND_HEAD_BONE = 0.045
"""Metres in the rest pose; above the crown or behind the nape is hair, below the waist trousers."""
FLOOR_HALF_WIDTH = 8.0
LOOK_AT_HEIGHT = 0.95
BASE_DISTANCE = 3.6
CAMERA_RISE = 0.12
"""Metres; metres; metres of height a metre of distance."""
FIELD_OF_VIEW = np.radians(45.0)
NEAR, FAR = 0.1, 50.0
SAMPLES = 4

VERTEX_SHADER = """
#version 330
uniform mat4 camera;
in vec3 position; in vec3 normal; in vec3 colour;
out vec3 v_normal; out vec3 v_colour; out vec3 v_position;
void main() {
    gl_Position = camera * vec4(position, 1.0);
    v_normal = normal; v_colour = colour; v_position = position;
}
"""
FRAGMENT_SHADER = """
#version 330
in vec3 v_normal; in vec3 v_colour; in vec3 v_position;
out vec4 pixel;
uniform int checkered;
void main() {
    vec3 n = normalize(v_normal);
    float key = max(dot(n, normalize(vec3(0.4, -0.7, 0.8))), 0.0) * 0.7;
    float fill = max(dot(n, normalize(vec3(-0.7, -0.3, 0.3))), 0.0) * 0.25;
    float light = key + fill + 0.3;
    vec3 colour = v_colour;
    if (checkered == 1) {
        float square = mod(floor(v_position.x * 2.0) + floor(v_position.y * 2.0), 2.0);
        colour *= 0.85 + 0.15 * square;
        light = 1.0;
    }
    pixel = vec4(pow(min(colour * light, 1.0), vec3(0.8)), 1.0);
}
"""


@dataclass(frozen=True)
class Camera:
    """A still camera.

    Attributes:
        view: World to camera.
        projection: Camera to clip space.
    """

    view: Float[np.ndarray, "4 4"]
    projection: Float[np.ndarray, "4 4"]


def camera_for(hips: Float[np.ndarray, "T 3"], yaw: float, width: int, height: int) -> Camera:
    """Return a camera that holds the whole path of the hips; yaw in degrees about z, 0 is the
    front."""
    centre = np.array([hips[:, 0].mean(), hips[:, 1].mean(), LOOK_AT_HEIGHT])
    distance = BASE_DISTANCE + 0.8 * float(np.ptp(hips[:, :2], axis=0).max())
    angle = np.radians(yaw)
    eye = centre + distance * np.array([np.sin(angle), -np.cos(angle), CAMERA_RISE])
    return Camera(_look_at(eye, centre), _perspective(width / height))


def colours(body: Body) -> Float[np.ndarray, "V 3"]:
    """Return the clothes, skin and hair by the bone that moves each vertex."""
    head, waist = body.head_of("head"), body.head_of("root")[2] + WAIST_ABOVE_ROOT
    table = np.tile(np.array(SKIN), (len(body.rest_vertices), 1))
    for index, bone in enumerate(body.dominant_bones()):
        below_waist = bone.startswith("spine") and body.rest_vertices[index, 2] < waist
        if below_waist or bone.startswith(("upperleg", "pelvis", "root", "lowerleg01")):
            table[index] = TROUSERS
        elif bone.startswith(("spine", "clavicle", "shoulder", "upperarm")):
            table[index] = SHIRT
        elif bone.startswith(("foot", "toe")):
            table[index] = SHOES
        elif bone.startswith("head") and _is_hair(body.rest_vertices[index] - head):
            table[index] = HAIR
        elif bone.startswith("eye"):
            table[index] = EYES
    return table


def frames(
    posed: PosedBody, colour: Float[np.ndarray, "V 3"], camera: Camera, width: int, height: int
) -> Iterator[UInt8[np.ndarray, "H W 3"]]:
    """Yield the pictures, RGB, one a frame."""
    context = moderngl.create_context(standalone=True, backend="egl")  # type: ignore[arg-type]
    context.enable(moderngl.DEPTH_TEST)
    program = context.program(vertex_shader=VERTEX_SHADER, fragment_shader=FRAGMENT_SHADER)
    program["camera"] = tuple((camera.projection @ camera.view).T.ravel())
    smooth = context.framebuffer(
        [context.renderbuffer((width, height), 4, samples=SAMPLES)],
        context.depth_renderbuffer((width, height), samples=SAMPLES),
    )
    flat = context.framebuffer([context.renderbuffer((width, height), 4)])
    layout = ("3f 3f 3f", "position", "normal", "colour")
    floor = context.vertex_array(program, [(context.buffer(_floor_mesh(camera)), *layout)])
    skin = context.buffer(reserve=posed.vertices.shape[1] * 36)
    faces = context.buffer(posed.triangles.tobytes())
    person = context.vertex_array(program, [(skin, *layout)], faces)
    for vertices in posed.vertices:
        skin.write(_packed(vertices, vertex_normals(vertices, posed.triangles), colour))
        smooth.use()
        smooth.clear(*BACKDROP)
        for shape, checkered in ((floor, 1), (person, 0)):
            program["checkered"] = checkered
            shape.render()
        context.copy_framebuffer(flat, smooth)
        picture = np.frombuffer(flat.read(components=3), np.uint8)
        yield np.ascontiguousarray(picture.reshape(height, width, 3)[::-1])
    context.release()


def vertex_normals(
    vertices: Float[np.ndarray, "V 3"], triangles: np.ndarray
) -> Float[np.ndarray, "V 3"]:
    """Return the unit normals, the mean of the faces around each vertex weighted by their areas."""
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    face = np.cross(b - a, c - a)
    corners = triangles.T.ravel()
    stacked = np.tile(face, (3, 1))
    total = [np.bincount(corners, stacked[:, k], len(vertices)) for k in range(3)]
    normals = np.stack(total, -1)
    return normals / (np.linalg.norm(normals, axis=1, keepdims=True) + 1e-9)


def _look_at(eye: np.ndarray, target: np.ndarray) -> Float[np.ndarray, "4 4"]:
    forward = (target - eye) / np.linalg.norm(target - eye)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    view = np.eye(4)
    view[:3, :3] = [right, np.cross(right, forward), -forward]
    view[:3, 3] = -view[:3, :3] @ eye
    return view


def _perspective(aspect: float) -> Float[np.ndarray, "4 4"]:
    focal = 1.0 / np.tan(FIELD_OF_VIEW / 2.0)
    matrix = np.zeros((4, 4))
    matrix[0, 0], matrix[1, 1] = focal / aspect, focal
    matrix[2, 2] = -(FAR + NEAR) / (FAR - NEAR)
    matrix[2, 3] = -2.0 * FAR * NEAR / (FAR - NEAR)
    matrix[3, 2] = -1.0
    return matrix


def _floor_mesh(camera: Camera) -> bytes:
    """Return two triangles around the point that the camera looks at."""
    eye = -camera.view[:3, :3].T @ camera.view[:3, 3]
    forward = -camera.view[2, :3]
    centre = eye + forward * (LOOK_AT_HEIGHT - eye[2]) / min(forward[2], -1e-6)
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, -1], [1, 1], [-1, 1]]) * FLOOR_HALF_WIDTH
    points = np.column_stack([corners + centre[:2], np.zeros(6)])
    return _packed(points, np.tile([0.0, 0.0, 1.0], (6, 1)), np.tile(FLOOR, (6, 1)))


def _packed(position: np.ndarray, normal: np.ndarray, colour: np.ndarray) -> bytes:
    return np.hstack([position, normal, colour]).astype("f4").tobytes()


def _is_hair(from_head_bone: Float[np.ndarray, "3"]) -> bool:
    _, back, up = from_head_bone
    return bool(up > CROWN_ABOVE_HEAD_BONE or (back > NAPE_BEHIND_HEAD_BONE and up > 0.0))
