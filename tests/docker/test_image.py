"""What the image is made from: the locks, the Dockerfile, and what is left out of it."""

from __future__ import annotations

import re
import subprocess
import sys
import tomllib
from collections.abc import Iterable
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path
from signal import SIGTERM
from threading import Thread
from types import TracebackType

import pytest
from manifests import DOCKER, ROOT
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
EXTRAS = ("otel", "shared")


def locked(name: str) -> dict[str, tuple[str, int]]:
    """Version and number of hashes of each package of docker/<name>, by name."""
    text = (DOCKER / name).read_text("utf-8")
    entries = re.findall(
        r"^([\w.-]+)==(\S+) \\\n((?:    --hash=sha256:[0-9a-f]{64}.*\n)+)", text, re.M
    )
    return {
        canonicalize_name(package): (version, hashes.count("--hash"))
        for package, version, hashes in entries
    }


def unmet(wanted: Iterable[str], lock: dict[str, tuple[str, int]]) -> list[str]:
    """Requirements that the lock has no version for."""
    names = {text: canonicalize_name(Requirement(text).name) for text in wanted}
    return [
        text
        for text, name in names.items()
        if name not in lock or not Requirement(text).specifier.contains(lock[name][0])
    ]


def test_the_lock_has_what_the_service_depends_on() -> None:
    project = PROJECT["project"]
    wanted = [*project["dependencies"]]
    for extra in EXTRAS:
        wanted += project["optional-dependencies"][extra]
    assert unmet(wanted, locked("requirements.lock")) == []
    assert unmet(["numpy>=1000", "no-such-package"], locked("requirements.lock")) == [
        "numpy>=1000",
        "no-such-package",
    ]


def test_the_lock_of_the_build_has_what_builds_the_wheel() -> None:
    wanted = PROJECT["build-system"]["requires"]
    lines = (DOCKER / "build.in").read_text("utf-8").splitlines()
    assert [line for line in lines if not line.startswith("#")] == wanted
    assert unmet(wanted, locked("build.lock")) == []


@pytest.mark.parametrize("name", ["requirements.lock", "build.lock"])
def test_a_lock_is_pinned_hashed_and_names_no_index(name: str) -> None:
    text = (DOCKER / name).read_text("utf-8")
    pinned = [line for line in text.splitlines() if line and line[0] not in " #"]
    assert len(pinned) == len(locked(name)) > 0
    assert all(hashes for _, hashes in locked(name).values())
    assert not re.search(r"^\s*--?(index|extra-index|find-links|i )|://", text, re.M)


@pytest.mark.parametrize("package", ["torch", "pip", "setuptools", "pytest", "pyarrow", "ray"])
def test_the_lock_has_nothing_that_serves_no_request(package: str) -> None:
    assert package not in locked("requirements.lock")


def test_hadolint_finds_nothing_in_the_dockerfile() -> None:
    command = [Path(sys.executable).with_name("hadolint"), DOCKER / "Dockerfile"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (0, "")


def test_what_the_dockerfile_copies_is_let_into_the_build() -> None:
    text = (DOCKER / "Dockerfile").read_text("utf-8")
    copied = [
        source
        for line in re.findall(r"^COPY (?!--from)(.+)$", text, re.M)
        for source in line.split()[:-1]
    ]
    assert "service" in copied
    ignore = (ROOT / ".dockerignore").read_text("utf-8").splitlines()
    let_in = [line.removeprefix("!") for line in ignore if line.startswith("!")]
    for source in copied:
        assert (ROOT / source).exists(), source
        assert any(Path(source).match(pattern) for pattern in let_in), source


def removed() -> list[str]:
    """Modules that docker/slim removes, by their dotted names."""
    text = (DOCKER / "slim").read_text("utf-8")
    paths = [path for line in re.findall(r"^rm -r (.+)$", text, re.M) for path in line.split()]
    return [path.replace("/", ".").removesuffix("*") for path in paths]


WITHOUT = """
import sys
from importlib import import_module
from pkgutil import walk_packages

removed = sys.argv[1:]

class Removed:
    def find_spec(self, name, path=None, target=None):
        if any(name == gone or name.startswith(gone + ".") for gone in removed):
            raise ImportError(name)

sys.meta_path.insert(0, Removed())
import service
for module in walk_packages(service.__path__, "service."):
    import_module(module.name)

from pathlib import Path
from service import pipeline
from service.edits import parse_edits
from service.encode.model import SHIPPED, load_models
from service.requests import EditOptions, InferOptions, Upload

models = load_models(SHIPPED)
samples = Path(service.__file__).parent / "web/samples"
edits = {"chair": "seat_width", "airplane": "wing_length", "human": "left_elbow_y"}
for category, parameter in edits.items():
    models[category].verify()
    sample = Upload((samples / f"{category}.glb").read_bytes(), "sample.glb", None)
    changes = parse_edits('{"%s": {"add": 0.1}}' % parameter)
    for format in (None, "obj"):
        pipeline.edit(sample, models, InferOptions(category), changes, EditOptions(format=format))
"""


def test_the_service_does_without_what_the_image_leaves_out() -> None:
    gone = removed()
    assert "scipy.stats" in gone
    command = [sys.executable, "-W", "error::ImportWarning", "-c", WITHOUT, *gone]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


class Answering:
    """A server on a free port that answers every request with one status."""

    def __init__(self, status: int) -> None:
        class Handler(BaseHTTPRequestHandler):
            def do_GET(self) -> None:
                self.send_response(status if self.path == "/readyz" else 404)
                self.end_headers()

            def log_message(self, *_: object) -> None:
                """Say nothing."""

        self._server = HTTPServer(("127.0.0.1", 0), Handler)
        self._thread = Thread(target=self._server.serve_forever)
        self.port = self._server.server_port

    def __enter__(self) -> Answering:
        self._thread.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        at: TracebackType | None,
    ) -> None:
        self._server.shutdown()
        self._server.server_close()
        self._thread.join()


def health(port: int) -> int:
    """The exit status of the container's health check."""
    command = [sys.executable, DOCKER / "healthcheck.py"]
    # A proxy must not come between.
    environment = {
        "PORT": str(port),
        "http_proxy": "http://127.0.0.1:9",
        "HTTP_PROXY": "http://127.0.0.1:9",
    }
    return subprocess.run(command, env=environment, capture_output=True, check=False).returncode


@pytest.mark.parametrize(("status", "exit_status"), [(200, 0), (503, 1)])
def test_the_health_check_says_whether_it_is_ready(status: int, exit_status: int) -> None:
    with Answering(status) as server:
        assert health(server.port) == exit_status


def test_the_health_check_fails_where_nobody_answers() -> None:
    with Answering(200) as server:
        port = server.port
    assert health(port) == 1


def test_a_container_that_is_stopped_while_it_starts_ends(tmp_path: Path) -> None:
    package = tmp_path / "service"
    package.mkdir()
    (package / "__init__.py").touch()
    (package / "__main__.py").write_text(
        "import sys, time\nprint(sys.argv[1:], flush=True)\ntime.sleep(60)\n"
    )
    command = [sys.executable, DOCKER / "start.py", "--port", "1"]
    with subprocess.Popen(
        command, env={"PYTHONPATH": str(tmp_path)}, stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "['--port', '1']\n"
        process.send_signal(SIGTERM)
        assert process.wait(timeout=30) == 0
