"""Requests that no honest client sends: each is answered with a problem, and none with a 500."""

from __future__ import annotations

import socket
from typing import Any

import httpx
import pytest

from service.api.form_limits import FIELD_BYTES, FIELDS

MESH = ("chair.obj", b"abc", "model/obj")
FORM = "multipart/form-data; boundary=xx"


def part(head: str, content: bytes = b"abc") -> bytes:
    return b"--xx\r\n" + head.encode("latin-1") + b"\r\n\r\n" + content + b"\r\n"


def body(*parts: bytes) -> bytes:
    return b"".join(parts) + b"--xx--\r\n"


def post(client: httpx.Client, content: bytes, kind: str = FORM) -> httpx.Response:
    return client.post("/infer", content=content, headers={"content-type": kind})


NAMED = 'Content-Disposition: form-data; name="mesh"; filename="{}"'


@pytest.mark.parametrize("count", [FIELDS + 1, 3000])
def test_more_fields_than_a_form_has(client: httpx.Client, problem: Any, count: int) -> None:
    fields = {f"f{number}": "x" for number in range(count)}
    for files in ({"mesh": MESH}, None):
        document = problem(client.post("/infer", files=files, data=fields), 400, "fields_too_many")
        assert str(FIELDS) in document.detail


def test_an_unknown_field_is_named_as_long_as_there_are_few(
    client: httpx.Client, problem: Any
) -> None:
    fields = {f"f{number}": "x" for number in range(FIELDS)}
    problem(client.post("/infer", files={"mesh": MESH}, data=fields), 422, "unknown_field")


@pytest.mark.parametrize("count", [3, 1500])
def test_more_files_than_a_form_has(client: httpx.Client, problem: Any, count: int) -> None:
    files = [(f"f{number}", MESH) for number in range(count)]
    problem(client.post("/infer", files=files), 400, "files_too_many")


def test_a_field_that_is_too_long(client: httpx.Client, problem: Any) -> None:
    for size in (FIELD_BYTES + 1, 3_000_000):
        for files in ({"mesh": MESH}, None):
            response = client.post("/edit", files=files, data={"edits": " " * size})
            problem(response, 413, "field_too_large")
    longest = {"edits": "{}" + " " * (FIELD_BYTES - 2)}
    assert client.post("/edit", files={"mesh": MESH}, data=longest).status_code == 200


def test_a_name_of_a_field_of_a_megabyte(client: httpx.Client) -> None:
    response = post(client, body(part(f'Content-Disposition: form-data; name="{"n" * 1_000_000}"')))
    assert response.status_code in (400, 422)
    assert len(response.content) < 2000


def test_headers_of_a_part_without_end(client: httpx.Client, problem: Any) -> None:
    many = "\r\n".join(f"X-{number}: y" for number in range(5000))
    response = post(client, body(part(NAMED.format("a.obj") + "\r\n" + many)))
    problem(response, 400, "body_malformed")
    long = NAMED.format("a.obj") + "\r\nX-Long: " + "y" * 1_000_000
    problem(post(client, body(part(long))), 400, "body_malformed")


@pytest.mark.parametrize(
    "edits",
    [
        "[" * 100_000,
        '{"a":' * 50_000,
        '{"seat_width":{"set":' + "[" * 900 + "]" * 900 + "}}",
        '{"seat_width": 0.5, "seat_width": 0.6}',
        '{"seat_width": {"set": 1, "set": 2}}',
        '{"seat_width": NaN}',
        '{"seat_width": {"add": -Infinity}}',
        '{"seat_width": 1e400}',
        '{"seat_width": ' + "9" * 5000 + "}",
        '{"seat_width": ' + "9" * 400 + "}",
        '{"seat_width": {' + ",".join(f'"{n}":1' for n in range(20_000)) + "}}",
        '{"seat_width": "\\ud800"}',
        '{"seat_width": {"\\ud800": 1}}',
        '{"\\ud800": {"grow": 1}}',
        '{"seat_width": {}}',
        "\ufeff{}",
        "",
        "\0",
    ],
    ids=lambda text: repr(text[:24]),
)
def test_edits_in_odd_json(client: httpx.Client, problem: Any, pretend: Any, edits: str) -> None:
    response = client.post("/edit", files={"mesh": MESH}, data={"edits": edits})
    document = problem(response, 422, response.json()["code"])
    assert len(response.content) < 2000
    assert not pretend.calls
    assert document.detail.isprintable()


def test_thousands_of_unknown_parameters(
    service_client: httpx.Client, problem: Any, chair_glb: bytes
) -> None:
    edits = "{" + ",".join(f'"p{number}":1' for number in range(20_000)) + "}"
    data = {"edits": edits, "up": "+y", "front": "+z", "refine": "false"}
    files = {"mesh": ("chair.glb", chair_glb)}
    response = service_client.post("/edit", files=files, data=data)
    problem(response, 422, "unknown_parameter")
    assert len(response.content) < 2000


@pytest.mark.parametrize(
    "name",
    [
        "../../../etc/passwd.obj",
        "a\\..\\b.obj",
        "nul\x01\x7f.obj",
        "\u202ejbo.glb.obj",
        "e\u0301" * 400 + ".obj",
        "\U0001f4ba.obj",
        ".obj",
        "obj",
        "x" * 2000 + ".obj",
        "a.obj.",
        'a";filename="b.glb',
        "%00.obj",
        "=?utf-8?q?a?=.obj",
    ],
)
def test_odd_file_names(client: httpx.Client, name: str) -> None:
    data = {"edits": '{"seat_width": 0.5}'}
    response = client.post("/edit", files={"mesh": (name, b"abc")}, data=data)
    assert response.status_code == 200
    disposition = response.headers["content-disposition"]
    assert disposition.isascii()
    assert len(disposition) < 2000
    assert "/" not in disposition.replace("UTF-8''", "")
    assert "\\" not in disposition


