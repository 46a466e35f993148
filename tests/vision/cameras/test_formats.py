"""Rigs in the formats of calibration programs: files by their own conventions, and relmodel's, give one truth."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
import yaml
from scipy.spatial.transform import Rotation

from relmodel.app.cli.main import main
from relmodel.arrays import Floats
from relmodel.errors import InputError, UsageError
from tests.poses import pose_of
from vision.cameras.cameras import CalibrationSigma, Rig
from vision.cameras.files import read_rig, rig_inputs, write_rig

EYE = np.eye(4).tolist()


@dataclass(frozen=True)
class Truth:
    """One camera: size, fx fy cx cy (pixel (0, 0) at its centre), OpenCV's coefficients, place from the rig, mm."""

    width: int
    height: int
    intrinsics: Floats
    distortion: Floats
    camera_from_rig: Floats


LENS = np.array([-0.2, 0.08, 1e-3, -2e-3, 0.02, 0.05, -0.02, 0.01, 2e-3, -1e-3, 5e-4, 7e-4, 0.02, -0.01])


def rig_of(cameras: int, coefficients: int, *, one_size: bool = True, own_frame: bool = False) -> list[Truth]:
    """A rig of unlike cameras; its frame is the first one's but for `own_frame`."""
    out = []
    for i in range(cameras):
        width, height = (1280, 960) if one_size else (1280 + 96 * i, 960 - 64 * i)
        pose = pose_of([-150.0 * i - 20, 7, -4 * i], [0.1, -0.03 * i, 0.05]) if i or own_frame else np.eye(4)
        intrinsics = np.array([1500.0 + 10 * i, 1490, width / 2 - 12.5, height / 2 + 9.25 * i])
        out.append(Truth(width, height, intrinsics, LENS[:coefficients] / (i + 1), pose))
    return out


def assert_is(rig: Rig, truths: list[Truth], names: list[str] | None = None) -> None:
    assert list(rig.cameras) == (names or ["left", "right", "camera_2"][: len(truths)])
    for (name, camera), t in zip(rig.cameras.items(), truths, strict=True):
        assert (camera.width, camera.height) == (t.width, t.height)
        np.testing.assert_allclose(camera.matrix, matrix3(t), rtol=0, atol=1e-10)
        lens = np.append(camera.distortion, np.zeros(14 - len(camera.distortion)))
        np.testing.assert_allclose(lens, np.append(t.distortion, np.zeros(14 - len(t.distortion))), rtol=0, atol=1e-14)
        np.testing.assert_allclose(rig.rig_from_camera[name] @ t.camera_from_rig, np.eye(4), rtol=0, atol=1e-10)


def matrix3(t: Truth) -> Floats:
    fx, fy, cx, cy = t.intrinsics
    return np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]])


def store_by_opencv(path: Path, values: dict[str, Any]) -> None:
    """YAML, XML or JSON by the suffix, YAML where there is none."""
    flags = cv2.FILE_STORAGE_WRITE | (0 if path.suffix in (".yml", ".xml", ".json") else cv2.FILE_STORAGE_FORMAT_YAML)
    file = cv2.FileStorage(str(path), flags)
    for key, value in values.items():
        file.write(key, value)
    file.release()


def size_of(t: Truth) -> dict[str, Any]:
    return {"image_width": t.width, "image_height": t.height}


def pair_of(one: Truth, other: Truth) -> tuple[dict[str, Any], dict[str, Any]]:
    """The inner and the outer numbers of a pair."""
    inner = {"M1": matrix3(one), "D1": one.distortion[None], "M2": matrix3(other), "D2": other.distortion[None]}
    return inner, {"R": other.camera_from_rig[:3, :3], "T": other.camera_from_rig[:3, 3:]}


def put_opencv(truths: list[Truth], path: Path) -> Path:
    first, *others = truths
    single = {"camera_matrix": matrix3(first), "distortion_coefficients": first.distortion[:, None]}
    inner, outer = pair_of(first, *others) if others else (single, {})
    store_by_opencv(path, size_of(first) | inner | outer)
    return path


