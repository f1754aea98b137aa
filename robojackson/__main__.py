"""The `robojackson` command with all of its commands: where library and flows are composed.

The only module of the library that knows the flows; nothing imports it.
"""

from robojackson.cli.start import start


def main() -> None:
    """Run the console script and end the process."""
    start(_command)


def _command() -> int:
    from flows.cli.commands import app
    from robojackson.cli.app import run

    return run(app)


if __name__ == "__main__":
    main()
