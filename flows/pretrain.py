"""Flow `pretrain`: train a walker in a process of its own; the deployment is `pretrain/walker`."""

import json
import sys
from pathlib import Path
from typing import Literal

from prefect import flow

from storage.store import Store
from tasks.process import run_process


@flow(name="pretrain", flow_run_name="walker-{kind}-s{seed}")
async def pretrain(
    kind: Literal["track", "paper"] = "track", steps: int = 400_000, seed: int = 0
) -> str:
    """A walker of a kind; the same call goes on from the last checkpoint.

    Returns:
        The key of its networks in the store.
    """
    store = Store.from_environment()
    work = Path(store.work(f"walker-{kind}-s{seed}"))
    command = [sys.executable, "-m", "flows.cli", "pretrain", "--kind", kind, "-o", str(work)]
    options = ["--steps", str(steps), "--seed", str(seed), "--json"]
    answer = json.loads(await run_process([*command, *options], f"walker-{kind}", work, None))
    made = Path(answer["walker"])
    store.keep("pretrain", "walker.json", (work / "walker.json").read_bytes())
    return store.keep("pretrain", made.name, made).key