def put_ros(truths: list[Truth], path: Path) -> Path:
    (t,) = truths
    model = "plumb_bob" if len(t.distortion) == 5 else "rational_polynomial"
    projection = np.column_stack([matrix3(t), np.zeros(3)]).ravel().tolist()
    lines = [
        f"image_width: {t.width}", f"image_height: {t.height}", "camera_name: left", "camera_matrix:", "  rows: 3",
        "  cols: 3", f"  data: {matrix3(t).ravel().tolist()}", f"distortion_model: {model}",
        "distortion_coefficients:", "  rows: 1", f"  cols: {len(t.distortion)}", f"  data: {t.distortion.tolist()}",
        "rectification_matrix: {rows: 3, cols: 3, data: [1, 0, 0, 0, 1, 0, 0, 0, 1]}",
        f"projection_matrix: {{rows: 3, cols: 4, data: {projection}}}",
    ]  # fmt: skip
    path.write_text("\n".join(lines))
    return path


def put_kalibr(truths: list[Truth], path: Path) -> Path:
    lines = []
    for i, t in enumerate(truths):
        lines += [f"cam{i}:", f"  cam_overlaps: [{1 - i}]", "  camera_model: pinhole", "  distortion_model: radtan"]
        lines += [f"  distortion_coeffs: {t.distortion.tolist()}", f"  intrinsics: {t.intrinsics.tolist()}"]
        lines += [f"  resolution: [{t.width}, {t.height}]", f"  rostopic: /cam{i}/image_raw"]
        if i:
            before = truths[i - 1].camera_from_rig
            lines += ["  T_cn_cnm1:", *rows_in_metres(t.camera_from_rig @ np.linalg.inv(before))]
        if not np.array_equal(truths[0].camera_from_rig, np.eye(4)):
            lines += ["  T_cam_imu:", *rows_in_metres(t.camera_from_rig)]
    path.write_text("\n".join(lines))
    return path


def rows_in_metres(pose: Floats) -> list[str]:
    scaled = pose.copy()
    scaled[:3, 3] /= 1000
    return [f"  - {row}" for row in scaled.tolist()]


def quaternion_pose(pose: Floats) -> str:
    x, y, z, w = Rotation.from_matrix(pose[:3, :3]).as_quat().tolist()
    return " ".join(map(repr, [w, x, y, z, *pose[:3, 3].tolist()]))


def colmap_line(number: int, t: Truth) -> str:
    fx, fy, cx, cy = t.intrinsics.tolist()
    model = {0: "PINHOLE", 4: "OPENCV", 8: "FULL_OPENCV"}[len(t.distortion)]
    # Its pixel (0.5, 0.5) is the centre of the first.
    values = [fx, fy, cx + 0.5, cy + 0.5, *t.distortion.tolist()]
    return f"{number} {model} {t.width} {t.height} {' '.join(map(repr, values))}"


def put_colmap(truths: list[Truth], folder: Path) -> Path:
    """With images.txt: each camera's image, in a world of its own place."""
    folder.mkdir()
    names = ["left", "right", "camera_2"]
    cameras = ["# Camera list", "#   CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]"]
    images = ["# Image list with two lines of data per image:"]
    for i, t in enumerate(truths):
        cameras.append(colmap_line(5 + 3 * i, t))
        images += [f"{9 - i} {quaternion_pose(t.camera_from_rig)} {5 + 3 * i} {names[i]}/0001.png", "10.5 20.5 -1"]
    (folder / "cameras.txt").write_text("\n".join(cameras) + "\n")
    (folder / "images.txt").write_text("\n".join(images) + "\n")
    return folder


def put_colmap_rig(truths: list[Truth], folder: Path) -> Path:
    """With rigs.txt, and images of many shots."""
    put_colmap(truths, folder)
    again = (folder / "images.txt").read_text().replace("0001.png", "0002.png").splitlines()[1:]
    (folder / "images.txt").write_text((folder / "images.txt").read_text() + "\n".join(again) + "\n")
    sensors = [f"CAMERA {5 + 3 * i} 1 {quaternion_pose(t.camera_from_rig)}" for i, t in enumerate(truths) if i]
    line = f"1 {len(truths)} CAMERA 5 {' '.join(sensors)}"
    (folder / "rigs.txt").write_text(f"# Rig calib list\n{line}\n")
    return folder / "cameras.txt"


Put = Callable[[list[Truth], Path], Path]
# Who writes it, cameras, coefficients, cameras of one size, frame that is not the first camera's.
READ: list[tuple[Put, int, int, bool, bool]] = [
    (put_opencv, 1, 5, True, False),
    (put_opencv, 2, 8, True, False),
    *((put_ros, 1, count, True, False) for count in (5, 8, 12, 14)),
    (put_kalibr, 1, 4, True, False),
    (put_kalibr, 2, 4, False, False),
    (put_kalibr, 3, 4, False, True),
    (put_colmap, 1, 0, True, False),
    (put_colmap, 2, 4, False, True),
    (put_colmap_rig, 3, 8, False, False),
]


