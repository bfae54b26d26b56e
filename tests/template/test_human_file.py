"""The body that is shipped."""

from __future__ import annotations

from importlib import resources

import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray

from service.template.anatomy import JOINTS, MIRRORED, PARENTS, descendants
from service.template.skinned import SkinnedTemplate, body_of

Array = NDArray[np.float64]
FLIP = np.array([-1.0, 1.0, 1.0])


@pytest.fixture(scope="module")
def fields() -> dict[str, NDArray[np.generic]]:
    with (resources.files("service.template") / "human.npz").open("rb") as file:
        return dict(np.load(file, allow_pickle=False))


def shaped(human: SkinnedTemplate, label: str, coefficient: float) -> Array:
    shape = np.zeros(len(human.shape_labels))
    shape[human.shape_labels.index(label)] = coefficient
    return human.shaped(shape)[0]


def posed(human: SkinnedTemplate, **degrees: tuple[float, float, float]) -> Array:
    vectors = np.zeros((len(JOINTS), 3))
    for joint, angles in degrees.items():
        vectors[JOINTS.index(joint)] = np.radians(angles)
    return human.decode(body_of(vectors, np.zeros(3), 1.0, np.zeros(3)))


def volume(human: SkinnedTemplate, vertices: Array) -> float:
    return float(trimesh.Trimesh(vertices, human.faces, process=False).volume)


def width_at(vertices: Array, low: float, high: float) -> float:
    """Width of the trunk between two shares of the stature."""
    heights = vertices[:, 1] / vertices[:, 1].max()
    band = (heights > low) & (heights < high)
    return float(np.ptp(vertices[band, 0]))


def test_the_file_is_small_and_holds_numbers_and_texts_only(
    fields: dict[str, NDArray[np.generic]],
) -> None:
    file = resources.files("service.template") / "human.npz"
    assert len(file.read_bytes()) < 2_000_000
    assert all(array.dtype.kind in "fiU" for array in fields.values())
    assert "CC0" in str(fields["licence"])


def test_the_surface_is_one_closed_piece_that_faces_outwards(human: SkinnedTemplate) -> None:
    mesh = trimesh.Trimesh(human.rest, human.faces, process=False)
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert mesh.euler_number == 2
    assert mesh.body_count == 1
    assert mesh.volume > 0.0
    assert mesh.area_faces.min() > 0.0
    assert len(np.unique(human.faces)) == len(human.rest)
    assert len(human.rest) == pytest.approx(6900, abs=50)


def test_four_joints_at_most_move_a_vertex(fields: dict[str, NDArray[np.generic]]) -> None:
    weights = fields["weights"].astype(float)
    assert weights.min() == 0.0
    assert (weights > 0.0).sum(axis=1).max() <= 4
    np.testing.assert_allclose(weights.sum(axis=1), 1.0, atol=1e-6)
    assert (weights.max(axis=0) > 0.4).all()


def test_each_joint_is_a_mean_of_a_few_vertices(fields: dict[str, NDArray[np.generic]]) -> None:
    regressor = fields["J_regressor"].astype(float)
    assert regressor.min() == 0.0
    assert (regressor > 0.0).sum(axis=1).max() <= 30
    np.testing.assert_allclose(regressor.sum(axis=1), 1.0, atol=1e-6)


def test_the_joints_and_their_tree_are_smpls(fields: dict[str, NDArray[np.generic]]) -> None:
    assert tuple(fields["joint_names"]) == JOINTS
    assert tuple(fields["kintree_table"][0]) == PARENTS
    assert list(fields["kintree_table"][1]) == list(range(24))


def test_left_and_right_are_mirror_images(fields: dict[str, NDArray[np.generic]]) -> None:
    mirror = fields["mirror"].astype(int)
    np.testing.assert_array_equal(mirror[mirror], np.arange(len(mirror)))
    assert (mirror != np.arange(len(mirror))).mean() > 0.9
    rest, dirs = fields["v_template"], fields["shapedirs"]
    np.testing.assert_array_equal(rest[mirror] * FLIP, rest)
    np.testing.assert_array_equal(dirs[mirror] * FLIP[:, None], dirs)
    np.testing.assert_array_equal(fields["weights"][mirror][:, MIRRORED], fields["weights"])
    regressor = fields["J_regressor"]
    np.testing.assert_array_equal(regressor[:, mirror][list(MIRRORED)], regressor)
    faces = {tuple(np.roll(face, -face.argmin())) for face in fields["f"]}
    flipped = {tuple(np.roll(face, -face.argmin())) for face in mirror[fields["f"]][:, ::-1]}
    assert faces == flipped


