"""The manifests for Kubernetes, KServe and compose: valid, hardened, and of one mind."""

from __future__ import annotations

from copy import deepcopy
from pathlib import Path
from typing import Any

import httpx
import kubernetes_validate
import pytest
from manifests import (
    DOCKER,
    KUBERNETES,
    Manifest,
    image_environment,
    kubernetes,
    pod,
    quantity,
    read,
    settings,
)
from prometheus_client.parser import text_string_to_metric_families

from service.main import create_app
from service.settings import Settings

# Of other makers, and without a schema among Kubernetes' own.
FOREIGN = {"kustomization", "prometheus-adapter", "servicemonitor"}
NATIVE = sorted(path.stem for path in KUBERNETES.glob("*.yaml") if path.stem not in FOREIGN)

# What KServe's v1beta1 adds to the specification of a pod.
# https://kserve.github.io/website/docs/reference/crd-api
COMPONENT = {
    "minReplicas": int,
    "maxReplicas": int,
    "scaleMetric": str,
    "scaleTarget": int,
    "timeout": int,
    "annotations": dict,
    "deploymentStrategy": dict,
}

DEPLOYMENT = kubernetes("deployment")
INFERENCE_SERVICE = read(DOCKER / "kserve/inferenceservice.yaml")
COMPOSE = read(DOCKER / "compose.yaml")["services"]["shape-parameters"]
CONFIGURED = kubernetes("configmap")["data"]

PODS = pytest.mark.parametrize(
    "manifest", [DEPLOYMENT, INFERENCE_SERVICE], ids=["deployment", "kserve"]
)


@pytest.mark.parametrize("version", ["1.30", "1.37"])
@pytest.mark.parametrize("name", NATIVE)
def test_a_manifest_is_valid(name: str, version: str) -> None:
    kubernetes_validate.validate(kubernetes(name), version, strict=True)


def test_an_unknown_field_would_be_found() -> None:
    with pytest.raises(kubernetes_validate.ValidationError):
        kubernetes_validate.validate({**DEPLOYMENT, "sepc": {}}, "1.37", strict=True)


def test_kustomize_takes_all_that_needs_nothing_more() -> None:
    taken = {Path(name).stem for name in kubernetes("kustomization")["resources"]}
    assert taken == set(NATIVE) - {"secret.example"}


def test_the_inference_service_is_a_component_around_a_valid_pod() -> None:
    assert INFERENCE_SERVICE["apiVersion"] == "serving.kserve.io/v1beta1"
    assert INFERENCE_SERVICE["kind"] == "InferenceService"
    assert set(INFERENCE_SERVICE["spec"]) == {"predictor"}
    predictor = pod(INFERENCE_SERVICE)
    for name, kind in COMPONENT.items():
        assert isinstance(predictor[name], kind), name
    assert predictor["scaleMetric"] in {"cpu", "memory"}  # others want Knative
    assert 1 <= predictor["minReplicas"] < predictor["maxReplicas"]
    rest = {name: value for name, value in predictor.items() if name not in COMPONENT}
    plain = {"apiVersion": "v1", "kind": "Pod", "metadata": {"name": "predictor"}, "spec": rest}
    kubernetes_validate.validate(plain, "1.37", strict=True)
    strategy = {**DEPLOYMENT["spec"], "strategy": predictor["deploymentStrategy"]}
    kubernetes_validate.validate({**DEPLOYMENT, "spec": strategy}, "1.37", strict=True)
    # The name by which KServe knows the container that serves.
    assert [container["name"] for container in rest["containers"]] == ["kserve-container"]


def test_both_run_the_same_container() -> None:
    ours, theirs = (deepcopy(pod(m)["containers"][0]) for m in (DEPLOYMENT, INFERENCE_SERVICE))
    port = ours["ports"][0]["containerPort"]
    for container in (ours, theirs):
        for name in ("image", "name", "ports"):
            del container[name]
        for probe in ("startupProbe", "livenessProbe", "readinessProbe"):
            container[probe]["httpGet"]["port"] = port
    assert ours == theirs
    for name in ("volumes", "securityContext", "terminationGracePeriodSeconds"):
        assert pod(DEPLOYMENT)[name] == pod(INFERENCE_SERVICE)[name]


