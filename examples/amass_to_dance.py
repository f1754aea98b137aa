"""A motion of AMASS in, a robot that dances it out.

Any file that `rj.read_motion` knows will do. Without one, the bundled walk is written as AMASS has
it and read again.
"""

import sys

import robojackson as rj
from robojackson.pipeline.bundled_clips import bundled

file, steps = (sys.argv[1:] + ["", ""])[:2]
if not file:
    file = "walk_amass.npz"
    rj.write_motion(rj.recover_motion(bundled("walk.mp4"), progress=True), file, to="amass")

motion = rj.read_motion(file)
print(motion)
robot = rj.load_robot("humanoid")
reference = rj.retarget_motion(motion, robot)
print(reference)
trained = rj.train_policy(
    reference, robot, steps=int(steps or 600_000), out="amass_run", progress=True
)
print(trained)
verdict = rj.evaluate_policy(trained.policy, reference, progress=True)
print(verdict)
print(rj.render_video("amass_dance.mp4", reference, rollout=verdict, motion=motion).path)
