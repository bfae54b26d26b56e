from __future__ import annotations

import json
import subprocess
import sys

PROGRAM = """
import json, sys
from service.main import create_app
create_app()
print(json.dumps(sorted({name.split(".")[0] for name in sys.modules})))
"""


def test_the_service_needs_nothing_that_training_needs() -> None:
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM], capture_output=True, text=True, check=True, timeout=120
    )
    imported = set(json.loads(done.stdout))
    assert "service" in imported
    assert imported.isdisjoint({"torch", "model_export", "matplotlib", "ray", "onnx", "pytest"})
