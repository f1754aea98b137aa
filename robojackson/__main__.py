"""The `robojackson` command with all of its commands: where library and flows are composed.

The only module of the library that knows the flows; nothing imports it. The commands of one stage
run with the library alone; for the others the app folder (`pipeline.app_folder`) comes first on
this process's path.
"""

import sys

from robojackson.cli.start import start


def main() -> None:
    """Run the console script and end the process."""
    start(_command)


def _command() -> int:
    from robojackson.cli.app import STAGES, add_stages, make_app, run

    if sys.argv[1:2] and sys.argv[1] in (*STAGES, "robots"):
        alone = make_app()
        add_stages(alone)
        return run(alone)
    from robojackson.pipeline.app_folder import use_app_folder

    use_app_folder()
    from flows.cli.commands import app

    return run(app)


if __name__ == "__main__":
    main()
