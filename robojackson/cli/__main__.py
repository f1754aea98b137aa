"""`python -m robojackson.cli`: the commands of one stage, as child processes run them."""

from robojackson.cli.start import start


def _command() -> int:
    from robojackson.cli.app import add_stages, make_app, run

    app = make_app()
    add_stages(app)
    return run(app)


if __name__ == "__main__":
    start(_command)
