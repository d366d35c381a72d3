"""Encoded images into grey ones: formats, depths, and files that are no images."""

from __future__ import annotations

import os
import struct
import zlib

import cv2
import numpy as np
import pytest

from handeye_cli import images
from handeye_cli.errors import InputError
from handeye_cli.images import ImageFile, decode_grey


def encoded(image, ending=".png"):
    return cv2.imencode(ending, image)[1].tobytes()


@pytest.fixture
def grey():
    ramp = np.arange(40 * 60).reshape(40, 60)
    return (ramp % 256).astype(np.uint8)


@pytest.mark.parametrize("ending", [".png", ".pgm", ".tiff", ".bmp"])
def test_lossless_grey_images_come_back_exactly(grey, ending):
    decoded = decode_grey(encoded(grey, ending), "x")
    assert decoded.dtype == np.uint8
    np.testing.assert_array_equal(decoded, grey)


def test_jpeg_comes_back_nearly(grey):
    smooth = cv2.GaussianBlur(grey, (0, 0), 8)
    decoded = decode_grey(encoded(smooth, ".jpg"), "x")
    assert np.abs(decoded.astype(int) - smooth).max() <= 6


def test_colour_becomes_luminance_and_transparency_is_dropped(grey):
    rng = np.random.default_rng(1)
    colour = rng.integers(0, 256, (20, 30, 3), dtype=np.uint8)
    luminance = colour @ np.array([0.114, 0.587, 0.299])
    clear = np.dstack([colour, np.zeros((20, 30), dtype=np.uint8)])
    for image in (colour, clear):
        found = decode_grey(encoded(image), "x").astype(float)
        # decoders differ in the last bits of the weights
        assert np.abs(found - luminance).max() <= 2.0
    np.testing.assert_array_equal(decode_grey(encoded(np.dstack([grey] * 3)), "x"), grey)


@pytest.mark.parametrize("bits", [8, 10, 12, 14, 16])
def test_the_full_range_of_a_deep_image_becomes_eight_bits(bits):
    full = 2**bits - 1
    deep = np.linspace(0, full, 400).round().astype(np.uint16).reshape(20, 20)
    expected = deep.astype(float) * 255.0 / full
    for image in (deep, np.dstack([deep] * 3)):
        found = decode_grey(encoded(image), "x")
        assert found.dtype == np.uint8
        assert np.abs(found - expected).max() <= (0.5 if image.ndim == 2 else 1.0) + 1e-9


def test_a_black_deep_image_stays_black():
    assert decode_grey(encoded(np.zeros((4, 5), dtype=np.uint16)), "x").max() == 0


def png_header(width, height):
    chunk = b"IHDR" + struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    checksum = struct.pack(">I", zlib.crc32(chunk))
    return b"\x89PNG\r\n\x1a\n" + struct.pack(">I", len(chunk) - 4) + chunk + checksum


def jpeg_header(width, height):
    comment = b"\xff\xfe\x00\x06abcd\xff"
    return b"\xff\xd8" + comment + b"\xff\xc2\x00\x0b\x08" + struct.pack(">HH", height, width)


@pytest.mark.parametrize("header", [png_header, jpeg_header])
def test_a_size_in_the_header_is_refused_before_decoding(header, monkeypatch):
    def never(*_):
        pytest.fail("the image was decoded")

    monkeypatch.setattr(cv2, "imdecode", never)
    with pytest.raises(InputError, match="at most 200 megapixels, found 20000 x 10001"):
        decode_grey(header(20000, 10001), "big")


def test_a_size_only_the_decoder_knows_is_refused(grey, monkeypatch):
    monkeypatch.setattr(images, "MAX_PIXELS", 100)
    with pytest.raises(InputError, match="found 60 x 40"):
        decode_grey(encoded(grey, ".bmp"), "x")


def test_the_size_in_the_header_is_that_of_the_image(grey):
    for ending in (".png", ".jpg"):
        assert images._size_in_header(encoded(grey, ending)) == (60, 40)


@pytest.mark.parametrize(
    "data",
    [b"not an image", b"\x89PNG\r\n\x1a\n", b"\xff\xd8\xff", b"\xff\xd8" + b"\xff" * 50, b"P5 9"],
)
def test_what_is_no_image_is_refused_with_its_name(data):
    with pytest.raises(InputError, match=f"found {len(data)} bytes|cannot be decoded") as caught:
        decode_grey(data, "images/7.png")
    assert caught.value.where == "images/7.png"


def test_an_image_of_floats_is_refused():
    with pytest.raises(InputError, match="8 or 16 bits, found one of float32"):
        decode_grey(encoded(np.zeros((4, 4), dtype=np.float32), ".tiff"), "x")


def test_image_file_loads_when_asked(tmp_path, grey):
    source = ImageFile(tmp_path / "0.png", "images/0.png")
    with pytest.raises(InputError, match="No such file") as caught:
        source.load()
    assert caught.value.where == "images/0.png"
    source.path.write_bytes(encoded(grey))
    np.testing.assert_array_equal(source.load(), grey)


def test_what_is_no_image_file_is_refused(tmp_path, monkeypatch):
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "empty").touch()
    (tmp_path / "large").write_bytes(bytes(100))
    monkeypatch.setattr(images, "MAX_BYTES", 99)
    for name, message in (
        ("", "found a folder"),
        ("pipe", "found a device or pipe"),
        ("empty", "found no data"),
        ("large", "at most 0 GB"),
        ("a\0b", "null"),
    ):
        with pytest.raises(InputError, match=message):
            ImageFile(tmp_path / name, "x").load()
