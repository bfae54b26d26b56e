from __future__ import annotations

import asyncio
import json
import logging
from collections.abc import Awaitable, Callable, Iterator
from typing import Any

import httpx
import pytest
from starlette.requests import ClientDisconnect, Request
from starlette.responses import Response
from starlette.types import Message, Receive, Scope, Send

from service import logs
from service.api.metrics import Metrics
from service.api.observe import Observe
from service.api.problems import Problem
from service.api.routes import Routes
from service.stages import STAGES

TRACE = "4bf92f3577b34da6a3ce929d0e0e4736"
PARENT = "00f067aa0ba902b7"
App = Callable[[Scope, Receive, Send], Awaitable[None]]


class Told(logging.Handler):
    """The fields of the lines of the access log."""

    def __init__(self) -> None:
        super().__init__()
        self.lines: list[dict[str, Any]] = []
        self.addFilter(logs._identify)
        self.setFormatter(logs.Json())

    def emit(self, record: logging.LogRecord) -> None:
        self.lines.append(json.loads(self.format(record)))


@pytest.fixture
def told() -> Iterator[Told]:
    logger = logging.getLogger("service")
    handler, before = Told(), logger.level
    logger.setLevel("INFO")
    logger.addHandler(handler)
    yield handler
    logger.removeHandler(handler)
    logger.setLevel(before)


def _scope(path: str = "/edit", method: str = "POST", **headers: str) -> Scope:
    raw = [(name.replace("_", "-").encode(), text.encode()) for name, text in headers.items()]
    return {
        "type": "http", "method": method, "path": path, "query_string": b"key=secret",
        "headers": raw, "client": ("192.0.2.7", 5), "http_version": "1.1",
    }  # fmt: skip


def _call(
    app: App, scope: Scope, *messages: Message, metrics: Metrics | None = None
) -> list[Message]:
    """What the app sends when it is sent these messages, and waits where there is no more."""
    sent: list[Message] = []
    coming = iter(messages)

    async def receive() -> Message:
        for message in coming:
            return message
        await asyncio.Event().wait()
        raise AssertionError

    async def send(message: Message) -> None:
        sent.append(message)

    routes = Routes([])
    routes.__dict__["_templates"] = [("/edit", None), ("/livez", None)]
    asyncio.run(Observe(app, metrics or Metrics(), routes)(scope, receive, send))
    return sent


def _body(body: bytes, more: bool = False) -> Message:
    return {"type": "http.request", "body": body, "more_body": more}


LEFT: Message = {"type": "http.disconnect"}


async def _echo(scope: Scope, receive: Receive, send: Send) -> None:
    body = await Request(scope, receive).body()
    with scope["state"]["record"].measured("read"):
        pass
    logging.getLogger("service.test").info("at work")
    await Response(body + body)(scope, receive, send)


def _status(metrics: Metrics) -> dict[tuple[str, str, str], float]:
    return {
        (sample.labels["route"], sample.labels["method"], sample.labels["status"]): sample.value
        for family in metrics.registry.collect()
        for sample in family.samples
        if sample.name == "shape_parameters_request_duration_seconds_count"
    }


def _value(metrics: Metrics, name: str, **labels: str) -> float | None:
    return metrics.registry.get_sample_value(f"shape_parameters_{name}", labels)


def test_an_answer_names_its_ids_and_what_its_time_went_into() -> None:
    scope = _scope(traceparent=f"00-{TRACE}-{PARENT}-01", x_request_id="r-1")
    start, body = _call(_echo, scope, _body(b"ab", True), _body(b"c"))
    headers = dict(start["headers"])
    assert headers[b"trace-id"].decode() == TRACE
    assert headers[b"x-request-id"] == b"r-1"
    timing = headers[b"server-timing"].decode().split(", ")
    assert [entry.split(";dur=")[0] for entry in timing] == ["read", "total"]
    assert all(float(entry.split(";dur=")[1]) >= 0 for entry in timing)
    assert body["body"] == b"abcabc"
    assert scope["state"]["trace_id"] == TRACE


