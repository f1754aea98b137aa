"""A process that has imported what commands need, and forks for each case: minutes are saved.

    python -m tests.badinput.warm

A fork runs the real command line (`robojackson.__main__.main`) with the words, the folder and the
whole environment of its case. Requests and answers are lines of JSON on stdin and stdout.
"""

import json
import os
import sys
import time

IMPORTED = (
    *("numpy", "scipy.spatial.transform", "pyarrow.parquet", "pyarrow.compute", "av", "mujoco"),
    *("pydantic", "typer", "yaml", "duckdb", "safetensors.numpy", "rich.progress", "gymnasium"),
    *("robojackson.__main__", "robojackson.cli.app", "robojackson.cli.stages"),
    *("robojackson.api.motions", "robojackson.cli.importing", "robojackson.api.evaluation"),
    *("robojackson.pipeline.pipeline_config", "robojackson.cli.pictures.retarget_pictures"),
)


def main() -> None:
    """Answer requests until stdin ends."""
    import importlib

    for name in IMPORTED:
        importlib.import_module(name)
    for line in sys.stdin:
        sys.stdout.write(json.dumps(_ended(json.loads(line))) + "\n")
        sys.stdout.flush()


def _ended(request: dict[str, object]) -> dict[str, float]:
    child = os.fork()
    if not child:
        _become(request)
    until = time.monotonic() + float(request["seconds"])  # type: ignore[arg-type]
    while True:
        ended, status, usage = os.wait4(child, os.WNOHANG)
        if ended:
            cpu_s = usage.ru_utime + usage.ru_stime
            code = os.waitstatus_to_exitcode(status)
            return {"code": code, "peak_kb": usage.ru_maxrss, "cpu_s": cpu_s}
        if time.monotonic() > until:
            os.killpg(child, 9)
        time.sleep(0.01)


def _become(request: dict[str, object]) -> None:
    """Turn this process into that of a command: its folder, environment, files and words."""
    code = 70
    try:
        os.setsid()
        os.chdir(str(request["here"]))
        os.environ.clear()
        os.environ.update(request["env"])  # type: ignore[arg-type]
        flags = os.O_WRONLY | os.O_CREAT
        for number, target in ((0, os.devnull), (1, request["out"]), (2, request["err"])):
            file = os.open(str(target), os.O_RDONLY if number == 0 else flags, 0o600)
            os.dup2(file, number)
            os.close(file)
        sys.argv = ["robojackson", *request["words"]]  # type: ignore[misc]
        if request["cold"]:
            words = [sys.executable, "-m", "robojackson", *sys.argv[1:]]
            os.execve(sys.executable, words, dict(os.environ))
        from robojackson.__main__ import main as command

        command()
    except SystemExit as end:
        code = end.code if isinstance(end.code, int) else 1
    except BaseException:
        import traceback

        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)


if __name__ == "__main__":
    main()
