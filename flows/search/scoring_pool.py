"""Pools that score candidates in parallel: threads of this process, or a Dask cluster.

`ROBOJACKSON_DASK=local` starts a cluster of this machine's cores for the time of a flow;
`ROBOJACKSON_DASK=tcp://host:8786` uses one that is there, whose workers have this package, the same
environment and a store that they all reach.
"""

import os
from collections.abc import Mapping
from typing import Any

from prefect.task_runners import TaskRunner, ThreadPoolTaskRunner

from robojackson.errors import MissingDependency

VARIABLE, LOCAL = "ROBOJACKSON_DASK", "local"
THREADS = 2


def scorers(environment: Mapping[str, str] = os.environ) -> TaskRunner[Any]:
    """Return the task runner that the environment names.

    Raises:
        MissingDependency: it names Dask, which is not installed.
    """
    address = environment.get(VARIABLE)
    if not address:
        return ThreadPoolTaskRunner(max_workers=THREADS)
    try:
        from prefect_dask import DaskTaskRunner  # type: ignore[attr-defined]
    except ImportError as cause:
        raise MissingDependency(
            f"{VARIABLE}={address} needs Dask: pip install 'robojackson[dask]'"
        ) from cause
    if address == LOCAL:
        return DaskTaskRunner(cluster_kwargs={"threads_per_worker": 1, "dashboard_address": None})
    return DaskTaskRunner(address=address)
