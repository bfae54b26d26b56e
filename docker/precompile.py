"""Compiles all that the service imports, once; run within the virtual environment.

A read-only root can't keep compiled modules, so that each start would compile them anew. The files
of an image don't change, which spares the comparison with their sources too.
"""

import sys
from importlib import import_module
from pathlib import Path
from pkgutil import walk_packages
from py_compile import PycInvalidationMode, compile

import service

# Loaded only while the server runs.
LATER = (
    "anyio._backends._asyncio",
    "opentelemetry.exporter.otlp.proto.http.trace_exporter",
    "opentelemetry.sdk.trace.export",
    "trimesh",
    "uvicorn.lifespan.on",
    "uvicorn.loops.auto",
    "uvicorn.protocols.http.auto",
)

for name in (*(module.name for module in walk_packages(service.__path__, "service.")), *LATER):
    import_module(name)
for module in list(sys.modules.values()):
    source = Path(getattr(module, "__file__", None) or "-")
    if source.suffix == ".py" and source.is_relative_to(sys.prefix):
        compile(str(source), doraise=True, invalidation_mode=PycInvalidationMode.UNCHECKED_HASH)
