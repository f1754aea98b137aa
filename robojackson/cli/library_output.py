"""Keep libraries from writing to the terminal beside our lines.

Problems of a library that concern the user are an error of ours, or a note. The variables are read
by native code when it is loaded, so they are set before anything is imported, and child processes
inherit them. A variable that the user has set is not changed.
"""

import os
import sys

VARIABLES = {
    "TF_CPP_MIN_LOG_LEVEL": "3",  # XLA below JAX
    "GLOG_minloglevel": "3",  # MediaPipe
    "EGL_LOG_LEVEL": "fatal",  # Mesa
    "MESA_DEBUG": "silent",
    "PREFECT_LOGGING_ROOT_LEVEL": "ERROR",  # of other packages than Prefect
    "PYTHONWARNINGS": "ignore",
}


OWN_PACKAGES = ("robojackson", "flows", "tasks", "storage", "configs")
"""Packages whose log is for the user; other packages log errors only."""


def set_variables() -> None:
    """Set variables for native code and child processes, unless the user has set them."""
    for name, value in VARIABLES.items():
        os.environ.setdefault(name, value)


def silence_libraries() -> None:
    """Show only errors of other packages' loggers, and no warning of Python's."""
    import logging

    if sys.warnoptions:
        return
    logging.captureWarnings(True)
    log = logging.getLogger("py.warnings")
    log.setLevel(logging.ERROR)
    log.propagate = False


def log_to_stderr() -> None:
    """Send our log to stderr, one short printable line a record, and errors of other libraries."""
    import logging

    from robojackson.cli.lifetime.interruption import printable

    class Plain(logging.Formatter):
        def format(self, record: logging.LogRecord) -> str:
            return printable(" ".join(super().format(record).split()))

    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(Plain("%(message)s"))
    logging.basicConfig(level=logging.ERROR, handlers=[handler])
    for own in OWN_PACKAGES:
        logging.getLogger(own).setLevel(logging.INFO)
