"""docs/observability.md and the dashboard speak of the metrics that there are."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
import yaml
from prometheus_client.core import Metric

from service.main import create_app
from service.settings import Settings

ROOT = Path(__file__).parent.parent
PAGE = ROOT / "docs" / "observability.md"
DASHBOARD = ROOT / "docker" / "grafana" / "dashboard.json"
ALERTS = ROOT / "docker" / "prometheus" / "alerts.yaml"
ASKING = [
    PAGE,
    *(f for f in sorted((ROOT / "docker").rglob("*.*")) if f.suffix in (".json", ".yaml")),
]
ROW = re.compile(r"\| `(shape_parameters_\w+)` \| (\w+) \| ?(.*?) ?\| .+ \|")
SUFFIXES = {"counter": ("_total",), "gauge": ("",), "histogram": ("_bucket", "_count", "_sum")}


@pytest.fixture(scope="module")
def families(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Metric]:
    """Of an app with all tiers that need nothing else, by the name that the page has."""
    app = create_app(Settings(store_dir=tmp_path_factory.mktemp("store")))
    found = app.state.context.metrics.registry.collect()
    own = [family for family in found if family.name.startswith("shape_parameters_")]
    return {family.name + "_total" * (family.type == "counter"): family for family in own}


def test_the_page_lists_all_metrics_and_no_other(families: dict[str, Metric]) -> None:
    rows = ROW.findall(PAGE.read_text("utf-8"))
    assert sorted(name for name, _, _ in rows) == sorted(families)
    assert {name: kind for name, kind, _ in rows} == {
        name: family.type for name, family in families.items()
    }


def test_the_page_lists_their_labels(families: dict[str, Metric]) -> None:
    for name, _, labels in ROW.findall(PAGE.read_text("utf-8")):
        listed = set(re.findall("`([a-z_]+)`", labels))
        for sample in families[name].samples:
            assert set(sample.labels) - {"le"} == listed, name


@pytest.mark.parametrize("path", ASKING, ids=lambda path: path.name)
def test_what_is_asked_for_is_there(families: dict[str, Metric], path: Path) -> None:
    series = {
        family.name + suffix for family in families.values() for suffix in SUFFIXES[family.type]
    }
    told = set(re.findall(r"shape_parameters_\w+", path.read_text("utf-8")))
    assert told or path not in (PAGE, DASHBOARD, ALERTS)
    assert told <= series | set(families)


def test_each_alert_is_told_and_says_what_it_means() -> None:
    (group,) = yaml.safe_load(ALERTS.read_text("utf-8"))["groups"]
    page = PAGE.read_text("utf-8")
    for rule in group["rules"]:
        assert f"| `{rule['alert']}` |" in page
        assert rule["labels"]["severity"] in ("critical", "warning")
        assert {"summary", "description"} == set(rule["annotations"])


def test_the_dashboard_has_panels_that_ask() -> None:
    dashboard = json.loads(DASHBOARD.read_text("utf-8"))
    panels = [panel for panel in dashboard["panels"] if panel["type"] != "row"]
    assert len({panel["id"] for panel in dashboard["panels"]}) == len(dashboard["panels"])
    for panel in panels:
        assert panel["title"]
        assert panel["datasource"] == {"type": "prometheus", "uid": "${datasource}"}
        assert all(target["expr"] for target in panel["targets"])
