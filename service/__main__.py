"""`python -m service`: serve over HTTP."""

from __future__ import annotations

import argparse
import logging
import os
import sys
from collections.abc import Sequence

from pydantic import ValidationError

from service import logs, malloc
from service.api import tracing
from service.api.keys import KeysFault
from service.main import create_app
from service.server import Config, Server, listen
from service.settings import Settings
from service.store.fault import StoreFault


def main(arguments: Sequence[str] | None = None, program: str = "python -m service") -> int:
    """Serve until SIGTERM or SIGINT, as the ``program`` of that name.

    The exit status is 0 when all requests were answered before the end, else 1; 1 when the port
    can't be had, and 2 when a setting makes no sense.
    """
    malloc.settle()
    parser = argparse.ArgumentParser(prog=program, description=__doc__)
    parser.add_argument("--host", help="address to listen on (HOST, 127.0.0.1)")
    parser.add_argument("--port", help="port to listen on (PORT, 8000)")
    given = {name: value for name, value in vars(parser.parse_args(arguments)).items() if value}
    try:
        settings = Settings(**given)
        logs.configure(settings.log_level, settings.log_format)
        tracing.set_defaults()
        app = create_app(settings)
    except ValidationError as error:
        for line in error.errors():
            name = str(line["loc"][0]).upper()
            print(f"{parser.prog}: {name}={line['input']!r}: {line['msg']}", file=sys.stderr)
        return 2
    except (KeysFault, StoreFault) as fault:
        print(f"{parser.prog}: {fault}", file=sys.stderr)
        return 2
    try:
        listeners = listen(settings.host, settings.port)
    except OSError as error:
        where = f"{settings.host}:{settings.port}"
        print(f"{parser.prog}: can't listen on {where} (HOST, PORT): {error}", file=sys.stderr)
        return 1
    # Threads that work give the event loop its turn after 1 ms rather than 5: an answer to a probe
    # takes some six turns.
    sys.setswitchinterval(0.001)
    server = Server(Config(app, settings), app.state.context)
    server.run(listeners)
    if not server.complete:
        # Threads that nobody waits for any more would hold the exit up.
        logging.shutdown()
        os._exit(1)
    return 0


if __name__ == "__main__":
    sys.exit(main())
