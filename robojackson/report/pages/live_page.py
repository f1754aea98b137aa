"""A live dance as one HTML file: MuJoCo's wasm, the robot, its policy and its motion inside it."""

import numpy as np

from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.report.pages import inline
from robojackson.report.web.live_data import live_data
from robojackson.report.web.pane_camera import MARGIN_M
from robojackson.report.web.shown_run import RecordedRun
from robojackson.rl.policy import Policy
from robojackson.robot.body_states import own_mass

SCRIPTS = ("scene.js", "dance.js", "live.js")
STYLES = ("page.css",)
TOLERANCE_MM = 5.0
"""Largest difference of a body's position from Python's after a recorded start."""
CHECKED = 4
"""Number of recorded starts that a browser checks when it opens the page."""
PULL = 6.0
"""Stiffness of the pointer's pull, 1/s^2: newtons per metre and kilogram."""
STRONGEST = 5.0
"""Largest acceleration of the whole robot by the pointer, m/s^2."""
LEFT_S = 1.0
"""Time that an open dance has left after its last start, seconds."""
ROOM = 1.35
"""Margin of the pane around the dance, of its height."""


def live_page(run: RecordedRun, title: str) -> str | None:
    """Return the page; None where a browser cannot run the policy or the robot (`why_not_live`)."""
    if run.policy is None:
        return None
    data = live_data(run.policy, run.reference, run.robot)
    if data is None:
        return None
    dancer = "trained policy"
    if not isinstance(run.policy, Policy):
        dancer = f"tracker {run.policy.description.name}"
    points, mass = np.asarray(run.reference.keypoints_w), float(own_mass(run.robot.model).sum())
    around = np.linalg.norm(points[..., :2] - run.reference.qpos[:, None, :2], axis=-1)
    data |= {
        "height": ROOM * float(points[..., 2].max()),
        "width": 2 * (float(around.max()) + MARGIN_M),
        "tolerance": TOLERANCE_MM,
        "checked": CHECKED,
        "stiffness": PULL * mass,
        "strongest": STRONGEST * mass,
        "wasm": inline.compressed_asset("mujoco.wasm.gz"),
    }
    styles = [inline.own(name) for name in STYLES]
    scripts = [inline.asset("three.min.js"), inline.asset("mujoco.min.js")]
    scripts += [inline.own(name) for name in SCRIPTS]
    return inline.render(
        "live.html",
        styles,
        scripts,
        security=inline.policy(scripts, styles, wasm=True),
        title=title,
        robot=run.reference.robot,
        data=inline.json_text(data),
        last_start=last_start(run.reference),
        dancer=dancer,
    )


def last_start(reference: ReferenceMotion) -> int:
    """Return the last step at which a dance can begin; one that is not cyclic starts again as soon
    as it ends."""
    left = 0 if reference.cyclic else round(LEFT_S / reference.dt)
    return max(0, len(reference) - 1 - left)
