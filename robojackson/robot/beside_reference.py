"""The evaluation of a robot that is not the paper's, as the YAML of its first description.

It is the G1's: fall and strict success are differences to the reference at every step, so that a
bow or a knee on the floor is no fault where the dancer bows or kneels, and a motion that ends gets
tails. Metres, radians.
"""

from robojackson.robot.description import FallRule, StrictRule

FALL = FallRule(frame="reference", height=0.25, tilt=0.8)
STRICT = StrictRule(sites=0.20, ends=0.25, knees=None, floor=True)


def rule_lines() -> list[str]:
    """Return the blocks `fall` and `strict` of a description."""
    return [
        "fall: # it has fallen where its root is so far from the reference's",
        f"  frame: {FALL.frame} # a motion that ends begins and ends standing, too",
        f"  height: {FALL.height} # metres; less for a robot much smaller than a person",
        f"  tilt: {FALL.tilt} # radians between the up axes",
        "strict: # strict success, at every step; metres",
        f"  sites: {STRICT.sites} # mean distance of the keypoints from the reference's",
        f"  ends: {STRICT.ends} # in height, of feet and hands",
        "  knees: null # the line below is the rule for them",
        f"  floor: {str(STRICT.floor).lower()} # nothing on it that the reference has not there",
    ]