@PODS
def test_a_pod_is_hardened(manifest: Manifest) -> None:
    spec = pod(manifest)
    assert spec["automountServiceAccountToken"] is False
    assert spec["enableServiceLinks"] is False
    context = spec["securityContext"]
    assert context["runAsNonRoot"] is True
    assert context["runAsUser"] == context["runAsGroup"] == context["fsGroup"] == 10001
    assert context["seccompProfile"] == {"type": "RuntimeDefault"}
    (container,) = spec["containers"]
    assert container["securityContext"] == {
        "allowPrivilegeEscalation": False,
        "privileged": False,
        "readOnlyRootFilesystem": True,
        "capabilities": {"drop": ["ALL"]},
    }
    for name in ("hostNetwork", "hostPID", "hostIPC"):
        assert name not in spec
    assert not any("hostPath" in volume for volume in spec["volumes"])


@PODS
def test_a_pod_gets_what_it_asks_for(manifest: Manifest) -> None:
    resources = pod(manifest)["containers"][0]["resources"]
    for name in ("cpu", "memory"):
        assert resources["requests"][name] == resources["limits"][name]
    disks = [volume["emptyDir"] for volume in pod(manifest)["volumes"] if "emptyDir" in volume]
    assert sum(quantity(disk["sizeLimit"]) for disk in disks) <= quantity(
        resources["requests"]["ephemeral-storage"]
    )


@PODS
def test_probes_are_paths_of_the_service(manifest: Manifest) -> None:
    (container,) = pod(manifest)["containers"]
    paths = {
        probe: container[probe]["httpGet"]["path"]
        for probe in ("startupProbe", "livenessProbe", "readinessProbe")
    }
    assert paths == {
        "startupProbe": "/readyz",
        "livenessProbe": "/livez",
        "readinessProbe": "/readyz",
    }
    served = create_app(Settings()).openapi()["paths"]
    assert set(paths.values()) <= set(served)


def test_ports_agree() -> None:
    (container,) = pod(DEPLOYMENT)["containers"]
    (port,) = container["ports"]
    number = str(port["containerPort"])
    assert number == image_environment()["PORT"]
    assert DEPLOYMENT["spec"]["template"]["metadata"]["annotations"]["prometheus.io/port"] == number
    assert pod(INFERENCE_SERVICE)["annotations"]["prometheus.io/port"] == number
    (served,) = kubernetes("service")["spec"]["ports"]
    assert served["targetPort"] == port["name"]
    (monitored,) = kubernetes("servicemonitor")["spec"]["endpoints"]
    assert monitored["port"] == served["name"]
    (allowed,) = kubernetes("networkpolicy")["spec"]["ingress"][0]["ports"]
    assert allowed["port"] == port["name"]
    for probe in ("startupProbe", "livenessProbe", "readinessProbe"):
        assert container[probe]["httpGet"]["port"] == port["name"]
    (published,) = COMPOSE["ports"]
    assert published.split(":")[0] == "127.0.0.1"
    assert published.split(":")[2] == number


def test_labels_and_selectors_agree() -> None:
    label = DEPLOYMENT["spec"]["template"]["metadata"]["labels"]
    selectors: list[Any] = [
        DEPLOYMENT["spec"]["selector"]["matchLabels"],
        kubernetes("service")["spec"]["selector"],
        kubernetes("pdb")["spec"]["selector"]["matchLabels"],
        kubernetes("networkpolicy")["spec"]["podSelector"]["matchLabels"],
        *(
            constraint["labelSelector"]["matchLabels"]
            for constraint in pod(DEPLOYMENT)["topologySpreadConstraints"]
        ),
    ]
    assert all(selector == label for selector in selectors)
    monitored = kubernetes("servicemonitor")["spec"]["selector"]["matchLabels"]
    assert monitored == kubernetes("service")["metadata"]["labels"]


def test_names_agree() -> None:
    spec = pod(DEPLOYMENT)
    assert spec["serviceAccountName"] == kubernetes("serviceaccount")["metadata"]["name"]
    (source,) = spec["containers"][0]["envFrom"]
    assert source["configMapRef"]["name"] == kubernetes("configmap")["metadata"]["name"]
    volumes = {volume["name"]: volume for volume in spec["volumes"]}
    secret = kubernetes("secret.example")
    assert volumes["keys"]["secret"]["secretName"] == secret["metadata"]["name"]
    target = kubernetes("hpa")["spec"]["scaleTargetRef"]
    assert target == {
        "apiVersion": DEPLOYMENT["apiVersion"],
        "kind": DEPLOYMENT["kind"],
        "name": DEPLOYMENT["metadata"]["name"],
    }
    (image,) = kubernetes("kustomization")["images"]
    assert image["name"] == spec["containers"][0]["image"]
    theirs = pod(INFERENCE_SERVICE)["containers"][0]["image"]
    assert theirs == f"{image['newName']}:{image['newTag']}"