@pytest.mark.parametrize("charset", ["undefined", "idna", "utf-7", "utf-16", "zlib", "no-such"])
@pytest.mark.parametrize("name", ["+2AA-.obj", "\xff\xfe.obj", "xn--a.obj"])
def test_odd_charsets(client: httpx.Client, charset: str, name: str) -> None:
    """Half a surrogate pair in UTF-7, codecs that always fail, codecs that are none."""
    content = body(
        part(NAMED.format(name)),
        part('Content-Disposition: form-data; name="edits"', b'{"seat_width": 0.5}'),
    )
    kind = f"multipart/form-data; charset={charset}; boundary=xx"
    response = client.post("/edit", content=content, headers={"content-type": kind})
    assert response.status_code in (200, 400, 422), response.text
    assert response.headers.get("content-disposition", "").isascii()


@pytest.mark.parametrize(
    ("head", "code"),
    [
        ('Content-Disposition: form-data; name="mesh"', "field_invalid"),
        ('Content-Disposition: form-data; name="mesh"; filename=""', "mesh_missing"),
        ('Content-Disposition: form-data; name=""; filename="a.obj"', "unknown_field"),
        ('Content-Disposition: form-data; name="Mesh"; filename="a.obj"', "unknown_field"),
        ('Content-Disposition: form-data; name="mesh\0"; filename="a.obj"', "unknown_field"),
        ('Content-Disposition: attachment; name="mesh"; filename="a.obj"', ""),
        ("Content-Type: model/obj", "body_malformed"),
        ("nonsense", "body_malformed"),
    ],
)
def test_odd_parts(client: httpx.Client, head: str, code: str) -> None:
    response = post(client, body(part(head, b"" if 'filename=""' in head else b"abc")))
    if code:
        assert (response.is_client_error, response.json()["code"]) == (True, code)
    else:
        assert response.status_code == 200


def test_a_part_of_any_type_is_the_mesh(client: httpx.Client) -> None:
    for kind in ("text/html", "multipart/mixed; boundary=yy", "x" * 3000, "application/json"):
        head = NAMED.format("a.obj") + f"\r\nContent-Type: {kind}"
        assert post(client, body(part(head))).status_code == 200


@pytest.mark.parametrize("name", ["a.glb", "a.gltf", "a.obj", "a.ply", "a.stl", "a.off", "a"])
def test_an_empty_file(service_client: httpx.Client, name: str) -> None:
    response = service_client.post("/infer", files={"mesh": (name, b"")})
    assert response.status_code in (415, 422)
    assert response.headers["content-type"] == "application/problem+json"


@pytest.mark.parametrize("fields", [{"mesh_id": "sha256-" + "x" * 9000}, {"mesh_id": "\U0001f600"}])
def test_odd_ids(client: httpx.Client, problem: Any, fields: dict[str, str]) -> None:
    response = client.post("/infer", data=fields)
    problem(response, 404, "mesh_id_unknown")
    assert len(response.content) < 1000


def raw(client: httpx.Client, content: bytes) -> bytes:
    """What comes back for bytes on a connection that then sends no more."""
    address = (client.base_url.host, client.base_url.port)
    with socket.create_connection(address, timeout=10) as connection:
        connection.sendall(content)
        connection.shutdown(socket.SHUT_WR)
        answer = b""
        while piece := connection.recv(65536):
            answer += piece
    return answer


HEAD = b"POST /infer HTTP/1.1\r\nHost: x\r\nContent-Type: " + FORM.encode() + b"\r\n"


@pytest.mark.parametrize(
    ("content", "status"),
    [
        (HEAD + b"Content-Length: -1\r\n\r\n", b" 400 "),
        (HEAD + b"Content-Length: 12abc\r\n\r\n", b" 400 "),
        (HEAD + b"Content-Length: " + b"9" * 5000 + b"\r\n\r\n", b" 4"),
        (HEAD + b"Content-Length: 5\r\nContent-Length: 6\r\n\r\nabcdef", b" 400 "),
        (HEAD + b"Transfer-Encoding: chunked\r\n\r\nzz\r\n", b" 400 "),
        (HEAD + b"Transfer-Encoding: chunked\r\n\r\nffffffffffffffffff\r\nabc", b" 4"),
        (b"\0\1\2\3\r\n\r\n", b" 400 "),
    ],
)
def test_lies_on_the_wire(client: httpx.Client, content: bytes, status: bytes) -> None:
    assert status in raw(client, content).partition(b"\r\n")[0]
    assert client.get("/livez").status_code == 200


def test_a_body_that_never_ends_is_let_go(client: httpx.Client) -> None:
    """The client promises more than it sends and hangs up."""
    answer = raw(client, HEAD + b"Content-Length: 1000\r\n\r\n--xx\r\n")
    assert b" 500 " not in answer
    assert client.get("/livez").status_code == 200


def test_a_chunked_body_is_read(client: httpx.Client, pretend: Any) -> None:
    content = body(part(NAMED.format("a.obj")))
    response = client.post(
        "/infer", content=(content[at : at + 7] for at in range(0, len(content), 7)),
        headers={"content-type": FORM},
    )  # fmt: skip
    assert response.status_code == 200
    assert pretend.calls[0]["upload"].data == b"abc"
