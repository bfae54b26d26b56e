from __future__ import annotations

import base64

import httpx
import pytest
from client_app import Script, alive

from service.client import ShapeClient

KEPT = "http://me:hush-hush@shapes.test"


def test_a_key_and_credentials_in_the_url_are_refused_without_telling_them() -> None:
    with pytest.raises(ValueError, match="only one of them can be sent") as caught:
        ShapeClient(KEPT, api_key="another")
    assert "hush" not in str(caught.value)
    assert "another" not in str(caught.value)


def test_the_environments_key_counts_too(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SHAPE_API_KEY", "another")
    with pytest.raises(ValueError, match="leave the other out"):
        ShapeClient(KEPT)
    ShapeClient(KEPT, api_key="").close()


def test_credentials_alone_are_sent_and_not_shown() -> None:
    script = Script(alive(), httpx.Response(307))
    with ShapeClient(KEPT, transport=httpx.MockTransport(script)) as client:
        client.alive()
        with pytest.raises(Exception, match="redirect") as caught:
            client.alive()
    (request, _) = script.requests
    sent = base64.b64encode(b"me:hush-hush").decode()
    assert request.headers["authorization"] == f"Basic {sent}"
    assert request.headers["host"] == "shapes.test"
    assert "hush" not in repr(client) + str(caught.value)


@pytest.mark.parametrize(
    ("url", "said"),
    [
        ("shapes.test", "does not begin with http"),
        ("ftp://me:hush@shapes.test", "does not begin with http"),
        ("http://", "does not begin with http"),
        ("http://shapes.test:port", "is none"),
        ("http://shapes.test?token=hush", "ends with its path"),
        ("http://shapes.test#hush", "ends with its path"),
    ],
)
def test_what_is_no_url_of_a_service_is_refused(url: str, said: str) -> None:
    with pytest.raises(ValueError, match=said) as caught:
        ShapeClient(url)
    assert "hush" not in str(caught.value)


def test_a_service_may_lie_under_a_path() -> None:
    script = Script(alive())
    with ShapeClient("http://proxy.test/shapes/", transport=httpx.MockTransport(script)) as client:
        client.alive()
    assert str(script.requests[0].url) == "http://proxy.test/shapes/livez"


@pytest.mark.parametrize("key", ["a b", "ä", "a\nb"])
def test_what_is_no_key_is_refused(key: str) -> None:
    with pytest.raises(ValueError, match="characters that none has"):
        ShapeClient(api_key=key)


def test_what_can_not_be_sent_is_a_wrong_argument(service_client: httpx.Client) -> None:
    with pytest.raises(ValueError, match="Illegal header value"):
        ShapeClient(http=service_client).post("/livez", headers={"x": "a\nb"}, method="GET")
    script = Script(httpx.LocalProtocolError("broken"))
    with pytest.raises(ValueError, match=r"GET http://shapes\.test/livez: broken"):
        script.client().alive()
    assert script.slept == []
