"""A reward term of your own, as a function of the state of all robots.

This one pays for quiet hands: robots lose reward with the speed of their hands beyond that of the
reference. `RewardState` lists what a function sees; it returns one number a robot.
"""

import sys

import numpy as np

import robojackson as rj
from robojackson.pipeline.bundled_clips import bundled

words = sys.argv[1:]
steps = int(words.pop()) if words and words[-1].isdigit() else 600_000
video = words[0] if words else bundled("hip_shake.mp4")

robot = rj.load_robot("humanoid")
hands = [robot.keypoint_names.index(name) for name in ("left_hand", "right_hand")]


def quiet_hands(state: rj.RewardState) -> np.ndarray:
    """Return minus 0.1 for each m/s by which the hands are faster than the reference's."""
    speed = np.linalg.norm(state.moved[:, hands], axis=-1)
    target = np.linalg.norm(state.target.moved[:, hands], axis=-1)
    return -0.1 * np.maximum(speed - target, 0.0).mean(1)


reference = rj.retarget_motion(rj.recover_motion(video, progress=True), robot)
trained = rj.train_policy(
    reference, robot, steps=steps, reward={"quiet_hands": quiet_hands}, progress=True
)
print(trained)
paid = [row["reward_quiet_hands"] for row in trained.episodes]
print("quiet_hands, first and last tenth of the episodes:", end=" ")
tenth = max(1, len(paid) // 10)
print(round(float(np.mean(paid[:tenth])), 2), round(float(np.mean(paid[-tenth:])), 2))
trained.save("own_reward_run")
print(rj.evaluate_policy(trained.policy, reference, progress=True))