def test_a_request_is_measured() -> None:
    metrics = Metrics()
    _call(_echo, _scope(), _body(b"ab", True), _body(b"c"), metrics=metrics)
    assert _status(metrics) == {("/edit", "POST", "200"): 1}
    assert _value(metrics, "request_body_bytes_sum", route="/edit") == 3
    assert _value(metrics, "response_body_bytes_sum", route="/edit") == 6
    assert _value(metrics, "stage_duration_seconds_count", stage="read") == 1
    assert _value(metrics, "stage_duration_seconds_count", stage="write") == 0
    assert _value(metrics, "request_receive_seconds_count") == 1
    assert _value(metrics, "open_requests") == 0


def test_a_head_has_no_body() -> None:
    metrics = Metrics()
    _call(_echo, _scope(method="HEAD"), _body(b"a"), metrics=metrics)
    assert _value(metrics, "response_body_bytes_sum", route="/edit") == 0


def test_a_request_has_one_line_with_all_that_is_known(told: Told) -> None:
    async def refuse(scope: Scope, receive: Receive, send: Send) -> None:
        scope["state"]["owner"] = "studio"
        await Problem(404, "mesh_id_unknown", "d", "s", "t")(scope, receive, send)

    scope = _scope("/meshes/a\r\nb", "GET", x_request_id="r-1", user_agent="curl/8\x1b[1m" * 40)
    _call(refuse, scope, _body(b""))
    (line,) = told.lines
    assert line["logger"] == "service.access"
    assert line["message"].startswith("GET /meshes/a\\x0d\\x0ab 404 mesh_id_unknown in ")
    assert line["path"] == "/meshes/a\\x0d\\x0ab"
    assert (line["method"], line["route"], line["status"]) == ("GET", "unmatched", 404)
    assert (line["code"], line["owner"], line["client"]) == (
        "mesh_id_unknown",
        "studio",
        "192.0.2.7",
    )
    assert line["request_id"] == "r-1"
    assert line["response_bytes"] > 0
    assert line["duration_seconds"] >= 0
    assert len(line["user_agent"]) < 200
    assert "secret" not in json.dumps(line)


def test_lines_of_the_work_carry_its_ids(told: Told) -> None:
    _call(_echo, _scope(x_request_id="r-1"), _body(b"a"))
    work, access = told.lines
    assert (work["logger"], work["request_id"]) == ("service.test", "r-1")
    assert work["trace_id"] == access["trace_id"]
    assert access["stage_seconds"].keys() == {"read"}
    assert access["receive_seconds"] <= access["duration_seconds"]


def test_probes_are_lines_for_debugging_only(told: Told) -> None:
    _call(_echo, _scope("/livez", "GET"), _body(b""))
    assert [line["logger"] for line in told.lines] == ["service.test"]
    logging.getLogger("service").setLevel("DEBUG")
    _call(_echo, _scope("/livez", "GET"), _body(b""))
    assert told.lines[-1]["route"] == "/livez"


def test_a_long_path_is_cut(told: Told) -> None:
    _call(_echo, _scope("/" + "a" * 100_000), _body(b""))
    assert len(json.dumps(told.lines[-1])) < 2000


def test_who_leaves_while_sending_is_no_failure(told: Told) -> None:
    async def careful(scope: Scope, receive: Receive, send: Send) -> None:
        try:
            await Request(scope, receive).body()
        except ClientDisconnect:
            # As the framework does: an answer to nobody.
            await Response(status_code=400)(scope, receive, send)

    metrics = Metrics()
    _call(careful, _scope(), _body(b"abc", True), LEFT, metrics=metrics)
    assert _status(metrics) == {("/edit", "POST", "499"): 1}
    assert _value(metrics, "request_receive_seconds_count") == 0
    assert told.lines[-1]["status"] == 499


