"""`robojackson doctor --report`: this machine in Markdown, to paste into an issue.

The report contains no host, user, folder or secret: of an address only whether it is this
machine's, of a folder only whether it is the usual one and how full its disk is.
"""

import importlib
import json
import os
import platform
import shutil
import sys
import urllib.error
import urllib.request
from collections.abc import Mapping
from importlib.metadata import version
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from robojackson.files.local_folder import folder_of
from robojackson.files.processor_cores import cores

PATIENCE_S = 2.0
"""Longest wait for a server or a program, seconds."""
LOCAL = ("127.0.0.1", "localhost", "::1")
STORE, USUAL_STORE = "ROBOJACKSON_STORE", "store"
SERVER = "PREFECT_API_URL"
GIGABYTE = 1e9


def issue_report(examined: Mapping[str, Any]) -> list[str]:
    """Return the lines of the report.

    Args:
        examined: Findings of `doctor`.
    """
    packages = {name: each or "missing" for name, each in examined["packages"].items()}
    facts = {
        "robojackson": version("robojackson"),
        "Python": f"{examined['python']} ({platform.python_implementation()})",
        "platform": f"{platform.system()} {platform.machine()}, {_distribution()}, "
        f"kernel {platform.release()}",
        "CPU": f"{cpu_model()}, {cores()} cores usable",
        "memory": _memory(),
        "OpenGL": renderer(),
        "JavaScript engine": examined["javascript"] or "none",
        "pose models": ", ".join(size for size, there in examined["models"].items() if there),
        "Prefect server": server_state(os.environ),
        "store": store_state(os.environ),
        "packages": ", ".join(f"{name} {each}" for name, each in packages.items()),
        "missing": "; ".join(examined["missing"]) or "nothing",
    }
    rows = [f"| {name} | {_cell(text)} |" for name, text in facts.items()]
    return ["### robojackson doctor", "", "| what | here |", "|---|---|", *rows]


def cpu_model() -> str:
    """Return the name of the processor."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor() or "unknown"
    named = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return named[0] if named else platform.processor() or "unknown"


def renderer() -> str:
    """Return the renderer that works without a screen, or why none does."""
    try:
        backend = "egl" if sys.platform == "linux" else "cgl"
        context = importlib.import_module(f"mujoco.{backend}").GLContext(16, 16)
        context.make_current()
        gl = importlib.import_module("OpenGL.GL")
        name, api = gl.glGetString(gl.GL_RENDERER), gl.glGetString(gl.GL_VERSION)
        context.free()
    except Exception as cause:  # each backend has its own exceptions for a missing library
        return f"none: {type(cause).__name__}"
    return f"{backend}: {name.decode()}, OpenGL {api.decode()}"


def server_state(environment: Mapping[str, str]) -> str:
    """Return whether a Prefect server is configured, where, and whether it answers."""
    address = environment.get(SERVER)
    if not address:
        return f"{SERVER} is not set: each command starts one of its own"
    try:
        where = "on this machine" if urlsplit(address).hostname in LOCAL else "on another machine"
        with urllib.request.urlopen(f"{address}/admin/version", timeout=PATIENCE_S) as answer:
            return f"{where}, answers: Prefect {json.loads(answer.read(1000))}"
    except urllib.error.HTTPError as cause:
        return f"{where}, answers with HTTP {cause.code}"
    except (OSError, ValueError) as cause:
        reason = getattr(cause, "reason", cause)
        return f"{SERVER} is set, no answer: {type(reason).__name__}"


def store_state(environment: Mapping[str, str]) -> str:
    """Return the kind of the store, whether it exists, and the room on its disk."""
    given = environment.get(STORE)
    root = given or USUAL_STORE
    folder = folder_of(root)
    if folder is None:
        return f"{root.partition('://')[0]}:// address"
    folder = folder.absolute()
    name = f"the folder of {STORE}" if given else f"./{USUAL_STORE}"
    there = next(path for path in (folder, *folder.parents) if path.exists())
    try:
        disk = shutil.disk_usage(there)
    except OSError as cause:
        return f"{name}: {type(cause).__name__}"
    writable = "writable" if os.access(there, os.W_OK) else "not writable"
    state = writable if folder.is_dir() else f"not there yet, {writable}"
    return f"{name}: {state}, {disk.free / GIGABYTE:.1f} of {disk.total / GIGABYTE:.1f} GB free"


def _distribution() -> str:
    try:
        return platform.freedesktop_os_release().get("PRETTY_NAME", "unknown distribution")
    except OSError:
        return platform.version()


def _memory() -> str:
    try:
        size = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (ValueError, OSError):
        return "unknown"
    return f"{size / GIGABYTE:.0f} GB"


def _cell(text: str) -> str:
    """Return a text for a cell of a table, without the folder of the user."""
    plain = " ".join(text.split()).replace("|", "\\|")
    home = str(Path.home())
    return plain.replace(home, "~") if len(home) > 1 else plain
