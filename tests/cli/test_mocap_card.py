"""What `mocap` says of a motion: how sure it is, and the gravest reason for doubt."""

import pytest

from robojackson.cli import mocap_card

MOTION = {
    "frames": 120, "fps": 30.0, "person": 1, "detected": 110, "contact_share": {"left_heel": 0.4},
    "notes": (), "smpl": "smpl.parquet", "advice": (), "next": "robojackson retarget smpl.parquet",
    "floor": {"lowest_keypoint_m": 0.0, "gravity": "network", "tilt_deg": 12.0,
              "gravity_sd_deg": 6.2, "gravity_sure": False, "head_down_share": 0.0,
              "lying_share": 0.0},
}  # fmt: skip


def test_a_motion_says_how_sure_it_is_of_gravity() -> None:
    text = "\n".join(mocap_card.mocap_lines(MOTION))
    assert "from the body alone, not sure: within 6 degrees; the camera is tilted by 12" in text
    known = MOTION["floor"] | {"gravity": "scene", "gravity_sd_deg": 1.4, "gravity_sure": True}  # type: ignore[operator]
    text = "\n".join(mocap_card.mocap_lines(MOTION | {"floor": known}))
    assert "from straight edges of the room, sure: within 1 degrees" in text


def test_weak_stretches_are_advised_against_until_they_are_left_out() -> None:
    found = {
        "median_m": 0.02,
        "weak_s": [(1.0, 1.2), (1.3, 1.5)],
        "filled_s": [(2.0, 2.5)],
        "left_out": False,
    }
    text = "\n".join(mocap_card.mocap_lines(MOTION | {"reprojection": found}))
    assert "weak      1.0-1.5 s (leave them out: --set mocap.leave_out_weak=true)" in text
    assert "filled in 2.0-2.5 s" in text
    text = "\n".join(mocap_card.mocap_lines(MOTION | {"reprojection": found | {"left_out": True}}))
    assert "weak      1.0-1.5 s" in text
    assert "--set" not in text


@pytest.mark.parametrize(
    ("changes", "kind"),
    [
        ({"detected": 120}, "whole"),
        ({"detected": 114}, "whole"),
        ({"detected": 96}, "gaps"),
        ({"detected": 36}, "poor"),
        ({"frames": 5, "detected": 5}, "short"),
        ({"reprojection": {"median_m": 0.6, "weak_s": (), "filled_s": ()}}, "doubtful"),
        ({"advice": [{"kind": "body_outside", "value": 1.0, "words": "step back"}]}, "cut_off"),
        ({"floor": {"lowest_keypoint_m": -0.27}}, "doubtful"),
        ({"floor": {"head_down_share": 1.0}}, "head_down"),
        ({"floor": {"lying_share": 0.9}}, "lying"),
    ],
)
def test_the_verdict_is_the_gravest_reason_for_doubt(changes: dict, kind: str) -> None:
    answer = MOTION | {"detected": 120} | changes
    answer["floor"] = MOTION["floor"] | changes.get("floor", {})  # type: ignore[operator]
    found = mocap_card.with_verdict(answer)
    assert found["verdict"]["kind"] == kind
    assert ("next" in found) == (kind != "short")


def test_a_turned_picture_is_named_with_the_command_that_turns_it() -> None:
    hanging = MOTION["floor"] | {"head_down_share": 1.0}  # type: ignore[operator]
    found = mocap_card.mocap_verdict(MOTION | {"floor": hanging})
    assert "upside down, turn it: ffmpeg -i IN -vf hflip,vflip OUT.mp4" in found["sentence"]
