"""Build the programs that pages and live dances carry inside: three.js, uPlot and MuJoCo's wasm.

Pinned npm packages, checked by sha256; esbuild puts them into one script each, and the bytes are
reproducible. Changed in MuJoCo's script: its two uses of `new Function` become closures, so that a
page needs no 'unsafe-eval' in its content security policy, and the script exports to a global.

    python -m tools.assets.build_web                    with npm's registry
    python -m tools.assets.build_web --packages FOLDER  with tarballs that `npm pack` brought
"""

import argparse
import gzip
import hashlib
import logging
import subprocess
import tarfile
import tempfile
from pathlib import Path

logger = logging.getLogger("build_web")

PACKAGES = {
    "three@0.187.0": "ff540832ded0cfe919764d24a3d88f3e2a05f23303f876423e4f893841e90728",
    "uplot@1.6.32": "4b8a8191e425658e3ea8c8c1314b0fc679c861ee3a1af2b20c7b16ba50b5133d",
    "@mujoco/mujoco@3.14.0": "f845a07ab81303cc6579fec07136818bed21d44a31c1911340f61e06f4d11eee",
    "@esbuild/linux-x64@0.28.2": "9573bb2233aab0f9ea7647d5cca9726113cc1768de61d66b17267f4db84488f6",
}
THREE = """
export { Bone, BoxGeometry, BufferAttribute, BufferGeometry, CapsuleGeometry, Color,
  CylinderGeometry, DirectionalLight, Fog, GridHelper, Group, HemisphereLight, InstancedMesh, Line,
  LineBasicMaterial, Matrix4, Mesh, MeshBasicMaterial, MeshLambertMaterial, PerspectiveCamera,
  Plane, PlaneGeometry, Quaternion, Raycaster, Scene, Skeleton, SkinnedMesh, SphereGeometry,
  Vector2, Vector3, WebGLRenderer } from 'three';
export { OrbitControls } from 'three/examples/jsm/controls/OrbitControls.js';
"""
"""What of three.js is in the script."""
EVALUATED = "var invokerFn = new Function(...args, invokerFnBody)(...closureArgs);"
INVOKER = """var invokerFn = function (...given) {
  checkArgCount(given.length, minArgs, expectedArgCount, humanName, throwBindingError);
  var destructors = needsDestructorStack ? [] : null, wired = [cppTargetFunc];
  if (isClassMethodFunc) wired.push(argTypes[1].toWireType(destructors, this));
  for (var k = 2; k < argCount; ++k) wired.push(argTypes[k].toWireType(destructors, given[k - 2]));
  var rv = cppInvokerFunc(...wired);
  if (needsDestructorStack) runDestructors(destructors);
  else for (var k = isClassMethodFunc ? 1 : 2; k < argCount; ++k)
    if (argTypes[k].destructorFunction !== null)
      argTypes[k].destructorFunction(wired[isClassMethodFunc ? k : k - 1]);
  if (returns) return argTypes[0].fromWireType(rv);
};"""
COMPILED = (
    "let [args, invokerFnBody] = createJsInvoker(argTypes, isClassMethodFunc, returns, isAsync);"
)
CALLED = "var invokerFunction = new Function(...params, functionBody)(...args);"
CALLER = """var invokerFunction = function (obj, func, destructorsRef, args) {
  var values = kind === 0 ? [obj] : [], at = 0;
  for (var type of types) {
    values.push(type.readValueFromPointer(args + at));
    at += type.argPackAdvance;
  }
  var rv = kind === 1 ? new func(...values) : func.call(...values);
  if (!retType.isVoid) return emval_returnValue(retType, destructorsRef, rv);
};"""
ASSETS = Path(__file__).resolve().parents[2] / "robojackson" / "assets"


class BuildError(Exception):
    """A package is not the one that this tool was made for."""


def build(packages: Path | None, out: Path) -> list[Path]:
    """Write three.min.js, uplot.min.js, mujoco.min.js and mujoco.wasm.gz."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for package, digest in PACKAGES.items():
            _install(package, digest, packages, folder)
        modules = folder / "node_modules"
        (folder / "three.js").write_text(THREE)
        source = modules / "@mujoco" / "mujoco"
        (folder / "mujoco.js").write_text(_without_evaluation((source / "mujoco.js").read_text()))
        made = {
            "three.min.js": _bundle(folder, "three.js", "THREE"),
            "mujoco.min.js": _bundle(folder, "mujoco.js", "MUJOCO"),
            "uplot.min.js": (modules / "uplot" / "dist" / "uPlot.iife.min.js").read_bytes(),
            "uplot.min.css": (modules / "uplot" / "dist" / "uPlot.min.css").read_bytes(),
            "mujoco.wasm.gz": gzip.compress((source / "mujoco.wasm").read_bytes(), 9, mtime=0),
        }
    for name, content in made.items():
        (out / name).write_bytes(content)
        logger.info("| `%s` | %s | `%s` |", name, f"{len(content):,}", _sha256(content))
    return [out / name for name in made]


def _install(package: str, digest: str, packages: Path | None, folder: Path) -> None:
    """Unpack a tarball where esbuild finds it."""
    name, version = package.rsplit("@", 1)
    file = f"{name.removeprefix('@').replace('/', '-')}-{version}.tgz"
    if packages is None:
        packages = folder
        command = ["npm", "pack", package, "--silent", "--pack-destination", str(folder)]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    content = (packages / file).read_bytes()
    if _sha256(content) != digest:
        raise BuildError(f"{file} has sha256 {_sha256(content)}, expected {digest}")
    target = folder / "node_modules" / name
    target.parent.mkdir(parents=True, exist_ok=True)
    with tarfile.open(packages / file) as archive:
        archive.extractall(folder / "unpacked", filter="data")
    (folder / "unpacked" / "package").rename(target)


def _without_evaluation(text: str) -> str:
    """Return MuJoCo's script with closures where it compiled strings."""
    for old, new in ((COMPILED, ""), (EVALUATED, INVOKER), (CALLED, CALLER)):
        if text.count(old) != 1:
            raise BuildError(f"mujoco.js has no single {old!r}")
        text = text.replace(old, new)
    return text.replace("import.meta.url", "'file:///mujoco.js'")


def _bundle(folder: Path, entry: str, name: str) -> bytes:
    command = ["node_modules/@esbuild/linux-x64/bin/esbuild", entry, "--bundle", "--minify",
               "--format=iife", f"--global-name={name}", "--charset=utf8", "--external:module",
               "--legal-comments=inline"]  # fmt: skip
    return subprocess.run(command, cwd=folder, check=True, capture_output=True).stdout


def _sha256(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


def main(arguments: list[str] | None = None) -> int:
    """Build the web assets from the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--packages", type=Path, help="folder of the tarballs")
    parser.add_argument("--out", type=Path, default=ASSETS)
    given = parser.parse_args(arguments)
    logging.basicConfig(level=logging.INFO, format="%(message)s")
    build(given.packages, given.out)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
