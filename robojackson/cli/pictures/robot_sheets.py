"""`robojackson robots check` and `robots new`: from a model to a robot description."""

from dataclasses import fields
from pathlib import Path
from typing import Any

from robojackson.cli.cards import closing, command_line
from robojackson.errors import BadConfiguration, RoboJacksonError, StoreError
from robojackson.files.file_tree import FileTree
from robojackson.pipeline.robot_descriptions import describe_robot, is_file, robot_names
from robojackson.robot.body_states import own_mass
from robojackson.robot.description import RobotDescription
from robojackson.robot.model import Robot

Figures = dict[str, Any]
LEG = "sites.left_hip"
NO_LEGS = (
    "no legs were found; with its joints at zero the model has to face along x, its left at y > 0. "
    "Turn its root body, or name the bodies by hand"
)


def check_robot(given: str, picture: Path | None) -> tuple[Figures, list[str]]:
    """Return the figures of a robot and lines about them; draw it where `picture` is given.

    Returns:
        Figures with `ok` and `problems`; lines.

    Raises:
        UnknownName: no such robot.
        MissingDependency: no way to draw without a screen.
    """
    from robojackson.robot.description_check import problems
    from robojackson.robot.model import load_robot

    try:
        description = describe_robot(given)
        found = problems(description)
    except BadConfiguration as cause:
        found = _all_of(cause)
    answer: Figures = {"robot": given, "ok": not found, "problems": found}
    lines = [f"{given}: {len(found)} problem{'s' if len(found) > 1 else ''}", *found]
    try:
        robot = load_robot(describe_robot(given))
    except RoboJacksonError:
        answer |= _verdict(given, True)
        return answer, [*lines, *closing(answer)]
    figures = _figures(robot)
    answer |= figures | {"picture": None}
    lines = (lines if found else []) + _table(figures)
    if picture is not None:
        from robojackson.report.plots.robot_sheet import robot_sheet
        from robojackson.report.plots.run_plots import png

        FileTree(picture.parent).write(picture.name, png(robot_sheet(robot), opaque=True))
        answer["picture"] = str(picture)
        lines.append(f"picture  {picture}")
    answer |= _verdict(given, bool(found))
    return answer, [*lines, *closing(answer)]


def _verdict(given: str, problems: bool) -> Figures:
    """Return `verdict` and `next` of a check."""
    if problems:
        sentence = "The description cannot be used yet."
        return {
            "verdict": {"kind": "problems", "sentence": sentence},
            "next": command_line("robots", "check", given),
        }
    sentence = f"{given} has no problems: look at the picture before it dances."
    following = command_line("dance", "--robot", given)
    return {"verdict": {"kind": "whole", "sentence": sentence}, "next": following}


def picture_of(given: str) -> Path:
    """Return the default place of a robot's picture."""
    return Path(given).with_suffix(".png") if is_file(given) else Path(f"{given}.png")


def new_robot(model: Path, out: Path | None, force: bool) -> tuple[Figures, list[str]]:
    """Write a first description of a model and check it.

    Raises:
        BadConfiguration: MuJoCo cannot load the model.
        StoreError: the file exists and `force` is not given, or it cannot be written.
    """
    from robojackson.robot.first_description import first_description, name_of_model
    from robojackson.robot.names import robot_name

    name = robot_name(out.stem) if out is not None else name_of_model(model)
    if name in robot_names():
        name = f"my_{name}"
    target = out or Path(f"{name}.yaml")
    draft = first_description(model, target.parent, name)
    if target.exists() and not force:
        raise StoreError(f"{target} exists; --force overwrites it, -o names another")
    FileTree(target.parent).write(target.name, draft.text.encode())
    answer, lines = check_robot(str(target), None)
    head = [f"wrote    {target}"]
    if draft.guessed:
        head.append(f"guessed  {', '.join(draft.guessed)}: not from a name; look at the picture")
    if draft.left:
        head.append(f"left     {', '.join(draft.left)}: comments in the file, fill them in")
    if LEG in draft.left:
        head.append(f"hint     {NO_LEGS}")
    picture = target.with_suffix(".png")
    answer["next"] = command_line("robots", "check", str(target), "-o", str(picture))
    lines = answer["problems"] or lines[:1]
    facts = {"file": str(target), "guessed": list(draft.guessed), "left": list(draft.left)}
    return facts | answer, [*head, *lines, f"next: {answer['next']}"]


def _all_of(cause: BadConfiguration) -> list[str]:
    """Return every wrong key and value of a file, of which the loader names the first."""
    from pydantic import ValidationError

    found = [str(cause)]
    if isinstance(cause.__cause__, ValidationError):
        for error in cause.__cause__.errors()[1:]:
            key = ".".join(str(part) for part in error["loc"])
            unknown = error["type"] == "unexpected_keyword_argument"
            words = f"unknown key {key!r}.{_close(key)}" if unknown else f"{key!r}: {error['msg']}"
            found.append(f"{cause.source}: {words}")
    return found


def _close(key: str) -> str:
    """Return the key of a description that was probably meant."""
    import difflib

    close = difflib.get_close_matches(key, [f.name for f in fields(RobotDescription)], 1)
    return f" Did you mean {close[0]!r}?" if close else ""


def _figures(robot: Robot) -> Figures:
    from robojackson.report.plots.robot_sheet import standing

    pose, model = standing(robot), robot.model
    heights = {
        name: float(at[2] - radius)
        for (name, at), radius in zip(pose.balls.items(), robot.contact_radii, strict=True)
    }
    ranges = {
        name: {"low": low, "high": high, "rest": rest, "torque": torque}
        for name, low, high, rest, torque in zip(
            robot.joint_names, robot.lower, robot.upper, robot.rest, robot.torque_limit, strict=True
        )
    }
    bodies = {key: body for key, (body, _) in robot.description.sites.items()}
    return {
        "name": robot.description.name,
        "hinges": len(robot.joint_names),
        "motors": int(robot.actuated.sum()),
        "mass_kg": float(own_mass(model).sum()),
        "height_m": float(pose.high[2]),
        "joints": ranges,
        "keypoints": {key: bodies[key] for key in pose.keypoints},
        "contacts": heights,
    }


def _table(answer: Figures) -> list[str]:
    width = max(map(len, (*answer["joints"], *answer["keypoints"], *answer["contacts"])))
    lines = [
        f"{answer['name']}: {answer['hinges']} hinges, {answer['motors']} with a torque limit, "
        f"{answer['mass_kg']:.1f} kg, {answer['height_m']:.2f} m tall at rest",
        f"{'joint':<{width}}  {'from':>7}  {'to':>7}  {'rest':>7}  {'Nm':>6}   degrees",
    ]
    for name, joint in answer["joints"].items():
        low, high, rest = (57.29578 * float(joint[key]) for key in ("low", "high", "rest"))
        torque = f"{joint['torque']:.0f}" if joint["torque"] < float("inf") else "-"
        lines.append(f"{name:<{width}}  {low:>7.1f}  {high:>7.1f}  {rest:>7.1f}  {torque:>6}")
    lines.append(f"{'keypoint':<{width}}  body")
    lines += [f"{key:<{width}}  {body}" for key, body in answer["keypoints"].items()]
    lines.append(f"{'contact ball':<{width}}  mm above the floor at rest")
    lines += [
        f"{name:<{width}}  {round(1e3 * at, 1) + 0.0:.1f}"
        for name, at in answer["contacts"].items()
    ]
    return lines