@pytest.mark.parametrize(("put", "cameras", "coefficients", "one_size", "own_frame"), READ)
def test_one_truth_through_each_format(
    put: Put, cameras: int, coefficients: int, one_size: bool, own_frame: bool, tmp_path: Path
) -> None:
    truths = rig_of(cameras, coefficients, one_size=one_size, own_frame=own_frame)
    given = put(truths, tmp_path / "given.data")  # the name says nothing
    rig = read_rig(given)
    assert_is(rig, truths)
    assert all(file.is_file() for file in rig_inputs(given).values())
    write_rig(rig, tmp_path / "own")
    assert_is(read_rig(tmp_path / "own"), truths)


@pytest.mark.parametrize(
    ("error", "views"), [("avg_reprojection_error", "nframes"), ("Avg_Reprojection_Error", "nr_of_frames")]
)
def test_what_opencv_says_of_its_calibration_is_its_sigma(error: str, views: str, tmp_path: Path) -> None:
    truths = rig_of(2, 5)
    text = put_opencv(truths, tmp_path / "cv").read_text()
    assert read_rig(tmp_path / "cv").sigma == {}
    (tmp_path / "cv").write_text(f"{text}{error}: 0.32\n{views}: 16\n")
    sigma = read_rig(tmp_path / "cv").sigma
    assert sigma["left"] == CalibrationSigma.of_views(0.32, 16, truths[0].intrinsics[0]).at(np.eye(4))
    assert sigma["right"].translation_mm == pytest.approx(0.16)


@pytest.mark.parametrize(
    ("model", "values", "intrinsics", "distortion"),
    [
        ("SIMPLE_PINHOLE", [900, 640.5, 480.5], [900, 900, 640, 480], []),
        ("SIMPLE_RADIAL", [900, 640.5, 480.5, -0.1], [900, 900, 640, 480], [-0.1, 0, 0, 0]),
        ("RADIAL", [900, 640.5, 480.5, -0.1, 0.02], [900, 900, 640, 480], [-0.1, 0.02, 0, 0]),
    ],
)
def test_short_models_of_colmap(
    model: str, values: list[float], intrinsics: list[float], distortion: list[float], tmp_path: Path
) -> None:
    (tmp_path / "cameras.txt").write_text(f"1 {model} 1280 960 {' '.join(map(str, values))}\n")
    assert_is(read_rig(tmp_path), [Truth(1280, 960, np.array(intrinsics, float), np.array(distortion), np.eye(4))])


def test_kalibr_by_its_inertial_unit_alone(tmp_path: Path) -> None:
    """As OpenVINS writes it: OpenCV's header, T_imu_cam, no chain."""
    truths = rig_of(2, 4, own_frame=True)
    said = yaml.safe_load(put_kalibr(truths, tmp_path / "k").read_text())
    for i, t in enumerate(truths):
        pose = np.linalg.inv(t.camera_from_rig)
        pose[:3, 3] /= 1000
        said[f"cam{i}"] |= {"T_imu_cam": pose.tolist()}
        for key in ("T_cam_imu", "T_cn_cnm1"):
            said[f"cam{i}"].pop(key, None)
    (tmp_path / "k").write_text("%YAML:1.0\n\n" + yaml.safe_dump(said))
    assert_is(read_rig(tmp_path / "k"), truths)


def test_a_unit_that_the_file_does_not_say(tmp_path: Path) -> None:
    truths = rig_of(2, 5)
    metres = truths[1].camera_from_rig.copy()
    metres[:3, 3] /= 1000
    put_opencv([truths[0], Truth(1280, 960, truths[1].intrinsics, truths[1].distortion, metres)], tmp_path / "cv")
    with pytest.raises(InputError, match=r"0\.\d+ mm apart.*--unit"):
        read_rig(tmp_path / "cv")
    assert_is(read_rig(tmp_path / "cv", unit_mm=1000), truths)
    with pytest.raises(UsageError, match="own unit"):
        read_rig(put_kalibr(rig_of(2, 4), tmp_path / "k"), unit_mm=1000)