def test_it_stands_in_a_t_pose_on_the_floor(human: SkinnedTemplate) -> None:
    at = dict(zip(JOINTS, human.joints, strict=True))
    assert human.rest[:, 1].min() == pytest.approx(0.0, abs=1e-6)
    np.testing.assert_allclose(at["pelvis"][[0, 2]], 0.0, atol=1e-3)
    for start, end, axis in (
        ("left_shoulder", "left_elbow", 0),
        ("left_elbow", "left_wrist", 0),
        ("left_wrist", "left_hand", 0),
        ("left_knee", "left_hip", 1),
        ("left_ankle", "left_knee", 1),
    ):
        bone = at[end] - at[start]
        assert bone[axis] > 0.999 * np.linalg.norm(bone)
    # The toes, and with them the body, point to the front.
    assert at["left_foot"][2] > at["left_ankle"][2] + 0.1
    assert human.rest[human.rest[:, 2].argmax(), 1] < 0.1


def test_joints_lie_inside_and_where_anatomy_has_them(human: SkinnedTemplate) -> None:
    mesh = trimesh.Trimesh(human.rest, human.faces, process=False)
    # Of a closed surface a point inside sees all of the solid angle.
    corners = mesh.triangles[None] - human.joints[:, None, None]
    a, b, c = corners[:, :, 0], corners[:, :, 1], corners[:, :, 2]
    la, lb, lc = (np.linalg.norm(x, axis=2) for x in (a, b, c))
    triple = (a * np.cross(b, c)).sum(axis=2)
    dots = [(x * y).sum(axis=2) for x, y in ((a, b), (b, c), (c, a))]
    angle = 2 * np.arctan2(triple, la * lb * lc + dots[0] * lc + dots[1] * la + dots[2] * lb)
    np.testing.assert_allclose(angle.sum(axis=1) / (4 * np.pi), 1.0, atol=1e-6)
    height = dict(zip(JOINTS, human.joints[:, 1] / 1.70, strict=True))
    ascending = ("left_foot", "left_ankle", "left_knee", "left_hip", "pelvis", "spine1", "spine2",
                 "spine3", "neck", "head")  # fmt: skip
    assert list(np.diff([height[name] for name in ascending]) > 0) == [True] * 9
    # Femur heads are at 52 to 53 hundredths of the stature, knees at 28 to 29.
    assert height["left_hip"] == pytest.approx(0.525, abs=0.015)
    assert height["left_knee"] == pytest.approx(0.285, abs=0.02)


def test_the_mean_body_is_a_middling_adult(human: SkinnedTemplate) -> None:
    stature = np.ptp(human.rest[:, 1])
    assert stature == pytest.approx(1.70, abs=0.005)
    assert 985.0 * volume(human, human.rest) / stature**2 == pytest.approx(24.0, abs=0.1)


def test_stature_makes_the_whole_body_taller(human: SkinnedTemplate) -> None:
    short, tall = (shaped(human, "Stature", c) for c in (-2.0, 2.0))
    assert np.ptp(short[:, 1]) == pytest.approx(1.48, abs=0.01)
    assert np.ptp(tall[:, 1]) == pytest.approx(1.92, abs=0.01)
    assert short[:, 1].min() == pytest.approx(0.0, abs=2e-3)
    shapes = np.eye(3)[0] * np.array([[-2.0], [2.0]])
    low, high = (human.shaped(shape)[1] for shape in shapes)
    leg, arm = JOINTS.index("left_hip"), JOINTS.index("left_hand")
    assert high[leg, 1] / low[leg, 1] == pytest.approx(1.92 / 1.48, abs=0.1)
    assert high[arm, 0] / low[arm, 0] == pytest.approx(1.92 / 1.48, abs=0.1)


