"""`shape-edit serve`."""

from __future__ import annotations

import click


@click.command()
@click.option("--host", metavar="ADDRESS", help="To listen on; 0.0.0.0 is every interface. [HOST]")
@click.option("--port", metavar="NUMBER", help="To listen on; 0 takes a free one. [PORT]")
def serve(host: str | None, port: str | None) -> None:
    """Serve over HTTP until Ctrl-C or SIGTERM: the same as `python -m service`.

    Everything else is a setting in the environment, such as API_KEYS, WORKERS or STORE_DIR;
    docs/deploy.md has all of them.

    \b
    Examples:
      shape-edit serve
      shape-edit serve --host 0.0.0.0 --port 9000
      WORKERS=4 LOG_FORMAT=text shape-edit serve
    """
    from service.__main__ import main

    given = [("--host", host), ("--port", port)]
    options = [text for option, value in given if value is not None for text in (option, value)]
    raise click.exceptions.Exit(main(options, "shape-edit serve"))
