"""A step of training as one CUDA graph: thousands of small kernels, launched at once."""

from __future__ import annotations

from collections.abc import Callable

import torch
from torch import Tensor

WARM = 4
"""Calls before recording: libraries, compilers and optimisers make their buffers in these."""


class Replayed:
    """A function of tensors on a GPU that is recorded after some calls, and replayed from then on.

    It must read and write the same memory each time, apart from its arguments, whose shapes may not
    change; draw nothing at random; and copy nothing from the host.
    """

    def __init__(self, function: Callable[..., Tensor]) -> None:
        self.function = function
        self.stream = torch.cuda.Stream()
        self.graph: torch.cuda.CUDAGraph | None = None
        self.calls = 0

    def __call__(self, *arguments: Tensor) -> Tensor:
        """The function's answer."""
        if self.graph is None and self.calls < WARM:
            self.calls += 1
            return self._apart(arguments)
        if self.graph is None:
            self._record(arguments)
        assert self.graph is not None
        for own, new in zip(self.arguments, arguments, strict=True):
            own.copy_(new)
        self.graph.replay()
        return self.answer.clone()

    def _apart(self, arguments: tuple[Tensor, ...]) -> Tensor:
        """Call it on the stream that it will be recorded on."""
        here = torch.cuda.current_stream()
        self.stream.wait_stream(here)
        with torch.cuda.stream(self.stream):
            answer = self.function(*arguments)
        here.wait_stream(self.stream)
        return answer

    def _record(self, arguments: tuple[Tensor, ...]) -> None:
        self.arguments = [argument.clone() for argument in arguments]
        torch.cuda.synchronize()
        graph = torch.cuda.CUDAGraph()
        with torch.cuda.graph(graph, stream=self.stream):
            self.answer = self.function(*self.arguments)
        self.graph = graph
