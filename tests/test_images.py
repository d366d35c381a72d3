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
from handeye_cli.image_headers import require_sound, stated_size
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


def chunk(name, content=b""):
    checksum = struct.pack(">I", zlib.crc32(name + content))
    return struct.pack(">I", len(content)) + name + content + checksum


def png_header(width, height, depth=8, colour=0, rest=(0, 0, 0)):
    fields = struct.pack(">IIBBBBB", width, height, depth, colour, *rest)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", fields)


def png(*chunks, header=None, rows=(bytes(range(16)),) * 8):
    """A PNG of 16 x 8 with more chunks before its pixels, written without OpenCV."""
    pixels = zlib.compress(b"".join(b"\0" + row for row in rows))
    whole = [header or png_header(16, 8), *chunks, chunk(b"IDAT", pixels), chunk(b"IEND")]
    return b"".join(whole)


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


def test_an_image_of_moderate_size_may_be_too_long():
    with pytest.raises(
        InputError, match="x: expected sides of at most 32766 pixels, found 40000 x 9"
    ):
        decode_grey(png_header(40000, 9), "x")


def test_a_size_only_the_decoder_knows_is_refused(grey, monkeypatch):
    monkeypatch.setattr(images, "MAX_PIXELS", 100)
    with pytest.raises(InputError, match="found 60 x 40"):
        decode_grey(encoded(grey, ".bmp"), "x")


@pytest.mark.parametrize("ending", [".png", ".jpg", ".tiff"])
def test_the_size_in_the_header_is_that_of_the_image(grey, ending):
    assert stated_size(encoded(grey, ending)) == (60, 40)


RAMP = np.tile(np.arange(16, dtype=np.uint8), (8, 1))
PALETTE = bytes(level for index in range(16) for level in (10 * index, 100, 7))
ODD_PNG = {
    "metadata-broken": (png(chunk(b"gAMA", b"\0"), chunk(b"iCCP", b"x\0\0bad")), RAMP),
    "transparent": (png(chunk(b"tRNS", b"\0\3")), RAMP),
    "bytes-after-it": (png() + b"more", RAMP),
    "one-frame": (png(chunk(b"acTL", struct.pack(">II", 1, 0))), RAMP),
    "palette": (
        png(chunk(b"PLTE", PALETTE), header=png_header(16, 8, 8, 3)),
        0.299 * 10 * RAMP + 0.587 * 100 + 0.114 * 7,
    ),
    "black-and-white": (
        png(header=png_header(16, 8, 1), rows=[b"\xaa\xf0"] * 8),
        np.tile(255 * np.unpackbits(np.array([0xAA, 0xF0], dtype=np.uint8)), (8, 1)),
    ),
    "one-pixel": (png(header=png_header(1, 1), rows=[b"\7"]), [[7]]),
}


@pytest.mark.parametrize("row", ODD_PNG)
def test_an_odd_png_is_read_without_a_word(row, capfd):
    data, expected = ODD_PNG[row]
    np.testing.assert_allclose(decode_grey(data, "x"), expected, atol=1.0)
    assert capfd.readouterr().err == ""


