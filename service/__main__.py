"""`python -m service`: serve over HTTP."""

from __future__ import annotations

import argparse
import logging
import sys
from collections.abc import Sequence

import uvicorn
from pydantic import ValidationError

from service.main import create_app
from service.settings import Settings


def main(arguments: Sequence[str] | None = None) -> int:
    """Serve until interrupted; the exit status is 2 when a setting makes no sense."""
    parser = argparse.ArgumentParser(prog="python -m service", description=__doc__)
    parser.add_argument("--host", help="address to listen on (HOST, 127.0.0.1)")
    parser.add_argument("--port", help="port to listen on (PORT, 8000)")
    given = {name: value for name, value in vars(parser.parse_args(arguments)).items() if value}
    try:
        settings = Settings(**given)
    except ValidationError as error:
        for line in error.errors():
            name = str(line["loc"][0]).upper()
            print(f"{parser.prog}: {name}={line['input']!r}: {line['msg']}", file=sys.stderr)
        return 2
    configure_logging(settings.log_level)
    # log_config=None: uvicorn's lines go through the root logger, like all others.
    uvicorn.run(
        create_app(settings),
        host=settings.host,
        port=settings.port,
        log_config=None,
        server_header=False,
    )
    return 0


def configure_logging(level: str) -> None:
    """One plain line an event, on standard error."""
    logging.basicConfig(
        level=level.upper(), format="%(asctime)s %(levelname)s %(name)s: %(message)s"
    )
    # It warns of each malformed body, which the client is told of.
    logging.getLogger("python_multipart").setLevel(logging.ERROR)


if __name__ == "__main__":
    sys.exit(main())