def test_mass_changes_weight_alone(human: SkinnedTemplate) -> None:
    bodies = [shaped(human, "Body mass", c) for c in (-2.0, -1.0, 0.0, 1.0, 2.0)]
    for vertices in bodies:
        assert np.ptp(vertices[:, 1]) == pytest.approx(1.70, abs=0.005)
    indices = [985.0 * volume(human, vertices) / 1.70**2 for vertices in bodies]
    np.testing.assert_allclose(np.diff(indices), 4.0, atol=1.0)


def test_masculinity_widens_shoulders_and_narrows_hips(human: SkinnedTemplate) -> None:
    woman, man = (shaped(human, "Masculinity", c) for c in (-1.2, 1.2))
    for vertices in (woman, man):
        assert np.ptp(vertices[:, 1]) == pytest.approx(1.70, abs=0.005)
        assert volume(human, vertices) == pytest.approx(volume(human, human.rest), rel=0.02)
    hips = [width_at(vertices, 0.48, 0.52) for vertices in (woman, man)]
    assert hips[1] < 0.95 * hips[0]
    shape = 1.2 * np.eye(3)[human.shape_labels.index("Masculinity")]
    shoulders = [human.shaped(s)[1][JOINTS.index("left_shoulder"), 0] for s in (-shape, shape)]
    assert shoulders[1] > 1.05 * shoulders[0]


def test_all_usual_shapes_are_unfolded(human: SkinnedTemplate) -> None:
    before = trimesh.Trimesh(human.rest, human.faces, process=False).face_normals
    for shape in 1.5 * np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, -1).T:
        mesh = trimesh.Trimesh(human.shaped(shape)[0], human.faces, process=False)
        assert ((mesh.face_normals * before).sum(axis=1) < 0.0).mean() < 0.005


@pytest.mark.parametrize("name", ["left_elbow", "right_knee", "left_hip", "neck"])
def test_a_joint_moves_what_it_carries_alone(human: SkinnedTemplate, name: str) -> None:
    joint = JOINTS.index(name)
    moved = np.linalg.norm(posed(human, **{name: (40.0, -60.0, 0.0)}) - human.rest, axis=1)
    carried = human.weights[:, descendants()[joint]].sum(axis=1)
    assert moved[carried == 0.0].max() < 1e-9
    far = np.linalg.norm(human.rest - human.joints[joint], axis=1) > 0.1
    assert moved[(carried > 0.99) & far].min() > 0.01
    # Nothing of another limb, nor far up this one, hangs on the joint.
    assert 0.01 < (carried > 0.0).mean() < 0.45


def test_an_elbow_leaves_the_upper_arm_in_place(human: SkinnedTemplate) -> None:
    moved = np.linalg.norm(posed(human, left_elbow=(0.0, -90.0, 0.0)) - human.rest, axis=1) > 1e-3
    elbow = human.joints[JOINTS.index("left_elbow"), 0]
    x = human.rest[:, 0]
    assert not moved[x < elbow - 0.16].any()
    assert moved[x > elbow + 0.06].all()


@pytest.mark.parametrize(
    ("pose", "least"),
    [
        ({"left_elbow": (0.0, -90.0, 0.0), "right_elbow": (0.0, 90.0, 0.0)}, 0.985),
        ({"left_knee": (90.0, 0.0, 0.0), "right_knee": (90.0, 0.0, 0.0)}, 0.97),
        ({"left_shoulder": (0.0, 0.0, -80.0), "right_shoulder": (0.0, 0.0, 80.0)}, 0.97),
        ({"left_hip": (-90.0, 0.0, 0.0), "right_hip": (-90.0, 0.0, 0.0)}, 0.91),
    ],
)
def test_bends_keep_most_of_the_volume(
    human: SkinnedTemplate, pose: dict[str, tuple[float, float, float]], least: float
) -> None:
    share = volume(human, posed(human, **pose)) / volume(human, human.rest)
    assert least < share < 1.03


def test_weights_are_smooth(human: SkinnedTemplate) -> None:
    edges = np.concatenate([human.faces[:, [0, 1]], human.faces[:, [1, 2]]])
    steps = np.abs(human.weights[edges[:, 0]] - human.weights[edges[:, 1]]).max(axis=1)
    assert steps.max() < 0.6
    assert np.quantile(steps, 0.99) < 0.35