ROS = {
    "image_width": 640, "image_height": 480, "camera_name": "left", "distortion_model": "plumb_bob",
    "camera_matrix": {"rows": 3, "cols": 3, "data": [700.0, 0, 320, 0, 700, 240, 0, 0, 1]},
    "distortion_coefficients": {"rows": 1, "cols": 5, "data": [0.0] * 5},
}  # fmt: skip
KALIBR_CAMERA = {
    "camera_model": "pinhole", "intrinsics": [700.0, 700, 320, 240], "distortion_model": "radtan",
    "distortion_coeffs": [0.0] * 4, "resolution": [640, 480],
}  # fmt: skip
KALIBR = {"cam0": KALIBR_CAMERA, "cam1": KALIBR_CAMERA | {"T_cn_cnm1": EYE}}
APART = KALIBR | {"cam1": KALIBR_CAMERA | {"T_cn_cnm1": (np.eye(4) + np.eye(4, k=3) * 0.1).tolist()}}
CV = (
    "%YAML:1.0\n---\nimage_width: 640\nimage_height: 480\n"
    "M1: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   data: [ 700., 0., 320., 0., 700., 240., 0., 0., 1. ]\n"
    "D1: !!opencv-matrix\n   rows: 1\n   cols: 5\n   dt: d\n   data: [ 0., 0., 0., 0., 0. ]\n"
)
ONE = CV.replace("M1", "camera_matrix").replace("D1", "distortion_coefficients")


OTHERS = ("xi: 0.9", "is_fisheye: true", "fisheye: 1", "fisheye: {k1: 0.1}")  # omnidir::calibrate says but its xi
CUT = {"x_offset": 1, "width": 639, "height": 240}
WHOLE = {"x_offset": 0, "y_offset": 0, "width": 640, "height": 480}


def dumped(data: dict[str, Any], **other: Any) -> str:
    return yaml.safe_dump(data | other)


POSE = (
    "!!opencv-matrix\n   rows: 4\n   cols: 4\n   dt: d\n   data: [ 1., 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1 ]\n"
)
KITTI = "P0: 7.2e+02 0.0e+00 6.1e+02 0.0e+00 0.0e+00 7.2e+02 1.7e+02 0.0e+00 0.0e+00 0.0e+00 1.0e+00 0.0e+00\n"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (dumped({k: v for k, v in ROS.items() if k != "image_height"}), "'image_height' is missing"),
        (dumped(ROS, camera_matrix={"data": [0.0] * 9}), "not calibrated"),
        (dumped(ROS, camera_matrix={"data": [700.0, 0, 320]}), "size 3: give 9 numbers"),
        (dumped(ROS, binning_x=2), "binned"),
        *(
            (dumped(ROS, roi=WHOLE | cut), "roi names a part")
            for cut in ({"x_offset": 1}, {"width": 639}, {"height": 240})
        ),
        (dumped(ROS, distortion_coefficients={"data": [0.1] * 8}), "plumb_bob has 4 or 5 coefficients, not 8"),
        (dumped(KALIBR, cam1=KALIBR_CAMERA), "cam1.T_cn_cnm1' is missing"),
        (dumped(KALIBR, cam0=KALIBR_CAMERA | {"resolution": [640]}), "resolution is"),
        (dumped(KALIBR, cam0=KALIBR_CAMERA | {"T_cam_imu": EYE}), "cam1 has no T_cam_imu"),
        (dumped({name: camera | {"T_cam_imu": EYE} for name, camera in APART.items()}), "place it apart"),
        (CV, "'M2' is missing"),
        (CV.replace("image_width: 640\n", ""), "'image_width' is missing"),
        (ONE + "fisheye_model: 1\n", "fisheye_model is 1"),
        *((f"{ONE}{line}\n", "a lens that a rig does not hold") for line in OTHERS),
        (CV.replace("M1", "M2").replace("D1", "D2") + CV[CV.index("M1") :], "R and T of the pair are missing"),
        (ONE.replace("rows: 3", "rows: 4"), "camera_matrix is not a matrix"),
        (ONE.replace("700., 0.,", "700., 3.,"), "skew 3"),
        (ONE.replace("cols: 5", "cols: 3").replace("0., 0., 0., 0., 0.", "0., 0., 0."), "has 3 numbers"),
        (ONE.replace("700., 0.,", ".NaN, 0.,"), "finite"),
        ("1 PINHOLE 640 480 700 700 320\n", "3 parameters, and PINHOLE 4"),
        ("1 PINHOLE 640 480 700 x 320 240\n", "not made of numbers"),
        ("1 PINHOLE 640 480 700 700 320 240\n2 PINHOLE 640 480 700 700 320 240\n", "2 cameras"),
        ("1 PINHOLE 0 480 700 700 320 240\n", "whole number"),
        # Files of other programs.
        (f"%YAML:1.0\nimu: 1\ncam0_calib: \"a.yaml\"\nbody_T_cam0: {POSE}image_width: 640\n", "VINS.*Kalibr"),
        ("%YAML:1.0\nrelative_config_imucam: \"kalibr_imucam_chain.yaml\"\n", "OpenVINS.*kalibr_imucam_chain"),
        ("cameras:\n     - {T_SC: [1.0, 0.0], image_dimension: [752, 480]}\n", "OKVIS"),
        ('{"width": 640, "height": 480, "ppx": 320.1, "ppy": 240.2, "fx": 600.0, "coeffs": [0]}', "RealSense"),
        ('{"0": {"cam_K": [700, 0, 320, 0, 700, 240, 0, 0, 1], "depth_scale": 0.1}}', "BOP"),
        (KITTI + KITTI.replace("P0", "P1"), "KITTI"),
        ("%YAML:1.0\nsensor_type: camera\nT_BS: {rows: 4, cols: 4}\nintrinsics: [458, 457, 367, 248]\n", "EuRoC"),
        ('{"value0": {"T_imu_cam": [], "intrinsics": [{"camera_type": "ds", "intrinsics": {}}]}}', "Basalt"),
        ("%YAML:1.0\nCamera.type: \"PinHole\"\nCamera.fx: 458.6\nCamera.fy: 457.3\n", "ORB-SLAM"),
        ("%YAML:1.0\nCamera1.fx: 458.6\nCamera2.fx: 457.6\nStereo.b: 0.11\n", "ORB-SLAM"),
        ('<?xml version="1.0"?>\n<root><camera><model><type>perspectiveProjWithDistortion</type></model></camera>'
         "</root>", "ViSP.*px, py, u0, v0"),
        ("<opencv_storage><image_width>640", "not valid XML"),
    ],
)  # fmt: skip
def test_what_a_rig_cannot_hold_is_named(text: str, message: str, tmp_path: Path) -> None:
    (tmp_path / "file").write_text(text)
    with pytest.raises(InputError, match=message) as caught:
        read_rig(tmp_path / "file")
    assert "\n" not in str(caught.value)


