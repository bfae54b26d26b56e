from __future__ import annotations

import re

import pytest

from service.store.address import Address

ID = "sha256-" + "0f" * 32


def test_a_name_tells_neither_the_owner_nor_the_content() -> None:
    address = Address.of(ID, "acme")
    assert address is not None
    assert re.fullmatch("[0-9a-f]{64}", address.name)
    assert "0f0f" not in address.name


def test_every_owner_has_names_of_their_own() -> None:
    owners = ["", "a", "b", "../a", '"', "\ud800"]
    assert len({Address(ID, owner).name for owner in owners}) == len(owners)


@pytest.mark.parametrize(
    "mesh_id",
    ["", "..", "../../etc/passwd", "sha256-", ID + "0", ID[:-1], ID.upper(), ID + "\n", "x" * 99999,
     "sha256-" + "g" * 64, "sha256-" + "\u0660" * 64],
)  # fmt: skip
def test_what_can_be_no_id_has_no_address(mesh_id: str) -> None:
    assert Address.of(mesh_id, "") is None
