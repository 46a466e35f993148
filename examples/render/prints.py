"""Prints on cartons: albedo pictures of text, logos, photographs, barcodes and stripes along the edges."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Sheet = NDArray[np.uint8]  # albedo in 255ths
LETTERS = np.array(list("ABCDEFGHIKLMNOPRSTUVWXYZ0123456789"))
FONTS = (cv2.FONT_HERSHEY_SIMPLEX, cv2.FONT_HERSHEY_DUPLEX, cv2.FONT_HERSHEY_TRIPLEX, cv2.FONT_HERSHEY_COMPLEX)


def draw_print(kind: str, width: float, height: float, rng: np.random.Generator) -> Array:
    """Albedo (rows from the top) of a face of width x height mm: `kind` is a key of `PRINTS`, or "mixed"."""
    pixels_mm = min(6.0, 1400 / max(width, height))
    shape = max(8, round(height * pixels_mm)), max(8, round(width * pixels_mm))
    ground = rng.uniform(0.55, 0.85) if rng.random() < 0.7 else rng.uniform(0.06, 0.35)
    sheet = np.full(shape, round(255 * ground), np.uint8)
    kinds = [kind] if kind != "mixed" else list(rng.permutation(list(PRINTS))[: rng.integers(2, 4)])
    for one in sorted(kinds, key=lambda k: k != "photograph"):  # a photograph is the ground of the others
        PRINTS[one](sheet, pixels_mm, rng)
    return np.clip(sheet / 255, 0.03, 0.9)


def _ink(sheet: Sheet, rng: np.random.Generator) -> int:
    """A tone that shows on the sheet."""
    ground = float(np.median(sheet)) / 255
    return round(255 * (rng.uniform(0.04, ground - 0.2) if ground > 0.45 else rng.uniform(ground + 0.25, 0.88)))


def _text(sheet: Sheet, pixels_mm: float, rng: np.random.Generator) -> None:
    """Some lines of letters and figures, a large one first."""
    height, width = sheet.shape
    y = 0.1 * height
    for line in range(int(rng.integers(3, 9))):
        word = "".join(rng.choice(LETTERS, rng.integers(4, 14)))
        font, tone = FONTS[rng.integers(len(FONTS))], _ink(sheet, rng)
        wanted = (rng.uniform(0.14, 0.28) if line == 0 else rng.uniform(0.04, 0.1)) * height
        (w, h), _ = cv2.getTextSize(word, font, 1.0, 2)
        scale = min(wanted / h, 0.9 * width / w)
        y += wanted * 1.4
        if y > 0.95 * height:
            return
        x = rng.uniform(0.04, max(0.05, 0.95 - scale * w / width)) * width
        thickness = max(1, round(scale * rng.uniform(1, 4)))
        cv2.putText(sheet, word, (round(x), round(y)), font, scale, tone, thickness, cv2.LINE_AA)


def _logo(sheet: Sheet, pixels_mm: float, rng: np.random.Generator) -> None:
    """Disks, ellipses, bars and polygons."""
    height, width = sheet.shape
    for _ in range(int(rng.integers(4, 9))):
        at = rng.uniform(0.15, 0.85, 2) * [width, height]
        size, tone = rng.uniform(0.1, 0.35, 2) * min(width, height), _ink(sheet, rng)
        thickness = -1 if rng.random() < 0.6 else max(2, round(pixels_mm * rng.uniform(0.6, 3)))
        turn = rng.uniform(0, 180)
        centre = (round(at[0]), round(at[1]))
        if rng.random() < 0.5:
            cv2.ellipse(sheet, centre, (round(size[0]), round(size[1])), turn, 0, 360, tone, thickness, cv2.LINE_AA)
            continue
        corners = cv2.boxPoints((tuple(at.tolist()), tuple((2 * size).tolist()), turn))
        if rng.random() < 0.4:
            corners = corners[:3]
        if thickness < 0:
            cv2.fillPoly(sheet, [np.round(corners).astype(np.int32)], tone, cv2.LINE_AA)
        else:
            cv2.polylines(sheet, [np.round(corners).astype(np.int32)], True, tone, thickness, cv2.LINE_AA)


def _photograph(sheet: Sheet, pixels_mm: float, rng: np.random.Generator) -> None:
    """A window of noise with the spectrum of photographs (amplitude as 1 / frequency), some with a horizon."""
    height, width = sheet.shape
    x0, y0 = (rng.uniform(0.0, 0.25, 2) * [width, height]).astype(int)
    x1, y1 = (rng.uniform(0.7, 1.0, 2) * [width, height]).astype(int)
    shape = (y1 - y0, x1 - x0)
    fy, fx = np.fft.fftfreq(shape[0])[:, None], np.fft.fftfreq(shape[1])[None]
    field = np.fft.ifft2(np.fft.fft2(rng.normal(size=shape)) / np.maximum(np.hypot(fx, fy), 2 / max(shape))).real
    field = (field - field.mean()) / field.std()
    window = 0.42 + 0.17 * field
    if rng.random() < 0.5:
        window[: int(rng.uniform(0.3, 0.6) * shape[0])] += 0.2
    sheet[y0:y1, x0:x1] = np.clip(255 * window, 10, 224)


def _barcode(sheet: Sheet, pixels_mm: float, rng: np.random.Generator) -> None:
    """A white label with bars."""
    height, width = sheet.shape
    w, h = round(rng.uniform(0.3, 0.55) * width), round(rng.uniform(0.25, 0.5) * height)
    x0, y0 = (round(rng.uniform(0.05, 0.95 - s / full) * full) for s, full in ((w, width), (h, height)))
    sheet[y0 : y0 + h, x0 : x0 + w] = 224
    module = max(2, round(0.7 * pixels_mm))
    x = x0 + 3 * module
    while x < x0 + w - 6 * module:
        bar = module * int(rng.integers(1, 4))
        sheet[y0 + h // 10 : y0 + round(0.8 * h), x : x + bar] = 13
        x += bar + module * int(rng.integers(1, 4))


def _stripes(sheet: Sheet, pixels_mm: float, rng: np.random.Generator) -> None:
    """Lines along some of the edges, 2 to 15 mm inside: rivals of the edges themselves."""
    height, width = sheet.shape
    for side in rng.permutation(4)[: rng.integers(2, 5)]:
        off, wide = (round(v * pixels_mm) for v in (rng.uniform(2, 15), rng.uniform(0.8, 5)))
        tone, vertical = _ink(sheet, rng), side % 2 == 0
        full = width if vertical else height
        low = off if side < 2 else full - off - wide
        if low > 0 and low + wide < full:
            sheet[(slice(None), slice(low, low + wide)) if vertical else slice(low, low + wide)] = tone


PRINTS = {"text": _text, "logo": _logo, "photograph": _photograph, "barcode": _barcode, "stripes": _stripes}
