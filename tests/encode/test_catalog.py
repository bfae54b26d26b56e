from __future__ import annotations

import gc
import shutil
import weakref
from pathlib import Path
from typing import Any

import pytest
from own_models import change, flip, write_throne

import service.template
from model_export.debug_model import write_model
from service.encode.catalog import Catalog
from service.encode.installed import Installed
from service.encode.model import SHIPPED, Model, load_models
from service.errors import ModelFault


class Pretend:
    """A shipped model."""

    def __init__(self, name: str, fault: ModelFault | None = None, version: str = "0.9") -> None:
        self.name = name
        self.version = version
        self.fault = fault

    def verify(self) -> None:
        if self.fault is not None:
            raise self.fault


@pytest.fixture
def own(tmp_path: Path) -> Path:
    """A models folder of one's own, with the chair in it under the name of throne."""
    write_throne(tmp_path / "models")
    return tmp_path / "models"


@pytest.fixture
def two(tmp_path: Path) -> Path:
    """One with versions of a model of boxes in folders of their own."""
    folder = tmp_path / "models"
    for name, version in (("old", "1.0.0"), ("new", "2.0.0")):
        (folder / name).mkdir(parents=True)
        write_model(folder / name, version)
    return folder


def catalog(own: Path | None, shipped: Any = None, **options: Any) -> Catalog:
    return Catalog(lambda: shipped or {"stool": Pretend("stool")}, own, 1, **options)


def versions(installed: Installed, name: str = "debug") -> list[str]:
    return [model.version for model in installed.versions.get(name, ())]


def codes(installed: Installed) -> list[str]:
    return [fault.code for fault in installed.faults]


def test_without_a_folder_the_shipped_models_are_all() -> None:
    installed = catalog(None).load()
    assert list(installed.models) == ["stool"]
    assert installed.faults == ()


def test_own_models_stand_beside_the_shipped_ones(own: Path) -> None:
    installed = catalog(own).load()
    assert list(installed.models) == ["stool", "throne"]
    assert installed.faults == ()
    assert isinstance(installed.models["throne"], Model)


def test_an_own_model_goes_before_a_shipped_one_of_its_name(own: Path) -> None:
    pretend = Pretend("throne", version="99")
    installed = catalog(own, {"throne": pretend}).load()
    assert installed.models["throne"] is not pretend
    assert installed.named["throne@99"] is pretend


def test_a_bad_shipped_model_is_an_error(own: Path) -> None:
    fault = ModelFault("model_golden", "stool is off", "Export it again.")
    with pytest.raises(ModelFault) as caught:
        catalog(own, {"stool": Pretend("stool", fault)}).load()
    assert caught.value.code == "model_golden"
    assert "comes with the service can't be trusted: stool is off" in caught.value.detail
    assert "Install the service again" in caught.value.suggestion


def test_a_bad_body_of_the_operators_own_is_told_as_such(tmp_path: Path) -> None:
    mine = tmp_path / "mine.npz"
    mine.write_bytes(b"no body")
    looks = Catalog(lambda: load_models(SHIPPED, 1, mine, ["human"]), None, 1, mine)
    with pytest.raises(ModelFault) as caught:
        looks.load()
    assert caught.value.code == "body_model"
    assert "BODY_MODEL" in caught.value.suggestion


def test_a_look_loads_what_is_new_and_only_that(own: Path) -> None:
    looks = catalog(own)
    first = looks.load().models
    assert looks.load().models["throne"] is first["throne"]
    change(own, version="2.0.0")
    second = looks.load().models
    assert (first["throne"].version, second["throne"].version) != ("2.0.0", "2.0.0")
    assert second["throne"].version == "2.0.0"
    (own / "throne.json").unlink()
    assert list(looks.load().models) == ["stool"]


def test_versions_lie_in_folders_side_by_side(two: Path) -> None:
    looks = catalog(two)
    installed = looks.load()
    assert installed.faults == ()
    assert versions(installed) == ["2.0.0", "1.0.0"]
    assert installed.models["debug"].version == "2.0.0"
    write_model(two, "3.0.0")
    assert versions(looks.load()) == ["3.0.0", "2.0.0", "1.0.0"]
    shutil.rmtree(two / "new")
    assert versions(looks.load()) == ["3.0.0", "1.0.0"]


def test_a_setting_chooses_the_default(two: Path) -> None:
    looks = catalog(two, defaults={"debug": "1.0.0"})
    assert looks.load().models["debug"].version == "1.0.0"
    shutil.rmtree(two / "old")
    installed = looks.load()
    assert installed.models["debug"].version == "2.0.0"
    assert codes(installed) == ["default_missing"]


