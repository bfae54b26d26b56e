from __future__ import annotations

import gzip
import json
import re
from contextlib import closing
from http.client import HTTPConnection
from pathlib import PurePosixPath

import httpx
import pytest

from service.api.viewer import FOLDER, MEDIA_TYPES, pages


def test_the_page_answers_at_the_root(client: httpx.Client) -> None:
    response = client.get("/")
    assert response.status_code == 200
    assert response.headers["content-type"] == "text/html; charset=utf-8"
    assert "<h1" in response.text
    assert 'href="docs"' in response.text
    head = client.head("/")
    assert (head.status_code, head.content) == (200, b"")


def test_only_the_pages_own_scripts_run(client: httpx.Client) -> None:
    response = client.get("/")
    policy = response.headers["content-security-policy"]
    assert "default-src 'none'" in policy
    assert "unsafe" not in policy
    inline = re.findall(r"<script(?![^>]*\bsrc=)[^>]*>", response.text)
    assert inline == ['<script type="importmap">']
    assert re.search(r"script-src 'self' 'sha256-[\w+/]{43}='", policy)
    assert " style=" not in response.text
    assert not re.search(r"\son\w+=", response.text)


def test_nothing_is_loaded_from_elsewhere() -> None:
    for name, page in pages().items():
        if PurePosixPath(name).suffix in (".html", ".css", ".js") and "vendor" not in name:
            text = page.plain.decode().replace("http://www.w3.org/", "")
            assert "//" not in re.sub(r"(?<!:)//.*", "", text), name


def test_every_file_that_is_named_is_there(client: httpx.Client) -> None:
    html = client.get("/").text
    named = set(re.findall(r'(?:src|href)="\.?/?(web/[^"#]+)', html))
    named |= set(re.findall(r'"\./(web/vendor/[^"]+)"', html))
    for name, page in pages().items():
        if name.startswith("js/"):
            text = page.plain.decode()
            named |= {f"web/js/{module}" for module in re.findall(r'from "\./([^"]+)"', text)}
    assert len(named) > 20
    named |= set(re.findall(r'(?:src|href)="(web/[^"#]+)', client.get("/docs").text))
    for path in named:
        assert client.get(f"/{path}").status_code == 200, path


def test_the_documentation_is_the_services_own(client: httpx.Client) -> None:
    response = client.get("/docs")
    assert response.status_code == 200
    assert "//" not in response.text.replace("<!doctype html>", "")
    policy = response.headers["content-security-policy"]
    assert "script-src 'self' ;" in policy
    assert "connect-src 'self'" in policy
    assert client.get("/redoc").status_code == 404


@pytest.mark.parametrize(
    "path",
    [
        "/web/",
        "/web/nothing.js",
        "/web/../main.py",
        "/web/..%2fmain.py",
        "/web/%2e%2e/main.py",
        "/web/js/..%5c..%5cmain.py",
        "/web//etc/passwd",
        "/web/vendor",
        "/web/vendor/VERSIONS.md",
    ],
)
def test_what_is_not_listed_is_not_found(client: httpx.Client, path: str) -> None:
    # By what sends paths as they stand; most clients tidy them up.
    connection = HTTPConnection(client.base_url.host, client.base_url.port, timeout=10)
    with closing(connection):
        connection.request("GET", path)
        response = connection.getresponse()
        assert (response.status, json.load(response)["code"]) == (404, "not_found")


def test_what_is_held_is_not_sent_again(client: httpx.Client) -> None:
    first = client.get("/web/js/app.js")
    tag = first.headers["etag"]
    assert first.headers["cache-control"] == "no-cache"
    again = client.get("/web/js/app.js", headers={"If-None-Match": f'"other", W/{tag}'})
    assert (again.status_code, again.content) == (304, b"")
    assert again.headers["etag"] == tag
    changed = client.get("/web/js/app.js", headers={"If-None-Match": '"other"'})
    assert changed.status_code == 200


def test_vendored_files_are_kept_for_good(client: httpx.Client) -> None:
    vendored = [name for name in pages() if name.startswith("vendor/")]
    assert vendored
    for name in vendored:
        assert re.search(r"-\d+\.\d+\.\d+/", name), "its folder carries no version"
        response = client.get(f"/web/{name}")
        assert "immutable" in response.headers["cache-control"]


def test_files_are_packed_for_those_who_take_it(client: httpx.Client) -> None:
    path = "/web/css/panel.css"
    plain = client.get(path, headers={"Accept-Encoding": "identity"})
    refused = client.get(path, headers={"Accept-Encoding": "br, gzip;q=0"})
    packed = client.get(path, headers={"Accept-Encoding": "br, gzip"})
    assert "content-encoding" not in plain.headers
    assert "content-encoding" not in refused.headers
    assert packed.headers["content-encoding"] == "gzip"
    assert packed.content == plain.content
    assert packed.headers["etag"] != plain.headers["etag"]
    assert {plain.headers["vary"], packed.headers["vary"]} == {"Accept-Encoding"}
    assert gzip.decompress(pages()["css/panel.css"].packed or b"") == plain.content


def test_what_is_vendored_is_named_with_its_licence() -> None:
    notes = (FOLDER / "vendor" / "VERSIONS.md").read_text()
    for folder in (FOLDER / "vendor").iterdir():
        if folder.is_dir():
            assert folder.name in notes
            assert re.search("MIT|Apache License", (folder / "LICENSE").read_text())


def test_the_samples_are_small() -> None:
    samples = sorted(FOLDER.glob("samples/*.glb"))
    assert [path.stem for path in samples] == ["airplane", "chair", "human"]
    assert all(path.stat().st_size < 400_000 for path in samples)


def test_all_files_of_the_folder_are_of_a_kind_that_is_known() -> None:
    known = {*MEDIA_TYPES, ".md", ".txt", ""}
    assert all(path.suffix in known for path in FOLDER.rglob("*") if path.is_file())
