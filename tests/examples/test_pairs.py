"""The committed stereo pairs: their truth, rig, prior and world files agree with each other and with the pictures."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
import yaml
from numpy.typing import NDArray

EXAMPLES = Path(__file__).parents[2] / "examples"
DEMO = EXAMPLES / "demo"
PAIRS = sorted(p.name[5:7] for p in DEMO.glob("pair_*_truth.json"))
SIDES = ("left", "right")
Array = NDArray[np.float64]


def pair(number: str) -> tuple[dict[str, Any], dict[str, Any], dict[str, Any]]:
    """Truth, rig and prior."""
    truth = json.loads((DEMO / f"pair_{number}_truth.json").read_text())
    rig, prior = (yaml.safe_load((DEMO / f"pair_{number}_{n}.yaml").read_text()) for n in ("rig", "prior"))
    return truth, rig, prior


def features(variant: str) -> list[dict[str, Any]]:
    rows: list[dict[str, Any]] = json.loads((EXAMPLES / f"bulkhead/golden/bulkhead_{variant}.json").read_text())[
        "features"
    ]
    return rows


def project(truth: dict[str, Any], side: str, points: Array) -> Array:
    """Pixels of points of the object's frame, by OpenCV; points behind the camera land far outside."""
    camera = truth["cameras"][side]
    camera_from_object = np.linalg.inv(camera["world_from_camera"]) @ np.array(truth["world_from_object"])
    local = points @ camera_from_object[:3, :3].T + camera_from_object[:3, 3]
    zero = np.zeros(3)
    found, _ = cv2.projectPoints(local, zero, zero, np.array(camera["matrix"]), np.array(camera["distortion"]))
    xy: Array = np.array(found, np.float64).reshape(-1, 2)
    # Far off the axis the distortion's polynomial folds back into the picture.
    wide = np.hypot(local[:, 0], local[:, 1]) > 0.7 * local[:, 2]
    xy[(local[:, 2] < 50) | wide] = -1e6
    return xy


def disk(image: Any, outline: Array) -> Any:
    """Grey values of the pixels within an outline (n, 2)."""
    mask = np.zeros(image.shape, np.uint8)
    cv2.fillPoly(mask, [np.round(outline).astype(np.int32)], 1)
    return image[mask > 0]


def circle(centre: list[float], radius: float, z: float) -> Array:
    t = np.linspace(0, 2 * np.pi, 48, endpoint=False)
    return np.column_stack([centre[0] + radius * np.cos(t), centre[1] + radius * np.sin(t), np.full(len(t), z)])


def test_there_are_pairs_of_both_variants_and_the_folder_is_small() -> None:
    variants = [pair(n)[0]["variant"] for n in PAIRS]
    assert variants.count("A") >= 3
    assert variants.count("B") >= 1
    sizes = [p.stat().st_size for p in DEMO.iterdir()]
    assert sum(sizes) <= 8 * 2**20
    assert max(sizes) <= 2 * 2**20


