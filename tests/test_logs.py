from __future__ import annotations

import contextvars
import io
import json
import logging
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from datetime import datetime
from typing import Any

import pytest

from service import logs

IDENTITY = logs.Identity("4bf92f3577b34da6a3ce929d0e0e4736", "r-1", "00f067aa0ba902b7")
Logged = Callable[[logging.Formatter], tuple[logging.Logger, Callable[[], str]]]


@pytest.fixture
def logged() -> Iterator[Logged]:
    """Makes a logger of its own with a formatter, and what it has written."""
    logger = logging.getLogger("test.logs")
    logger.propagate = False
    logger.setLevel("DEBUG")

    def make(formatter: logging.Formatter) -> tuple[logging.Logger, Callable[[], str]]:
        stream = io.StringIO()
        handler = logging.StreamHandler(stream)
        handler.addFilter(logs._identify)
        handler.setFormatter(formatter)
        logger.handlers = [handler]
        return logger, stream.getvalue

    yield make
    logger.handlers = []


def test_a_line_is_an_object_with_its_time_in_utc(logged: Logged) -> None:
    logger, text = logged(logs.Json())
    logger.warning("so %d", 3, extra={logs.FIELDS: {"route": "/edit", "status": 200}})
    line = json.loads(text())
    stamp = datetime.fromisoformat(line.pop("timestamp"))
    assert stamp.utcoffset() is not None
    assert abs(stamp.timestamp() - datetime.now().timestamp()) < 60
    assert line == {
        "level": "warning", "logger": "test.logs", "message": "so 3", "route": "/edit",
        "status": 200,
    }  # fmt: skip


def test_lines_of_a_request_carry_its_ids_from_other_threads_too(logged: Logged) -> None:
    logger, text = logged(logs.Json())
    with logs.about(IDENTITY):
        logger.info("here")
        context = contextvars.copy_context()
        thread = threading.Thread(target=context.run, args=(logger.info, "there"))
        thread.start()
        thread.join()
    logger.info("after")
    here, there, after = (json.loads(line) for line in text().splitlines())
    for line in (here, there):
        assert line["trace_id"] == IDENTITY.trace_id
        assert line["request_id"] == "r-1"
        assert line["span_id"] == IDENTITY.span_id
    assert not {"trace_id", "request_id", "span_id"} & set(after)


@pytest.mark.parametrize("formatter", [logs.Json(), logs.Text()])
def test_no_text_forges_a_line_or_reaches_the_terminal(
    logged: Logged, formatter: logging.Formatter
) -> None:
    logger, text = logged(formatter)
    forged = "a\r\n2026-01-01T00:00:00.000Z INFO service: \x1b[31mforged\x85\u2028\x7f"
    logger.info("sent %s", forged)
    assert text().count("\n") == 1
    assert text().isprintable() or text()[:-1].isprintable()
    assert "\x1b" not in text()


@pytest.mark.parametrize("formatter", [logs.Json(), logs.Text()])
def test_a_traceback_belongs_to_its_line(logged: Logged, formatter: logging.Formatter) -> None:
    logger, text = logged(formatter)
    try:
        raise RuntimeError("bad\n2026-01-01T00:00:00.000Z INFO service: forged")
    except RuntimeError:
        logger.exception("it failed")
    if isinstance(formatter, logs.Json):
        (line,) = text().splitlines()
        assert "RuntimeError: bad" in json.loads(line)["exception"]
    else:
        first, *rest = text().splitlines()
        assert first.endswith("test.logs: it failed")
        assert rest
        assert all(row.startswith("    ") for row in rest)


@pytest.mark.parametrize("formatter", [logs.Json(), logs.Text()])
def test_what_is_long_is_cut(logged: Logged, formatter: logging.Formatter) -> None:
    logger, text = logged(formatter)
    try:
        raise RuntimeError("x" * 100_000 + "the end")
    except RuntimeError:
        logger.exception("y" * 100_000)
    assert len(text()) < 3 * logs.LONGEST
    assert "the end" in text()


def test_plain_text_is_as_it_was() -> None:
    assert logs.plain("/meshes/stühle") == "/meshes/stühle"
    assert logs.plain("a" * 20, 10) == "aaaaaaa..."
    assert logs.plain("a\n\x9b") == "a\\x0a\\x9b"


def _written(form: str) -> str:
    code = (
        "import logging, warnings; from service import logs;"
        f"logs.configure('info', {form!r}); logging.getLogger('a').info('told');"
        "logging.getLogger('a').debug('not told'); warnings.warn('beware')"
    )
    return subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    ).stderr


def test_standard_error_has_json_where_it_is_no_terminal() -> None:
    lines: list[dict[str, Any]] = [json.loads(line) for line in _written("auto").splitlines()]
    assert [line["logger"] for line in lines] == ["a", "py.warnings"]
    assert "beware" in lines[1]["message"]


def test_text_is_written_where_it_is_asked_for() -> None:
    assert "INFO a: told" in _written("text")


def test_a_terminal_has_text() -> None:
    class Terminal(io.StringIO):
        def isatty(self) -> bool:
            return True

    root = logging.getLogger()
    before = root.handlers[:], root.level
    root.handlers = []
    stream = Terminal()
    try:
        logs.configure("warning", "auto", stream)
        logging.getLogger("a").warning("told")
    finally:
        logging.captureWarnings(False)
        root.handlers, root.level = before[0], before[1]
    assert "WARNING a: told" in stream.getvalue()
