"""Descriptions and models of robots: wrong names, numbers, files and models that take for ever."""

import os
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

import gymnasium

from tests.badinput.base import ROOT
from tests.badinput.case import Case, Maker, writes

YAML = (
    (ROOT / "configs" / "robots" / "humanoid.yaml")
    .read_text()
    .replace("name: humanoid", "name: mine")
)
MODEL = Path(gymnasium.__file__).parent / "envs" / "mujoco" / "assets" / "humanoid.xml"
SHIPPED = "gymnasium:envs/mujoco/assets/humanoid.xml"


def robot(edit: Callable[[str], str]) -> Maker:
    """Return a maker of a description with one thing wrong."""
    return lambda here: (here / "mine.yaml").write_text(edit(YAML))


def model(edit: Callable[[str], str]) -> Maker:
    """Return a maker of a description with a model of its own."""

    def make(here: Path) -> None:
        (here / "mine.yaml").write_text(YAML.replace(SHIPPED, "mine.xml"))
        (here / "mine.xml").write_text(edit(MODEL.read_text()))

    return make


def bare(xml: str) -> Maker:
    """Return a maker of a description with a model that is this text alone."""
    return model(lambda _: xml)


def _piped(here: Path, inside: str) -> None:
    bare(f"<mujoco>{inside}<worldbody/></mujoco>")(here)
    os.mkfifo(here / "p.xml")


def _chain(here: Path, links: int) -> None:
    bare('<mujoco><include file="1.xml"/><worldbody/></mujoco>')(here)
    for n in range(1, links):
        (here / f"{n}.xml").write_text(f'<mujoco><include file="{n + 1}.xml"/></mujoco>')


def _mjcf(value: str) -> Maker:
    return robot(lambda t: t.replace(SHIPPED, value))