def test_damaged_files_are_refused_in_a_sentence(tmp_path: Path) -> None:
    """Files cut and changed at random are read or refused; nothing else happens."""
    rng = np.random.default_rng(0)
    folder = put_colmap_rig(rig_of(2, 4), tmp_path / "colmap").parent
    good = {
        "opencv": put_opencv(rig_of(2, 5), tmp_path / "cv").read_text(),
        "ros": dumped(ROS),
        "kalibr": dumped(KALIBR),
        "colmap": (folder / "rigs.txt").read_text(),
    }
    for suffix in ("xml", "json"):
        put_pair(rig_of(2, 5), tmp_path / suffix, f".{suffix}", sized=True)
        good[suffix] = (tmp_path / suffix / f"intrinsics.{suffix}").read_text()
    said: list[str] = []
    for form, text in good.items():
        for _ in range(20):
            start = int(rng.integers(0, len(text)))
            put = rng.choice(["", "x", "[", "1e999", ": ", "-", "\n", "99999999999999999999"])
            broken = text[:start] + put + text[start + int(rng.integers(0, 40)) :]
            file = folder / "rigs.txt" if form == "colmap" else tmp_path / "broken"
            file.write_text(broken)
            try:
                read_rig(folder if form == "colmap" else file)
            except InputError as error:
                said.append(str(error))
    assert len(said) > 50
    assert not any("\n" in sentence for sentence in said)