@PODS
def test_the_settings_of_a_pod_are_the_services(manifest: Manifest) -> None:
    known = settings(CONFIGURED)
    mounts = {
        Path(mount["mountPath"]): mount["name"]
        for mount in pod(manifest)["containers"][0]["volumeMounts"]
    }
    volumes = {volume["name"]: volume for volume in pod(manifest)["volumes"]}
    assert known.api_keys_file is not None
    assert mounts[known.api_keys_file.parent] == "keys"
    assert known.api_keys_file.name in kubernetes("secret.example")["stringData"]
    assert known.store_dir is not None
    store = volumes[mounts[known.store_dir]]["emptyDir"]
    assert known.jobs_dir is not None
    assert known.jobs_dir.is_relative_to(known.store_dir)
    assert known.jobs_bytes is not None
    assert quantity(store["sizeLimit"]) > known.store_bytes + known.jobs_bytes
    assert "emptyDir" in volumes[mounts[Path("/tmp")]]
    assert known.max_upload_bytes <= known.max_pending_bytes
    memory = pod(manifest)["containers"][0]["resources"]["limits"]["memory"]
    assert known.max_pending_bytes <= quantity(memory) / 8


@PODS
def test_a_pod_has_time_to_drain(manifest: Manifest) -> None:
    known = settings(CONFIGURED)
    grace = pod(manifest)["terminationGracePeriodSeconds"]
    assert grace >= known.drain_seconds + known.grace_seconds + 5


def test_an_entry_of_the_example_of_keys_is_well_formed(tmp_path: Path) -> None:
    file = tmp_path / "api-keys"
    file.write_text(kubernetes("secret.example")["stringData"]["api-keys"])
    assert create_app(Settings(api_keys_file=file))


def test_replicas_scale_by_a_metric_that_the_service_has(service_client: httpx.Client) -> None:
    queue, cpu = kubernetes("hpa")["spec"]["metrics"]
    name = queue["pods"]["metric"]["name"]
    families = text_string_to_metric_families(service_client.get("/metrics").text)
    assert {family.name: family.type for family in families}[name] == "gauge"
    (rule,) = kubernetes("prometheus-adapter")["rules"]["custom"]
    assert rule["seriesQuery"].startswith(name + "{")
    assert cpu["resource"]["name"] == "cpu"


def test_compose_is_hardened() -> None:
    assert COMPOSE["read_only"] is True
    assert COMPOSE["cap_drop"] == ["ALL"]
    assert COMPOSE["security_opt"] == ["no-new-privileges:true"]
    assert COMPOSE["pids_limit"] <= 128
    assert COMPOSE["cpus"] >= 1
    assert COMPOSE["mem_limit"] == "2g"
    assert COMPOSE["tmpfs"] == ["/tmp:size=64m,mode=1777,noexec,nosuid,nodev"]
    assert "privileged" not in COMPOSE
    assert "user" not in COMPOSE  # the image's own is not root


def test_composes_settings_are_the_services() -> None:
    given = dict(COMPOSE["environment"])
    assert given.pop("API_KEYS") == "${API_KEYS:-}"
    known = settings(given)
    (store,) = COMPOSE["volumes"]
    assert store == f"store:{known.store_dir}"
    assert known.jobs_dir is not None
    assert known.store_dir is not None
    assert known.jobs_dir.is_relative_to(known.store_dir)
    assert "store" in read(DOCKER / "compose.yaml")["volumes"]
    assert known.max_upload_bytes <= known.max_pending_bytes <= 2 * 2**30 / 8
    grace = COMPOSE["stop_grace_period"]
    assert float(grace.removesuffix("s")) >= known.drain_seconds + known.grace_seconds + 5


def test_composes_paths_are_there() -> None:
    build = COMPOSE["build"]
    context = (DOCKER / build["context"]).resolve()
    assert (context / build["dockerfile"]).is_file()
    assert COMPOSE["healthcheck"]["test"][-1] == "/opt/healthcheck.py"


def test_the_images_own_settings_are_the_services() -> None:
    own = {name.upper() for name in Settings.model_fields}
    given = {name: value for name, value in image_environment().items() if name in own}
    known = settings(given)
    assert known.host == "0.0.0.0"
    assert known.models_dir == Path("/models")
