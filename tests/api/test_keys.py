from __future__ import annotations

import hmac
import logging
from hmac import compare_digest
from pathlib import Path

import pytest

from service.api.keys import Entry, Keys, KeysFault, digest_of, new_key


def entry(owner: str, key: str) -> str:
    return str(Entry(owner, digest_of(key)))


def test_without_entries_no_key_is_wanted() -> None:
    for text in ("", " \n", ",,"):
        keys = Keys(text)
        assert not keys.wanted
        assert keys.owner(new_key()) is None


def test_each_key_is_its_owners() -> None:
    keys = Keys(f"ann:{digest_of('one')}, bob:{digest_of('two').upper()}\n\n{entry('ann', 'old')}")
    assert keys.wanted
    assert keys.owners == ["ann", "bob"]
    assert [keys.owner(key) for key in ("one", "two", "old")] == ["ann", "bob", "ann"]
    for other in ("", "three", "One", digest_of("one"), "ann", "\xff\u20ac"):
        assert keys.owner(other) is None


def test_a_key_is_random_and_known_by_its_prefix() -> None:
    made = {new_key() for _ in range(100)}
    assert len(made) == 100
    # 43 characters of base 64 hold 256 bits.
    assert {(key[:3], len(key)) for key in made} == {("sp_", 46)}


def test_every_entry_is_compared_in_constant_time(monkeypatch: pytest.MonkeyPatch) -> None:
    compared: list[bool] = []

    def compare(one: str, other: str) -> bool:
        compared.append(compare_digest(one, other))
        return compared[-1]

    keys = Keys(",".join(entry(f"o{number}", f"k{number}") for number in range(5)))
    monkeypatch.setattr(hmac, "compare_digest", compare)
    assert keys.owner("k1") == "o1"
    assert compared == [False, True, False, False, False]


def test_a_file_of_keys(tmp_path: Path) -> None:
    file = tmp_path / "keys"
    file.write_text(
        f"# who may call\n\n  {entry('ann', 'one')}   # since May\n{entry('bob', 'two')}"
    )
    keys = Keys(entry("cid", "three"), file)
    assert keys.owners == ["ann", "bob", "cid"]
    assert keys.owner("two") == "bob"


def test_the_file_is_read_anew(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO)
    file = tmp_path / "keys"
    file.write_text(entry("ann", "one"))
    keys = Keys(entry("cid", "three"), file)
    file.write_text(entry("bob", "two"))
    keys.reload()
    assert (keys.owner("one"), keys.owner("two"), keys.owner("three")) == (None, "bob", "cid")
    assert "bob, cid" in caplog.text


@pytest.mark.parametrize("text", [None, "", "# nobody\n", "sp_a-key-in-plain", "\0"])
def test_a_file_gone_bad_changes_nothing(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, text: str | None
) -> None:
    file = tmp_path / "keys"
    file.write_text(entry("ann", "one"))
    keys = Keys("", file)
    if text is None:
        file.unlink()
    else:
        file.write_text(text)
    keys.reload()
    assert keys.owner("one") == "ann"
    assert "API_KEYS_FILE" in caplog.text
    assert "sp_" not in caplog.text


@pytest.mark.parametrize("text", ["", "\n# nobody\n"])
def test_a_file_without_keys_does_not_open_the_service(tmp_path: Path, text: str) -> None:
    file = tmp_path / "keys"
    file.write_text(text)
    with pytest.raises(KeysFault, match="holds no key"):
        Keys(entry("ann", "one"), file)


@pytest.mark.parametrize("content", [None, b"\xff\xfe\xfa"])
def test_a_file_that_can_not_be_read(tmp_path: Path, content: bytes | None) -> None:
    file = tmp_path / "keys"
    if content is not None:
        file.write_bytes(content)
    with pytest.raises(KeysFault, match=f"{file} can't be read"):
        Keys("", file)


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("sp_secret", r"API_KEYS, entry 1: is not NAME:SHA256"),
        ("{good},sp_secret:", r"API_KEYS, entry 2: what follows"),
        ("{good}\n:{digest}", r"API_KEYS, entry 2: the name"),
        ("a b:{digest}", "the name"),
        ("sp_secret:{digest}0", "64 hexadecimal"),
        ("x" * 65 + ":{digest}", "the name"),
        ("ann:sp_secret", "64 hexadecimal"),
        ("{good},bob:{digest}", "ann and bob have the same key"),
    ],
)
def test_what_is_malformed_is_told_without_a_word_of_it(text: str, fault: str) -> None:
    with pytest.raises(KeysFault, match=fault) as caught:
        Keys(text.format(good=entry("ann", "one"), digest=digest_of("one")))
    assert "secret" not in str(caught.value)
