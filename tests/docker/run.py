"""Builds the image, runs it as a cluster would, and puts requests to it; minutes, so run by hand.

    make image-test
    .venv/bin/python tests/docker/run.py --engine docker chair.glb other.ply

The container has a read-only root with a tmpfs at /tmp, no capabilities, one CPU and 512 MiB. It
shares the host's network, so that it works without one of its own, and listens on loopback alone.
Exit status 1 when anything is not as it should be.
"""

from __future__ import annotations

import argparse
import json
import re
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from io import BytesIO
from pathlib import Path
from signal import SIGTERM

import httpx
import numpy as np
import trimesh

ROOT = Path(__file__).parents[2]
SAMPLES = ROOT / "service/web/samples"
NAME = "shape-parameters-test"
MEGABYTE = 1_000_000
MEBIBYTE = 1 << 20
LARGEST = 400 * MEGABYTE
MEMORY = 512 * MEBIBYTE
AT_REST = 350 * MEBIBYTE
STOP_S = 35
PARAMETERS = {"chair": "seat_width", "airplane": "wing_length", "human": "shape_0"}
UNWANTED = ("torch", "pip", "setuptools", "pytest", "onnx")
COMPILERS = ("cc", "gcc", "g++", "c++", "clang", "ld", "make", "strip", "pip", "pip3")

INSIDE = f"""
import json, os, shutil, tempfile
from importlib.util import find_spec
def refused(path):
    try:
        open(path, "w")
    except OSError as error:
        return error.strerror
status = dict(line.split(":\\t", 1) for line in open("/proc/1/status").read().splitlines())
print(json.dumps(dict(
    ids=[os.getuid(), os.getgid()],
    status={{name: text.strip() for name, text in status.items()}},
    modules=[name for name in {UNWANTED!r} if find_spec(name)],
    programs=[name for name in {COMPILERS!r} if shutil.which(name)],
    root=refused("/probe"), venv=refused("/opt/venv/probe"), tmp=refused("/tmp/probe"),
)))
"""


class Table:
    """What was looked at: printed as it is found, and whether all of it was right."""

    def __init__(self) -> None:
        self.right = True

    def row(self, what: str, found: object, right: bool = True) -> None:
        self.right &= right
        print(f"{'ok  ' if right else 'BAD '} {what:<34} {found}", flush=True)


class Engine:
    """podman or docker, by its command line."""

    def __init__(self, program: str) -> None:
        self.program = program

    def __call__(self, *arguments: str, check: bool = True) -> str:
        done = subprocess.run(
            [self.program, *arguments], capture_output=True, text=True, check=False
        )
        if check and done.returncode:
            sys.exit(f"{self.program} {' '.join(arguments)}\n{done.stdout}{done.stderr}")
        return done.stdout.strip()

    def inside(self, *command: str) -> str:
        return self("exec", NAME, *command)


def build(engine: Engine, table: Table, base: str, image: str) -> None:
    formats = ["--format", "docker"] if engine.program == "podman" else []
    start = time.monotonic()
    engine(
        *("build", *formats, "--network", "host", "--build-arg", f"BASE_IMAGE={base}"),
        *("--file", str(ROOT / "docker/Dockerfile"), "--tag", image, str(ROOT)),
    )
    table.row("built in", f"{time.monotonic() - start:.0f} s, on {base}")


def check_image(engine: Engine, table: Table, image: str) -> None:
    (facts,) = json.loads(engine("image", "inspect", image))
    config = facts["Config"]
    table.row("size", f"{facts['Size'] / MEGABYTE:.0f} MB", facts["Size"] < LARGEST)
    table.row("user", config["User"], config["User"] == "10001:10001")
    table.row("stop signal", config["StopSignal"], config["StopSignal"] == "SIGTERM")
    table.row("ports", list(config["ExposedPorts"]), "8000/tcp" in config["ExposedPorts"])
    check = facts.get("Healthcheck") or config.get("Healthcheck")
    table.row("health check", check and check["Test"], bool(check))


def start(engine: Engine, image: str, port: int) -> None:
    engine("rm", "--force", NAME, check=False)
    engine(
        *("run", "--detach", "--name", NAME, "--network", "host", "--no-healthcheck"),
        *("--read-only", "--tmpfs", "/tmp:size=64m", "--cap-drop", "ALL"),
        *("--security-opt", "no-new-privileges", "--pids-limit", "64"),
        *("--cpus", "1", "--memory", str(MEMORY), image),
        *("--host", "127.0.0.1", "--port", str(port)),
    )


def wait_until_ready(engine: Engine, table: Table, client: httpx.Client) -> None:
    started = time.monotonic()
    while time.monotonic() - started < 60:
        try:
            if client.get("/readyz").status_code == 200:
                table.row("ready after", f"{time.monotonic() - started:.1f} s")
                return
        except httpx.TransportError:
            pass
        time.sleep(0.05)
    print(engine("logs", NAME, check=False))
    sys.exit("It never was ready.")


def check_inside(engine: Engine, table: Table, port: int) -> None:
    found = json.loads(engine.inside("python", "-c", INSIDE))
    status = found["status"]
    table.row("user and group inside", found["ids"], found["ids"] == [10001, 10001])
    capabilities = {status[name] for name in ("CapInh", "CapPrm", "CapEff", "CapBnd", "CapAmb")}
    table.row("capabilities", capabilities, all(int(bits, 16) == 0 for bits in capabilities))
    table.row("no new privileges", status["NoNewPrivs"], status["NoNewPrivs"] == "1")
    table.row("root is read-only", found["root"], found["root"] is not None)
    table.row("its environment too", found["venv"], found["venv"] is not None)
    table.row("/tmp can be written", found["tmp"] or "yes", found["tmp"] is None)
    table.row("modules that should not be there", found["modules"], not found["modules"])
    table.row("programs that should not be there", found["programs"], not found["programs"])
    health = subprocess.run(
        [engine.program, "exec", "--env", f"PORT={port}", NAME, "python", "/opt/healthcheck.py"],
        check=False,
    )
    table.row("the health check's exit status", health.returncode, health.returncode == 0)


