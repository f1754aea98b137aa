"""What a cached stage would answer, found out without running it."""

from typing import Any

from prefect import Task
from prefect.cache_policies import CacheKeyFnPolicy
from prefect.results import get_result_store


async def kept(stage: Task[..., Any], **parameters: Any) -> Any | None:
    """The result that a call of the stage finds in the cache, or None if it would have to run.

    Args:
        stage: A task that `tasks.caching.stage` made.
        parameters: Those of the call that its key is made of.
    """
    policy = stage.cache_policy
    assert isinstance(policy, CacheKeyFnPolicy)
    assert policy.cache_key_fn is not None
    try:
        store = await get_result_store().aupdate_for_task(stage)
        key = policy.cache_key_fn(None, parameters)  # type: ignore[arg-type]
        return (await store.aread(str(key))).result
    except Exception:  # no record, or one that cannot be read: Prefect takes both for a miss
        return None