DESCRIPTIONS: Mapping[str, Maker] = {
    "empty": writes("mine.yaml", ""),
    "a list": writes("mine.yaml", "[1, 2]"),
    "unknown key": robot(lambda t: t + "evil: 1\n"),
    "radius -5": robot(lambda t: t.replace("radius: 0.075", "radius: -5")),
    "radius nan": robot(lambda t: t.replace("radius: 0.075", "radius: .nan")),
    "radius infinite": robot(lambda t: t.replace("radius: 0.075", "radius: .inf")),
    "radius 1e9": robot(lambda t: t.replace("radius: 0.075", "radius: 1e9", 1)),
    "radius of text": robot(lambda t: t.replace("radius: 0.075", "radius: big")),
    "control_dt 0": robot(lambda t: t + "control_dt: 0.0\n"),
    "control_dt 1e-9": robot(lambda t: t + "control_dt: 1.0e-9\n"),
    "control_dt 1e9": robot(lambda t: t + "control_dt: 1.0e+9\n"),
    "gear 1e300": robot(lambda t: t + "gear_scale: 1.0e+300\n"),
    "speed -1": robot(lambda t: t + "max_joint_speed: -1.0\n"),
    "site on nothing": robot(lambda t: t.replace("[pelvis, [", "[nobody, [")),
    "site of two numbers": robot(lambda t: t.replace("[0.0, 0.0, -0.04]", "[0.0, 0.0]")),
    "site at 1e300": robot(lambda t: t.replace("[0.0, 0.0, -0.04]", "[1.0e+300, 0.0, 0.0]")),
    "keypoint unknown": robot(lambda t: t.replace("  head: [torso", "  tail: [torso")),
    "key twice": robot(lambda t: t + "name: mine\n"),
    "root unknown": robot(lambda t: t.replace("root_body: torso", "root_body: nobody")),
    "root without joint": robot(lambda t: t.replace("root_body: torso", "root_body: pelvis")),
    "weight negative": robot(lambda t: t.replace("left_hip: 1.0", "left_hip: -1.0")),
    "rest of an unknown hinge": robot(lambda t: t.replace("left_knee: -0.3", "left_nose: -0.3")),
    "rest pose 1e300": robot(lambda t: t.replace("left_knee: -0.3", "left_knee: 1.0e+300")),
    "name of a path": robot(lambda t: t.replace("name: mine", "name: ../../x")),
    "name with an escape": robot(lambda t: t.replace("name: mine", 'name: "a\\e[31m"')),
    "name of 5000": robot(lambda t: t.replace("name: mine", "name: " + "x" * 5000)),
    "timestep 0": robot(lambda t: t + "simulation: {timestep: 0.0}\n"),
    "iterations 10^9": robot(lambda t: t + "simulation: {iterations: -1}\n"),
    "contacts empty": robot(lambda t: t.split("contacts:")[0] + "contacts: {}\n"),
    "side up": robot(lambda t: t.replace("side: left}", "side: up}")),
    "mjcf of a dotted package": _mjcf("os.path.x:y"),
    "mjcf of a missing package": _mjcf("nopackage:a.xml"),
    "mjcf of a builtin": _mjcf("sys:a.xml"),
    "mjcf out of a package": _mjcf("gymnasium:../../../../etc/passwd"),
    "mjcf passwd": _mjcf("/etc/passwd"),
    "mjcf device": _mjcf("/dev/zero"),
    "mjcf folder": _mjcf("/tmp"),
    "mjcf missing": _mjcf("nothing.xml"),
    "mjcf empty": _mjcf('""'),
    "mjcf store": _mjcf("store:../../x.xml"),
    "mjcf url": _mjcf("http://127.0.0.1:9/x.xml"),
    "aliases without end": robot(lambda t: t + "".join(
        f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 9) if n else 1}]\n" for n in range(9))),
    "an alias of itself": robot(lambda t: t + "evil: &a [*a]\n"),
    "a python object": robot(lambda t: t + "evil: !!python/object/apply:os.system ['touch x']\n"),
    "deep lists": robot(lambda t: t + "evil: " + "[" * 5000 + "]" * 5000),
    "extends itself": robot(lambda t: t + "extends: mine.yaml\n"),
    "extends a device": robot(lambda t: t + "extends: /dev/zero\n"),
    "two documents": robot(lambda t: t + "---\n" + t),
    "invalid utf-8": writes("mine.yaml", b"name: \xff\xfe"),
    "binary": writes("mine.yaml", bytes(range(256))),
}  # fmt: skip
MODELS: Mapping[str, Maker] = {
    "nan in a size": model(lambda t: t.replace('size="0.07"', 'size="nan"')),
    "nan in a position": model(lambda t: t.replace('pos="0 0 1.4"', 'pos="nan 0 1.4"')),
    "infinite mass": model(lambda t: t.replace('type="capsule"', 'type="capsule" mass="inf"', 1)),
    "position 1e300": model(lambda t: t.replace('pos="0 0 1.4"', 'pos="1e300 0 1.4"')),
    "gear 1e30": model(lambda t: t.replace('gear="100"', 'gear="1e30"')),
    "nan in gravity": model(lambda t: t.replace("<worldbody>", '<option gravity="nan 0 0"/><worldbody>')),
    "gravity 1e300": model(lambda t: t.replace("<worldbody>", '<option gravity="0 0 1e300"/><worldbody>')),
    "stiffness 1e300": model(lambda t: t.replace('stiffness="10"', 'stiffness="1e300"')),
    "nan in a colour": model(lambda t: t.replace('rgba="0.8 0.6 .4 1"', 'rgba="nan 0.6 .4 1"')),
    "empty": bare(""),
    "no XML": bare("{}"),
    "no robot": bare("<mujoco/>"),
    "unknown element": bare("<mujoco><evil/></mujoco>"),
    "entities": bare('<!DOCTYPE a [<!ENTITY a "aaaa"><!ENTITY b "&a;&a;&a;&a;">]><mujoco>&b;</mujoco>'),
    "external entity": bare('<!DOCTYPE a [<!ENTITY x SYSTEM "file:///etc/passwd">]><mujoco model="&x;"/>'),
    "include itself": bare('<mujoco><include file="mine.xml"/></mujoco>'),
    "include a device": bare('<mujoco><include file="/dev/zero"/></mujoco>'),
    "include a pipe": lambda here: _piped(here, '<include file="p.xml"/>'),
    "include a pipe twice": lambda here: _piped(here, '<include file="p.xml" file="p.xml"/>'),
    "mesh a pipe": lambda here: _piped(here, '<asset><mesh name="m" file="p.xml"/></asset>'),
    "includes of includes": lambda here: _chain(here, 3000),
    "mesh a device": bare('<mujoco><asset><mesh name="m" file="/dev/zero"/></asset></mujoco>'),
    "texture of 60000": bare('<mujoco><asset><texture name="a" type="2d" builtin="flat" width="60000" '
                             'height="60000"/></asset><worldbody/></mujoco>'),
    "field of 30000": bare('<mujoco><asset><hfield name="a" nrow="30000" ncol="30000" size="1 1 1 1"/>'
                           '</asset><worldbody/></mujoco>'),
    "memory of 60 GB": model(lambda t: t.replace("<worldbody>", '<size memory="60G"/><worldbody>')),
    "a million copies": bare('<mujoco><worldbody><replicate count="1000000"><geom size=".1"/></replicate>'
                             "</worldbody></mujoco>"),
    "copies of copies": bare('<mujoco><worldbody><replicate count="999"><replicate count="999"><geom '
                             'size=".1"/></replicate></replicate></worldbody></mujoco>'),
    "deep bodies": bare("<mujoco><worldbody>" + "<body>" * 9000 + "</body>" * 9000 + "</worldbody></mujoco>"),
    "plugin": bare('<mujoco><extension><plugin plugin="evil"/></extension><worldbody/></mujoco>'),
    "control characters": bare("<mujoco model=\"\x1b[31m\"/>"),
}  # fmt: skip


def cases() -> Iterator[Case]:
    for number, (name, make) in enumerate(DESCRIPTIONS.items()):
        words = ("retarget", "@/smpl.parquet", "-o", "out", "--robot", "mine.yaml")
        if number % 4 == 0:
            words = ("train", "@/reference.parquet", "-o", "out", "--robot", "mine.yaml")
        elif number % 4 == 1:
            words = ("robots", "check", "mine.yaml", "-o", "p.png")
        yield Case("robot", name, words, make)
    for number, (name, make) in enumerate(MODELS.items()):
        words = ("retarget", "@/smpl.parquet", "-o", "out", "--robot", "mine.yaml")
        if number % 3 == 0:
            words = ("robots", "new", "mine.xml", "-o", "fresh.yaml")
        yield Case("robot", f"model: {name}", words, make)
    for name, value in {"unknown": "nobody", "traversal": "../smoke", "device": "/dev/zero",
                        "empty": "", "model as robot": "mine.xml"}.items():  # fmt: skip
        words = ("retarget", "@/smpl.parquet", "-o", "out", "--robot", value)
        yield Case("robot", f"name: {name}", words, writes("mine.xml", "<mujoco/>"))
    for name in ("nobody", "../x", "humanoid"):
        yield Case("robot", f"add {name}", ("robots", "add", name))
