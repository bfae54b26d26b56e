"""Models: their files, what they infer, and how it is judged."""

import os

# Onnxruntime's builds report what they run to its makers, by HTTPS and from a thread of their own,
# unless this is said before they are first imported. What is set already is left.
os.environ.setdefault("ORT_DISABLE_TELEMETRY", "1")