def test_the_verb_converts_and_shows(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    truths = rig_of(2, 4)
    given = put_kalibr(truths, tmp_path / "chain.yaml")
    source = tmp_path / "rig.yaml"
    assert main(["rig", "convert", str(given), str(source)]) == 0
    assert_is(read_rig(source), truths)
    assert main(["rig", "show", str(source), "--format", "csv"]) == 0
    shown = capsys.readouterr().out.splitlines()
    assert [line.split(",")[:3] for line in shown[1:]] == [["left", "1280", "960"], ["right", "1280", "960"]]
    assert main(["rig", "convert", str(source)]) == 2


MESSAGE = (
    "header: {frame_id: optical}\nheight: 480\nwidth: 640\ndistortion_model: plumb_bob\n"
    "d: [-0.1, 0.05, 0.0, 0.0, 0.0]\nk: [700.0, 0, 320, 0, 700, 240, 0, 0, 1]\nbinning_x: 1\nbinning_y: 1\n"
)


@pytest.mark.parametrize(
    "text",
    [
        MESSAGE,
        MESSAGE + "---\n",
        "---\n" + MESSAGE + "---\n" + MESSAGE + "---\nheader: {fra",
        MESSAGE + "roi: {x_offset: 0, y_offset: 0, height: 480, width: 640, do_rectify: false}\n---\n",
        MESSAGE.replace("distortion_model: plumb_bob\n", ""),
        MESSAGE.replace("plumb_bob", "rational_polynomial"),
        MESSAGE.replace("0.0]", "0.0, 0.0, 0.0, 0.0]"),
    ],
)
def test_what_a_topic_says(text: str, tmp_path: Path) -> None:
    (tmp_path / "echo").write_text(text)
    lens = np.array([-0.1, 0.05, 0, 0, 0])
    assert_is(read_rig(tmp_path / "echo"), [Truth(640, 480, np.array([700.0, 700, 320, 240]), lens, np.eye(4))])


def put_pair(truths: list[Truth], folder: Path, suffix: str, *, sized: bool) -> None:
    """As OpenCV's sample stereo_calib.cpp does."""
    folder.mkdir()
    inner, outer = pair_of(*truths)
    wrong = np.full((3, 3), 9.0)  # what rectified pictures need, and we do not
    store_by_opencv(folder / f"intrinsics{suffix}", inner | (size_of(truths[0]) if sized else {}))
    store_by_opencv(folder / f"extrinsics{suffix}", outer | {"R1": wrong, "P1": wrong})


@pytest.mark.parametrize("suffix", [".yml", ".xml", ".json"])
@pytest.mark.parametrize("named", ["", "extrinsics"])
def test_a_pair_in_two_files_of_opencv(suffix: str, named: str, tmp_path: Path) -> None:
    truths = rig_of(2, 5)
    put_pair(truths, tmp_path / "cv", suffix, sized=True)
    path = tmp_path / "cv" / f"{named}{suffix}" if named else tmp_path / "cv"
    assert_is(read_rig(path), truths)
    assert {file.name for file in rig_inputs(path).values()} == {f"intrinsics{suffix}", f"extrinsics{suffix}"}
    assert_is(read_rig(path, size=(640, 480)), truths)


def test_a_pair_that_does_not_say_its_size(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    truths = rig_of(2, 8)
    put_pair(truths, tmp_path / "cv", ".yml", sized=False)
    with pytest.raises(InputError, match=r"'image_width' is missing.*--size"):
        read_rig(tmp_path / "cv")
    convert = ["rig", "convert", str(tmp_path / "cv"), str(tmp_path / "rig.yaml"), "--size"]
    assert main([*convert, "1280"]) == 2
    assert "1280 is no size" in capsys.readouterr().err
    assert main([*convert, "1280x960"]) == 0
    assert_is(read_rig(tmp_path / "rig.yaml"), truths)
    (tmp_path / "cv" / "extrinsics.yml").unlink()
    with pytest.raises(InputError, match=r"extrinsics\.yml beside"):
        read_rig(tmp_path / "cv", size=(1280, 960))


def test_a_size_that_the_file_does_not_say_has_the_principal_point_near_its_middle(tmp_path: Path) -> None:
    """Within 15 % of it."""
    pair = [replace(it, intrinsics=np.array([1500.0, 1500.0, 639.5, 479.5])) for it in rig_of(2, 5)]
    put_pair(pair, tmp_path / "cv", ".yml", sized=False)
    for width, fits in ((1820, True), (1840, False), (990, True), (980, False)):
        if fits:
            assert read_rig(tmp_path / "cv", size=(width, 960)).cameras["left"].width == width
            continue
        with pytest.raises(InputError, match=f"in {width}x960 px the principal point of camera left lies 15%"):
            read_rig(tmp_path / "cv", size=(width, 960))


def test_file_storage_with_the_keys_of_interactive_calibration(tmp_path: Path) -> None:
    (truth,) = rig_of(1, 14)
    file = cv2.FileStorage(str(tmp_path / "cv"), cv2.FILE_STORAGE_WRITE | cv2.FILE_STORAGE_FORMAT_XML)
    file.write("calibration_time", "Thu 01 Jan 2026 10:00:00 AM: <none> & 7")
    file.startWriteStruct("cameraResolution", cv2.FileNode_SEQ | cv2.FileNode_FLOW)
    file.write("", truth.width)
    file.write("", truth.height)
    file.endWriteStruct()
    file.write("cameraMatrix", matrix3(truth))
    file.write("dist_coeffs", truth.distortion[None])
    file.release()
    assert_is(read_rig(tmp_path / "cv"), [truth])


OWN_CAMERA = {"width": 640, "height": 480, "matrix": [[700, 0, 320], [0, 700, 240], [0, 0, 1]], "rig_from_camera": EYE}
OWN_LENS = {"coefficients": [-0.01, 0.02, -0.01, 0.003]}
OTHER_LENSES = ["equidistant", "FISHEYE", "fish-eye", "KannalaBrandt8", "omni-radtan", "mei", "ds"]
OTHER_LENSES += ["inverse_brown_conrady"]


@pytest.mark.parametrize("value", OTHER_LENSES)
def test_a_lens_model_is_never_ignored(value: str, tmp_path: Path) -> None:
    """In any format, under any key that names one."""
    texts = [dumped({"cameras": {"a": OWN_CAMERA | {"distortion": OWN_LENS | {"model": value}}}})]
    for key in ("distortion_model", "camera_model", "model", "model_type", "projection", "calibrationModel"):
        texts.append(ONE + f"{key}: {value}\n")
        texts.append(dumped(ROS | {key: value}))
        texts.append(dumped({"cam0": KALIBR_CAMERA | {key: value}}))
        texts.append(dumped({"cameras": {"a": OWN_CAMERA | {"distortion": OWN_LENS, key: value}}}))
    texts.append(dumped({"cameras": {"a": OWN_CAMERA}, "lens": {"model": value}}))
    for text in texts:
        (tmp_path / "file").write_text(text)
        with pytest.raises(InputError, match=f"is '{value}'") as caught:
            read_rig(tmp_path / "file")
        assert "opencv (k1 k2" in str(caught.value), text
    (tmp_path / "cameras.txt").write_text(f"1 {value.upper().replace('-', '_')} 640 480 700 700 320 240 0 0 0 0\n")
    with pytest.raises(InputError, match="which a rig does not hold"):
        read_rig(tmp_path / "cameras.txt")


def test_names_that_are_no_lens_model(tmp_path: Path) -> None:
    lines = "distortion_model: plumb_bob\ncamera_model: pinhole\nmodel: Radial-Tangential\nis_fisheye: false\nxi: 0\n"
    lines += "fisheye_model: 0\ncamera_name: fisheye_left\nsensor_model: OmniVision OV9281\nimu0: {model: calibrated}\n"
    lines += "mirrored: true\ncamera_type: stereocamera\nstereocam: 1\n"
    (tmp_path / "cv").write_text(ONE + lines)
    assert list(read_rig(tmp_path / "cv").cameras) == ["left"]
    (tmp_path / "own").write_text(dumped({"cameras": {"fisheye_left": OWN_CAMERA, "omni": OWN_CAMERA}}))
    assert list(read_rig(tmp_path / "own").cameras) == ["fisheye_left", "omni"]


def test_binary_models_of_colmap_and_folders_without_a_rig(tmp_path: Path) -> None:
    for name in ("cameras.bin", "images.bin"):
        (tmp_path / name).write_bytes(b"\2\0\0\0\0\0\0\0\xff")
    for path in (tmp_path, tmp_path / "images.bin"):
        for read in (read_rig, rig_inputs):
            with pytest.raises(InputError, match="binary model: write it as text by colmap model_converter"):
                read(path)
    (tmp_path / "images.txt").write_text("1 1 0 0 0 0 0 0 1 a.png\n\n")
    with pytest.raises(InputError, match="holds no camera: name its folder"):
        read_rig(tmp_path / "images.txt")
    (tmp_path / "empty").mkdir()
    with pytest.raises(InputError, match=r"holds neither cameras\.txt nor intrinsics\.yml"):
        read_rig(tmp_path / "empty")