NOISE = np.random.default_rng(3).integers(0, 256, (24, 32), dtype=np.uint8)
JPEG = encoded(NOISE, ".jpg")
PAGES = cv2.imencodemulti(".tiff", [NOISE] * 3)[1].tobytes()
WHOLE = png()
FLIPPED = WHOLE[:-14] + b"\0\0" + WHOLE[-12:]  # in the checksum of the pixels
FAULTS = {
    "png-cut": (WHOLE[:60], "60 bytes that cannot .* it is cut off, of its part 'IDAT' there are"),
    "png-no-end": (WHOLE[:-12], "it is cut off before its end chunk"),
    "png-flipped": (FLIPPED, "its part 'IDAT' at byte 33 has a wrong checksum"),
    "png-no-pixels": (png_header(9, 9) + chunk(b"IEND"), "it has no part 'IDAT'"),
    "png-no-palette": (png(header=png_header(16, 8, 8, 3)), "it has no part 'PLTE'"),
    "png-foreign": (png(chunk(b"ABCD")), "standard PNG, found the part 'ABCD'"),
    "png-of-a-phone": (WHOLE[:8] + chunk(b"CgBI") + WHOLE[8:], "found the part 'CgBI'"),
    "png-depth": (png(header=png_header(16, 8, 3)), "found 3 bits of colour type 0"),
    "png-method": (png(header=png_header(16, 8, 8, 0, (0, 1, 0))), r"methods \[0, 1\]"),
    "png-no-width": (png(header=png_header(0, 8)), "found one of 0 x 8"),
    "png-bomb": (png(header=png_header(60000, 60000)), "200 megapixels, found 60000 x 60000"),
    "png-animated": (png(chunk(b"acTL", struct.pack(">II", 9, 0))), "one picture, found 9 in"),
    "jpeg-cut": (JPEG[: len(JPEG) // 2], "JPEG, found .* cut off before its end marker"),
    "jpeg-header-cut": (JPEG[:100], "100 bytes that cannot be decoded: it is cut off before"),
    "jpeg-filled": (JPEG[: len(JPEG) // 2] + bytes(5000), "cut off before its end marker"),
    "jpeg-closed": (JPEG[: len(JPEG) // 2] + b"\xff\xd9", "bytes that cannot be decoded"),
    "jpeg-empty": (b"\xff\xd8\xff\xd9", "cut off before its end marker"),
    "jpeg-spoilt": (JPEG[:-99] + b"\xff\x55" + JPEG[-97:], "a marker 55 is among its pixels"),
    "tiff-pages": (PAGES, "expected one picture, found 3 in one file"),
    "webp-animated": (
        b"RIFF\xf0\0\0\0WEBPVP8X\x0a\0\0\0\2" + bytes(9) + b"ANIMANMFANMFANMF",
        "expected one picture, found 3 in one file",
    ),
    "gif-animated": (b"GIF89a" + bytes(7) + b"!\xf9\x04----\0" * 2, "found 2 in one file"),
    "pgm-cut": (b"P5 40 30 255\n" + bytes(600), "613 bytes that cannot be decoded"),
    "text": (b"station,x,y,z\n", "14 bytes that cannot be decoded"),
}


@pytest.mark.parametrize("row", FAULTS)
def test_a_faulty_image_is_refused_by_us_alone(row, capfd):
    data, message = FAULTS[row]
    with pytest.raises(InputError, match=message) as caught:
        decode_grey(data, "images/7.png")
    assert caught.value.where == "images/7.png"
    said = capfd.readouterr().err
    assert "libpng" not in said
    assert "JPEG" not in said


def test_a_png_with_any_byte_changed_is_refused_or_shows_the_same(capfd):
    data = png(chunk(b"tEXt", b"Comment\0by a camera"))
    for place in range(len(data)):
        changed = bytearray(data)
        changed[place] ^= 0x20  # makes a small letter of a capital
        try:
            found = decode_grey(bytes(changed), "x")
        except InputError:
            continue
        np.testing.assert_array_equal(found, RAMP)
    assert "libpng" not in capfd.readouterr().err


@pytest.mark.parametrize("data", [WHOLE, JPEG], ids=["png", "jpeg"])
def test_an_image_cut_anywhere_is_refused(data, capfd):
    for length in range(1, len(data)):
        with pytest.raises(InputError, match="expected"):
            decode_grey(data[:length], "x")
    said = capfd.readouterr().err
    assert "libpng" not in said
    assert "JPEG" not in said


def test_a_jpeg_that_is_closed_before_its_pixels_end_is_refused(capfd):
    start = JPEG.index(b"\xff\xda") + 14
    for length in range(start, len(JPEG) - 100, 7):  # a block of 8 x 8 may go unnoticed
        with pytest.raises(InputError, match="that cannot be decoded"):
            decode_grey(JPEG[:length] + b"\xff\xd9", "x")
    assert "JPEG" not in capfd.readouterr().err


@pytest.mark.parametrize("quality", [20, 75, 95, 100])
@pytest.mark.parametrize("shape", [(1, 1), (8, 8), (17, 33), (120, 90), (40, 30, 3)])
def test_whole_jpegs_are_decoded_as_they_are(shape, quality):
    rng = np.random.default_rng(quality)
    for smooth in (0.3, 4.0):
        image = cv2.GaussianBlur(rng.integers(0, 256, shape, dtype=np.uint8), (0, 0), smooth)
        data = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, quality])[1]
        expected = cv2.imdecode(data, cv2.IMREAD_GRAYSCALE)
        np.testing.assert_array_equal(decode_grey(data.tobytes(), "x"), expected)


def without_tables(jpeg):
    """A JPEG as frames of a Motion-JPEG stream are: without the usual Huffman tables."""
    position, kept = 2, jpeg[:2]
    while jpeg[position + 1] != 0xDA:
        end = position + 2 + int.from_bytes(jpeg[position + 2 : position + 4], "big")
        kept += b"" if jpeg[position + 1] == 0xC4 else jpeg[position:end]
        position = end
    return kept + jpeg[position:]


@pytest.mark.parametrize(
    "alter",
    [
        lambda jpeg: jpeg + b"\0" * 512,
        lambda jpeg: jpeg + jpeg,
        lambda jpeg: jpeg[:2] + b"\xff\xff" + jpeg[2:],
        without_tables,
    ],
    ids=["padded", "two-in-one", "filled", "motion"],
)
def test_jpegs_as_cameras_write_them_are_read(alter, capfd):
    expected = decode_grey(JPEG, "x")
    np.testing.assert_array_equal(decode_grey(alter(JPEG), "x"), expected)
    assert capfd.readouterr().err == ""


@pytest.mark.parametrize(
    "option",
    [(cv2.IMWRITE_JPEG_PROGRESSIVE, 1), (cv2.IMWRITE_JPEG_RST_INTERVAL, 1)],
    ids=["progressive", "restarts"],
)
def test_jpegs_of_several_scans_and_with_restarts_are_read(option):
    data = cv2.imencode(".jpg", NOISE, option)[1].tobytes()
    assert data != JPEG
    np.testing.assert_array_equal(decode_grey(data, "x"), decode_grey(JPEG, "x"))


def tiff_page(kind, following):
    tags = [(254, 4, kind), (256, 3, 7), (257, 4, 5)]
    fields = b"".join(struct.pack("<HHII", tag, form, 1, value) for tag, form, value in tags)
    return struct.pack("<H", len(tags)) + fields + struct.pack("<I", following)


def test_a_preview_is_no_second_page():
    first = tiff_page(0, 8 + len(tiff_page(0, 0)))
    data = b"II*\0" + struct.pack("<I", 8) + first + tiff_page(1, 0)
    assert stated_size(data) == (7, 5)
    assert require_sound(data, "x") == data


def test_pages_in_a_circle_are_not_followed_for_ever():
    data = b"II*\0" + struct.pack("<I", 8) + tiff_page(0, 8)
    with pytest.raises(InputError, match="found 100 in one file"):
        require_sound(data, "x")


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