def resident(engine: Engine, field: str) -> int:
    status = engine.inside("cat", "/proc/1/status")
    return int(re.findall(rf"{field}:\s+(\d+) kB", status)[0]) * 1024


def check_mesh(table: Table, client: httpx.Client, file: Path) -> None:
    data = file.read_bytes()
    mesh = {"mesh": (file.name, data)}
    answer = client.post("/infer", files=mesh)
    report = answer.json()
    table.row(f"{file.name}: /infer", report.get("category", report), answer.status_code == 200)
    category = report.get("category", "chair")
    # Named, since what is like no category is edited only when the client says what it is.
    fields = {
        "category": category,
        "edits": json.dumps({PARAMETERS[category]: {"add": 0.1}}),
    }
    started = time.monotonic()
    answer = client.post("/edit", files=mesh, data=fields)
    seconds = time.monotonic() - started
    table.row(f"{file.name}: /edit", f"{seconds:.2f} s", answer.status_code == 200)
    if answer.status_code == 200:
        before, after = (vertices(bytes_, file.suffix) for bytes_ in (data, answer.content))
        moved = "as many" if before.shape == after.shape else f"{len(before)}, {len(after)}"
        right = before.shape == after.shape and not np.allclose(before, after)
        table.row(f"{file.name}: vertices", f"{len(before)}, {moved}, moved", right)


def vertices(data: bytes, suffix: str) -> np.ndarray:
    """``[V, 3]`` positions of all meshes of a file, in its order."""
    scene = trimesh.load_scene(BytesIO(data), file_type=suffix.lstrip("."), process=False)
    return np.concatenate([mesh.vertices for mesh in scene.geometry.values()])


def check_memory(engine: Engine, table: Table, what: str, limit: int) -> None:
    now, most = resident(engine, "VmRSS"), resident(engine, "VmHWM")
    text = f"{now / MEBIBYTE:.0f} MiB, {most / MEBIBYTE:.0f} at most"
    table.row(f"memory {what}", text, most < limit)


def caught(engine: Engine) -> int:
    """The signals that the service handles, a bit each."""
    status = engine.inside("cat", "/proc/1/status")
    return int(re.findall(r"SigCgt:\s+(\w+)", status)[0], 16)


def check_stop_at_start(engine: Engine, table: Table) -> None:
    """SIGTERM while Python still imports, from when it would be heard at all."""
    started = time.monotonic()
    while not caught(engine) >> (SIGTERM - 1) & 1:
        time.sleep(0.02)
    engine("stop", "--time", str(STOP_S), NAME)
    seconds = time.monotonic() - started
    (facts,) = json.loads(engine("inspect", NAME))
    code = facts["State"]["ExitCode"]
    table.row("stopped while it starts", f"{seconds:.1f} s, status {code}", code == 0)


def check_stop(engine: Engine, table: Table, client: httpx.Client) -> None:
    """SIGTERM while a request is in work: it is answered, and the container ends by itself."""
    sample = SAMPLES / "human.glb"
    with ThreadPoolExecutor() as pool:
        answers = [
            pool.submit(client.post, "/infer", files={"mesh": (sample.name, sample.read_bytes())})
            for _ in range(2)
        ]
        time.sleep(0.1)
        began = time.monotonic()
        stopping = pool.submit(engine, "stop", "--time", str(STOP_S), NAME)
        statuses = [answer.result().status_code for answer in answers]
        stopping.result()
    seconds = time.monotonic() - began
    table.row("answers while it stops", statuses, statuses == [200, 200])
    (facts,) = json.loads(engine("inspect", NAME))
    table.row("exit status", facts["State"]["ExitCode"], facts["State"]["ExitCode"] == 0)
    table.row("stopped after", f"{seconds:.1f} s of {STOP_S}", seconds < STOP_S)
    table.row(
        "killed for want of memory", facts["State"]["OOMKilled"], not facts["State"]["OOMKilled"]
    )


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("meshes", nargs="*", type=Path, help="more files to edit")
    parser.add_argument("--engine", default="podman", help="podman or docker")
    parser.add_argument("--base", default="python:3.11-slim-bookworm", help="BASE_IMAGE")
    parser.add_argument("--image", default="localhost/shape-parameters:test", help="its name")
    parser.add_argument("--no-build", action="store_true", help="take the image as it is")
    parser.add_argument("--port", type=int, default=8097)
    given = parser.parse_args()
    engine, table = Engine(given.engine), Table()
    if not given.no_build:
        build(engine, table, given.base, given.image)
    check_image(engine, table, given.image)
    start(engine, given.image, given.port)
    check_stop_at_start(engine, table)
    start(engine, given.image, given.port)
    client = httpx.Client(base_url=f"http://127.0.0.1:{given.port}", timeout=60, trust_env=False)
    try:
        wait_until_ready(engine, table, client)
        check_inside(engine, table, given.port)
        check_memory(engine, table, "at rest", AT_REST)
        meshes = [SAMPLES / f"{category}.glb" for category in PARAMETERS]
        for file in (*meshes, *given.meshes):
            check_mesh(table, client, file)
        check_memory(engine, table, "after these requests", MEMORY)
        check_stop(engine, table, client)
    finally:
        client.close()
        engine("rm", "--force", NAME, check=False)
    return 0 if table.right else 1


if __name__ == "__main__":
    sys.exit(main())