def test_only_visible_folders_one_level_deep_are_looked_into(two: Path) -> None:
    # A mounted Kubernetes volume: the files lie in a hidden folder, behind a link.
    (two / "new").rename(two / "..2026")
    (two / "..data").symlink_to("..2026")
    for file in (two / "..2026").iterdir():
        (two / file.name).symlink_to(f"..data/{file.name}")
    (two / "old" / "older").mkdir()
    shutil.copytree(two / "old", two / "old" / "older", dirs_exist_ok=True, ignore=lambda *_: ["x"])
    (two / "._debug.json").write_bytes(b"what a Mac leaves behind")
    installed = catalog(two).load()
    assert versions(installed) == ["2.0.0", "1.0.0"]
    assert installed.faults == ()


def test_a_copy_in_another_folder_is_no_fault(two: Path) -> None:
    looks = catalog(two)
    before = looks.load().named["debug@1.0.0"]
    shutil.copytree(two / "old", two / "copy")
    shutil.rmtree(two / "old")
    (two / "new").rename(two / "newer")
    after = looks.load()
    assert after.named["debug@1.0.0"] is before
    shutil.copytree(two / "copy", two / "old")
    assert looks.load().named["debug@1.0.0"] is before
    assert looks.load().faults == ()


def test_two_that_claim_the_same_version_are_a_fault(two: Path) -> None:
    looks = catalog(two)
    before = looks.load().named["debug@2.0.0"]
    # The folder's name comes first, and still what was served is served on.
    shutil.copytree(two / "new", two / "another")
    change(two / "another", "debug", label="Another box")
    installed, at_start = looks.load(), catalog(two).load()
    assert installed.named["debug@2.0.0"] is before
    assert at_start.named["debug@2.0.0"].card["label"] == "Another box"
    for look, bad, good in ((installed, "another", "new"), (at_start, "new", "another")):
        assert codes(look) == ["model_duplicate"]
        assert f"in {bad!r}: " in look.faults[0].detail
        assert f"the one in {good!r}" in look.faults[0].detail


def test_faults_say_in_which_folder_they_are(two: Path) -> None:
    flip(two / "old" / "debug.onnx")
    installed = catalog(two).load()
    assert versions(installed) == ["2.0.0"]
    assert installed.faults[0].detail.startswith("in 'old': debug.onnx is sha256-")


def test_a_folder_that_is_not_there_is_said(tmp_path: Path) -> None:
    looks = catalog(tmp_path / "models")
    assert codes(looks.load()) == ["models_dir_missing"]
    (tmp_path / "models").mkdir()
    assert looks.load().faults == ()


def test_a_file_in_place_of_the_folder_is_said(tmp_path: Path) -> None:
    (tmp_path / "models").write_bytes(b"")
    assert codes(catalog(tmp_path / "models").load()) == ["models_dir_missing"]


@pytest.mark.parametrize(("closed", "left"), [(".", []), ("old", ["2.0.0"])])
def test_what_was_in_a_folder_that_cannot_be_read_any_more_is_served_on(
    two: Path, monkeypatch: pytest.MonkeyPatch, closed: str, left: list[str]
) -> None:
    looks = catalog(two)
    before = looks.load()
    read = Path.iterdir

    def iterdir(path: Path) -> Any:
        if path == two / closed:
            raise PermissionError(13, "Permission denied")
        return read(path)

    monkeypatch.setattr(Path, "iterdir", iterdir)
    after, at_start = looks.load(), catalog(two).load()
    assert after.versions == before.versions
    assert versions(at_start) == left
    for installed in (after, at_start):
        assert codes(installed) == ["models_dir_unreadable"]
        assert "Permission denied" in installed.faults[0].detail


def test_models_that_are_replaced_are_freed(two: Path) -> None:
    looks = catalog(two)
    looks.load()
    alive = []
    for turn in range(6):
        write_model(two / "new", f"3.{turn}.0")
        alive.append(weakref.ref(looks.load().models["debug"]._session._session))
    gc.collect()
    assert [session() is not None for session in alive] == [False] * 5 + [True]


def test_the_shipped_models_all_verify() -> None:
    assert Catalog(lambda: load_models(SHIPPED), None, 1).load().faults == ()


def test_own_bodies_work_with_the_operators_body_file(body_folder: Path, tmp_path: Path) -> None:
    mine = tmp_path / "mine.npz"
    shutil.copy(Path(service.template.__file__).parent / "human.npz", mine)
    looks = Catalog(lambda: {}, body_folder, 1, mine)
    first = looks.load()
    assert list(first.models) == ["human"]
    mine.write_bytes(b"no body")
    second = looks.load()
    assert codes(second) == ["body_model"]
    assert second.models["human"] is first.models["human"]
