"""The logger of a run: what it gets stands on Prefect's pages."""

import logging
import sys
from typing import Any

USUAL = logging.getLogger("robojackson")


def run_logger() -> Any:
    """Return the logger of the running flow or task; outside of a run, the library's."""
    if "prefect" not in sys.modules:
        return USUAL
    from prefect.exceptions import MissingContextError
    from prefect.logging import get_run_logger

    try:
        return get_run_logger()
    except MissingContextError:
        return USUAL
