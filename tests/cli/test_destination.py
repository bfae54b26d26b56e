from __future__ import annotations

import os
import stat
from pathlib import Path

import click
import pytest

from service.cli.destination import Destination, write
from service.cli.problem import Problem


def test_results_lie_beside_their_inputs(tmp_path: Path) -> None:
    place = Destination(None, False, "edited")
    found = place.path(str(tmp_path / "a.b.glb"), "a.b.glb", "obj")
    assert found == tmp_path / "a.b-edited.obj"


def test_a_folder_keeps_the_names_of_edited_files(tmp_path: Path) -> None:
    assert Destination(f"{tmp_path}/new/", False, "edited").path("x/a.glb", "a.glb", "glb") == (
        tmp_path / "new" / "a.glb"
    )
    assert Destination(str(tmp_path), False, "sliders").path("x/a.obj", "a.obj", "glb") == (
        tmp_path / "a-sliders.glb"
    )


def test_a_name_asks_for_a_format(tmp_path: Path) -> None:
    assert Destination("wide.OBJ", False, "edited").format == "obj"
    assert Destination("wide.zip", False, "edited").format is None
    assert Destination("wide", False, "edited").format is None
    assert Destination("-", False, "edited").format is None
    assert Destination("x.glb/", False, "edited").format is None
    assert Destination(None, False, "edited").format is None


def test_what_is_there_is_not_replaced_by_a_slip(tmp_path: Path) -> None:
    there = tmp_path / "a-edited.glb"
    there.write_bytes(b"mine")
    file = str(tmp_path / "a.glb")
    for ask in (Destination.path, Destination.require_room):
        with pytest.raises(Problem, match="file_exists"):
            ask(Destination(None, False, "edited"), file, "a.glb", "glb")
        ask(Destination(None, True, "edited"), file, "a.glb", "glb")


def test_two_files_of_one_name_are_not_written_over_each_other(tmp_path: Path) -> None:
    place = Destination(f"{tmp_path}/", True, "edited", many=True)
    place.path("one/a.glb", "a.glb", "glb")
    with pytest.raises(Problem, match="output_twice"):
        place.path("two/a.glb", "a.glb", "glb")


@pytest.mark.parametrize(
    ("out", "files", "as_json", "told"),
    [
        ("one.glb", ("a.glb", "b.glb"), False, "-o DIR/"),
        ("-", ("a.glb", "b.glb"), False, "-o DIR/"),
        (None, ("a.glb", "-"), False, "-o DIR/"),
        ("-", ("a.glb",), True, "--json"),
    ],
)
def test_places_that_make_no_sense(
    out: str | None, files: tuple[str, ...], as_json: bool, told: str
) -> None:
    with pytest.raises(click.UsageError, match=told):
        Destination(out, False, "edited").require_sense(files, as_json)


def test_files_are_written_whole_and_leave_nothing_behind(tmp_path: Path) -> None:
    path = tmp_path / "new" / "a.glb"
    write(path, b"one")
    assert path.read_bytes() == b"one"
    path.chmod(0o640)
    write(path, b"two")
    assert path.read_bytes() == b"two"
    assert stat.S_IMODE(path.stat().st_mode) == 0o640
    assert os.listdir(path.parent) == ["a.glb"]


def test_links_are_followed(tmp_path: Path) -> None:
    real, link = tmp_path / "real.glb", tmp_path / "link.glb"
    real.write_bytes(b"one")
    link.symlink_to(real)
    write(link, b"two")
    assert link.is_symlink()
    assert real.read_bytes() == b"two"


def test_what_fails_leaves_what_was_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a.glb"
    path.write_bytes(b"mine")

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "replace", full)
    with pytest.raises(Problem, match="No space left on device"):
        write(path, b"new")
    assert path.read_bytes() == b"mine"
    assert os.listdir(tmp_path) == ["a.glb"]


def test_devices_can_be_written_to() -> None:
    write(Path("/dev/null"), b"gone")
    assert not Path("/dev/null").is_file()


def test_a_folder_that_is_none_is_told(tmp_path: Path) -> None:
    with pytest.raises(Problem, match="file_unwritable"):
        write(Path("/dev/null/a.glb"), b"x")
