from __future__ import annotations

import pytest
import torch

from model_export.replay import WARM, Replayed

pytestmark = pytest.mark.skipif(not torch.cuda.is_available(), reason="records on a GPU only")


def test_a_replayed_step_trains_like_one_that_is_called() -> None:
    results = []
    for recorded in (False, True):
        torch.manual_seed(0)
        layer = torch.nn.Linear(4, 1).cuda()
        rate = torch.full((), 0.01, device="cuda")
        optimizer = torch.optim.AdamW(layer.parameters(), rate, capturable=True)

        def step(x: torch.Tensor, layer=layer, optimizer=optimizer) -> torch.Tensor:
            loss = (layer(x) - x.sum(1, keepdim=True)).square().mean()
            optimizer.zero_grad()
            loss.backward()
            optimizer.step()
            return loss.detach()

        learn = Replayed(step) if recorded else step
        inputs = torch.randn(3 * WARM, 8, 4, generator=torch.Generator().manual_seed(1)).cuda()
        losses = []
        for index, x in enumerate(inputs):
            rate.fill_(0.1 / (1 + index))
            losses.append(learn(x))
        results.append(torch.stack(losses))
    assert torch.allclose(*results, rtol=1e-4)