@pytest.mark.parametrize("error", [RuntimeError("bad"), asyncio.CancelledError()])
@pytest.mark.parametrize("amid", [False, True])
def test_what_fails_is_counted_and_leaves_no_gauge_up(
    told: Told, error: BaseException, amid: bool
) -> None:
    async def fail(scope: Scope, receive: Receive, send: Send) -> None:
        if amid:
            await send({"type": "http.response.start", "status": 200, "headers": []})
        raise error

    metrics = Metrics()
    with pytest.raises(type(error)):
        _call(fail, _scope(), _body(b""), metrics=metrics)
    assert _status(metrics) == {("/edit", "POST", "500"): 1}
    assert _value(metrics, "open_requests") == 0
    assert told.lines[-1]["status"] == 500


def test_what_is_open_is_counted() -> None:
    metrics = Metrics()
    seen = []

    async def look(scope: Scope, receive: Receive, send: Send) -> None:
        seen.append(_value(metrics, "open_requests"))
        await Response()(scope, receive, send)

    _call(look, _scope(), _body(b""), metrics=metrics)
    assert seen == [1]
    assert _value(metrics, "open_requests") == 0


def test_no_client_makes_labels() -> None:
    metrics = Metrics()
    for number in range(200):
        scope = _scope(f"/{number}" + "/é\n" * (number % 7), f"METHOD{number}")
        _call(_echo, scope, _body(b""), metrics=metrics)
    assert _status(metrics) == {("unmatched", "other", "200"): 200}
    before = sum(len(family.samples) for family in metrics.registry.collect())
    _call(_echo, _scope("/more", "MORE"), _body(b""), metrics=metrics)
    assert sum(len(family.samples) for family in metrics.registry.collect()) == before


def test_what_is_no_request_passes() -> None:
    seen = []

    async def lifespan(scope: Scope, receive: Receive, send: Send) -> None:
        seen.append(scope)

    _call(lifespan, {"type": "lifespan"})
    assert seen == [{"type": "lifespan"}]


def test_every_answer_of_the_service_names_its_ids(client: httpx.Client) -> None:
    headers = {"traceparent": f"00-{TRACE}-{PARENT}-01", "X-Request-Id": "r-1"}
    for path in ("/livez", "/readyz", "/nowhere", "/openapi.json", "/metrics"):
        answer = client.get(path, headers=headers)
        assert answer.headers["trace-id"] == TRACE
        assert answer.headers["x-request-id"] == "r-1"
        assert answer.headers["server-timing"].startswith("total;dur=")


def test_work_in_other_threads_is_of_its_request(
    client: httpx.Client, pretend: Any, told: Told
) -> None:
    pretend.work = lambda: logging.getLogger("service.test").info("at work")
    answer = client.post("/infer", files={"mesh": ("private.obj", b"abc")})
    assert answer.status_code == 200
    work = next(line for line in told.lines if line["logger"] == "service.test")
    assert work["trace_id"] == answer.headers["trace-id"]
    assert work["request_id"] == answer.headers["x-request-id"]
    assert "private" not in json.dumps(told.lines)


def test_an_edit_is_timed_by_stage(service_client: httpx.Client, box_chair: Any) -> None:
    # A mesh that no other test sends: what was inferred of one is kept.
    mesh = b"# of the stages\n" + box_chair.export(file_type="obj").encode()
    edits = {"edits": '{"seat_width": {"scale": 1.1}}', "category": "chair"}
    answer = service_client.post("/edit", files={"mesh": ("a.obj", mesh)}, data=edits)
    assert answer.status_code == 200, answer.text
    entries = [entry.split(";dur=") for entry in answer.headers["server-timing"].split(", ")]
    told = {name: float(duration) for name, duration in entries}
    assert list(told) == [*STAGES, "total"]
    assert sum(told[stage] for stage in STAGES) <= told["total"] + 0.1 * len(STAGES)
    again = service_client.post("/edit", files={"mesh": ("a.obj", mesh)}, data=edits)
    assert "encode" not in again.headers["server-timing"]