@pytest.mark.parametrize("number", PAIRS)
def test_poses_agree(number: str) -> None:
    truth, rig, prior = pair(number)
    world_from_rig = np.array(truth["world_from_rig"])
    for side in SIDES:
        camera, row = rig["cameras"][side], truth["cameras"][side]
        pose = np.array(row["world_from_camera"])
        np.testing.assert_allclose(pose[:3, :3] @ pose[:3, :3].T, np.eye(3), atol=1e-12)
        assert np.linalg.det(pose) == pytest.approx(1)
        np.testing.assert_allclose(world_from_rig @ np.array(camera["rig_from_camera"]), pose, atol=1e-9)
        assert camera["matrix"] == row["matrix"]
        assert camera["distortion"] == {"model": "opencv", "coefficients": row["distortion"]}
        assert [camera["width"], camera["height"]] == truth["image_size"]
        target = project(truth, side, np.array([truth["target_in_object"]]))[0]
        np.testing.assert_allclose(target, row["target_pixel"], atol=2e-4)
    np.testing.assert_allclose(truth["left_from_right"], rig["cameras"]["right"]["rig_from_camera"], atol=1e-9)
    np.testing.assert_array_equal(rig["cameras"]["left"]["rig_from_camera"], np.eye(4))
    assert 150 <= np.linalg.norm(np.array(truth["left_from_right"])[:3, 3]) <= 300
    world = yaml.safe_load((DEMO / ("world.yaml" if truth["variant"] == "A" else "world_B.yaml")).read_text())
    (item,) = world["objects"]
    assert (item["object"], item["variant"], item["role"]) == ("bulkhead", truth["variant"], "inspected")
    np.testing.assert_allclose(item["world_from_object"], truth["world_from_object"], atol=1e-12)
    assert np.abs(np.array(truth["world_from_object"])[:3, :3]).max() < 0.9999  # no axis lies along the world's
    error = np.linalg.inv(world_from_rig) @ np.array(prior["world_from_rig"])
    sigma = prior["sigma"]
    assert sigma["translation_mm"] == pytest.approx(15 / np.sqrt(3))
    assert sigma["rotation_deg"] == pytest.approx(1.5 / np.sqrt(3))
    assert 1 < np.linalg.norm(error[:3, 3]) < 4 * np.sqrt(3) * sigma["translation_mm"]
    angle = np.degrees(np.arccos(np.clip((np.trace(error[:3, :3]) - 1) / 2, -1, 1)))
    assert 0.1 < angle < 4 * np.sqrt(3) * sigma["rotation_deg"]


@pytest.mark.parametrize(("number", "side"), [(number, SIDES[int(number) % 2]) for number in PAIRS])
def test_holes_are_dark_where_they_project(number: str, side: str) -> None:
    truth, _, _ = pair(number)
    image = cv2.imread(str(DEMO / f"pair_{number}_{side}.png"), cv2.IMREAD_UNCHANGED)
    assert image is not None
    assert image.dtype == np.uint8
    assert image.shape == (960, 1280)
    assert 0.005 < (image == 255).mean() < 0.12
    met = 0
    for hole in features(truth["variant"]):
        if hole["kind"] != "lightening_hole":
            continue
        z = (hole["box"][2] + hole["box"][5]) / 2
        rim = project(truth, side, circle(hole["centre"], hole["radius"] + 6, z))
        if (rim < 0).any() or (rim > [1279, 959]).any():
            continue
        inner = disk(image, project(truth, side, circle(hole["centre"], 0.6 * hole["radius"], z)))
        outer = project(truth, side, circle(hole["centre"], hole["radius"] + 2.5, z))
        around = image[tuple(np.round(outer).astype(int).T[::-1])]
        assert np.percentile(inner, 90) < 70, hole["name"]
        assert np.median(around) > np.median(inner) + 40, hole["name"]
        met += 1
    assert met >= 1


@pytest.mark.parametrize("number", PAIRS)
def test_parts_in_view_are_consistent(number: str) -> None:
    truth, _, _ = pair(number)
    table = json.loads((EXAMPLES / f"bulkhead/golden/bulkhead_{truth['variant']}.json").read_text())
    known = {c["name"]: c for c in table["components"]}
    parts = {p["path"]: p for p in truth["parts_in_view"]}
    assert "BODY" in parts
    for side in SIDES:
        pixels = truth["image_size"][0] * truth["image_size"][1]
        seen = sum(p[side]["visible_px"] for p in parts.values() if side in p)
        assert seen + truth["cameras"][side]["background_share"] * pixels == pytest.approx(pixels, abs=0.6e-5 * pixels)
        for p in parts.values():
            if side in p:
                assert 0 <= p[side]["visible_px"] <= p[side]["unoccluded_px"]
                assert p[side]["visible_share"] == pytest.approx(
                    p[side]["visible_px"] / p[side]["unoccluded_px"], abs=1e-5
                )
        # A bolt or bushing whose origin projects well inside the frame must be listed; one far outside must not.
        for name, row in known.items():
            if row["product"] not in ("BOLT_M8", "BUSHING_25"):
                continue
            x, y = project(truth, side, np.array([row["origin"]]))[0]
            if 0 <= x <= 1279 and 0 <= y <= 959:
                assert side in parts[name], name
            elif not (-120 < x < 1400 and -120 < y < 1080):
                assert side not in parts.get(name, {}), name
    assert {p.split("/")[0] for p in parts} <= known.keys()
