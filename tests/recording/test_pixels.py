"""Raw and compressed pixels into grey levels."""

import cv2
import numpy as np
import pytest

from handeye_cli.errors import InputError
from handeye_cli.recording.messages import CompressedImageMessage, Header, ImageMessage
from handeye_cli.recording.pixels import refusal, to_grey

HEADER = Header(1, "camera")


def raw(pixels, encoding, *, pad=0, big=False, data=None):
    rows = np.ascontiguousarray(pixels).view(np.uint8).reshape(len(pixels), -1)
    padded = np.pad(rows, ((0, 0), (0, pad)), constant_values=200)
    content = padded.tobytes() if data is None else data
    height, width = pixels.shape[:2]
    return ImageMessage(HEADER, height, width, encoding, big, padded.shape[1], content)


@pytest.fixture
def rng():
    return np.random.default_rng(5)


@pytest.mark.parametrize("encoding", ["mono8", "8UC1"])
@pytest.mark.parametrize("pad", [0, 7])
def test_grey_rows_lose_their_padding_only(rng, encoding, pad):
    pixels = rng.integers(0, 256, (6, 9), dtype=np.uint8)
    np.testing.assert_array_equal(to_grey(raw(pixels, encoding, pad=pad), "x"), pixels)


@pytest.mark.parametrize(
    ("encoding", "order"),
    [("rgb8", "rgb"), ("bgr8", "bgr"), ("8UC3", "bgr"), ("rgba8", "rgba"), ("bgra8", "bgra")],
)
def test_colour_becomes_luminance(rng, encoding, order):
    pixels = rng.integers(0, 256, (6, 9, len(order)), dtype=np.uint8)
    weights = {"r": 0.299, "g": 0.587, "b": 0.114, "a": 0.0}
    expected = pixels @ np.array([weights[letter] for letter in order])
    grey = to_grey(raw(pixels, encoding, pad=3), "x")
    assert grey.dtype == np.uint8
    np.testing.assert_allclose(grey, expected, atol=1.0)


@pytest.mark.parametrize("order", ["rgb", "bgr", "rgba", "bgra"])
@pytest.mark.parametrize("big", [False, True])
def test_deep_colour_becomes_luminance_by_the_range_in_use(rng, order, big):
    pixels = rng.integers(0, 4096, (6, 9, len(order)), dtype=np.uint16)
    pixels[0, 0] = 4095
    weights = {"r": 0.299, "g": 0.587, "b": 0.114, "a": 0.0}
    expected = pixels @ np.array([weights[letter] for letter in order]) * (255 / 4095)
    stored = pixels.astype(">u2" if big else "<u2")
    grey = to_grey(raw(stored, f"{order}16", pad=2, big=big), "x")
    assert grey.dtype == np.uint8
    np.testing.assert_allclose(grey, expected, atol=0.6)


@pytest.mark.parametrize("pattern", ["rggb", "bggr", "gbrg", "grbg"])
@pytest.mark.parametrize(("kind", "bits"), [(np.uint8, 8), ("<u2", 16), (">u2", 16)])
def test_mosaic_of_one_colour_becomes_its_luminance(pattern, kind, bits):
    colour = {"r": 200, "g": 90, "b": 30}
    tile = np.array([colour[letter] for letter in pattern], dtype=kind).reshape(2, 2)
    mosaic = raw(np.tile(tile, (4, 5)), f"bayer_{pattern}{bits}", big=kind == ">u2")
    luminance = 0.299 * 200 + 0.587 * 90 + 0.114 * 30
    np.testing.assert_allclose(to_grey(mosaic, "x"), luminance, atol=1.5)


@pytest.mark.parametrize("order", ["rgb", "bgr", "rgba", "bgra"])
def test_colour_agrees_with_opencv(rng, order):
    pixels = rng.integers(0, 256, (6, 9, len(order)), dtype=np.uint8)
    expected = cv2.cvtColor(pixels, getattr(cv2, f"COLOR_{order.upper()}2GRAY"))
    np.testing.assert_array_equal(to_grey(raw(pixels, f"{order}8"), "x"), expected)


@pytest.mark.parametrize(
    ("encoding", "code"),
    [("yuv422", "UYVY"), ("uyvy", "UYVY"), ("yuv422_yuy2", "YUY2"), ("yuyv", "YUY2")],
)
@pytest.mark.parametrize("pad", [0, 6])
def test_shared_colour_gives_the_brightness_of_every_pixel(rng, encoding, code, pad):
    pixels = rng.integers(0, 256, (6, 8, 2), dtype=np.uint8)
    expected = cv2.cvtColor(pixels, getattr(cv2, f"COLOR_YUV2GRAY_{code}"))
    np.testing.assert_array_equal(to_grey(raw(pixels, encoding, pad=pad), "x"), expected)


@pytest.mark.parametrize(
    ("encoding", "rows", "code"), [("nv12", 9, "NV12"), ("nv21", 9, "NV21"), ("nv24", 18, None)]
)
def test_planes_of_colour_follow_that_of_brightness(rng, encoding, rows, code):
    planes = rng.integers(0, 256, (rows, 8), dtype=np.uint8)
    # OpenCV does not know nv24, whose colour is as fine as its brightness
    known = code and cv2.cvtColor(planes, getattr(cv2, f"COLOR_YUV2GRAY_{code}"))
    expected = planes[:6] if known is None else known
    padded = np.pad(planes, ((0, 0), (0, 4)), constant_values=200)
    message = ImageMessage(HEADER, 6, 8, encoding, False, 12, padded.tobytes())
    np.testing.assert_array_equal(to_grey(message, "x"), expected)


@pytest.mark.parametrize("big", [False, True])
@pytest.mark.parametrize("encoding", ["mono16", "16UC1"])
def test_sixteen_bits_are_scaled_by_the_range_in_use(encoding, big):
    pixels = np.array([[0, 1024, 2048], [4095, 16, 100]], dtype=np.uint16)
    stored = pixels.astype(">u2" if big else "<u2")
    grey = to_grey(raw(stored, encoding, pad=2, big=big), "x")
    np.testing.assert_array_equal(grey, np.rint(pixels * (255 / 4095)))


def test_sixteen_bits_that_hold_eight_stay_as_they_are():
    pixels = np.array([[0, 3, 7]], dtype="<u2")
    np.testing.assert_array_equal(to_grey(raw(pixels, "mono16"), "x"), pixels)


@pytest.mark.parametrize(
    ("encoding", "word"),
    [("64FC1", "depths"), ("32FC1", "depths"), ("yuv411", "readable are"), ("", "''")],
)
def test_other_encodings_are_refused_by_name(encoding, word):
    message = raw(np.zeros((2, 2), dtype=np.uint8), encoding)
    assert repr(encoding) in refusal(message)
    with pytest.raises(InputError, match=word) as caught:
        to_grey(message, "/camera at 3 s")
    assert caught.value.where == "/camera at 3 s"
    assert "--image-topic" in caught.value.hint


def test_missing_bytes_are_refused():
    pixels = np.zeros((6, 9), dtype=np.uint8)
    message = raw(pixels, "mono8", data=bytes(53))
    with pytest.raises(InputError, match=r"6 rows of 9 bytes .* found 53 bytes"):
        to_grey(message, "x")


def test_step_shorter_than_a_row_is_refused():
    message = ImageMessage(HEADER, 2, 9, "rgb8", False, 26, bytes(1000))
    with pytest.raises(InputError, match="2 rows of 26 bytes for 9 x 2"):
        to_grey(message, "x")


@pytest.mark.parametrize(
    ("ending", "tolerance"), [(".png", 0), (".jpg", 6), (".tiff", 0), (".webp", 6)]
)
@pytest.mark.parametrize("form", ["", "png", "bgr8; jpeg compressed bgr8"])
def test_compressed_image_is_known_by_its_first_bytes(ending, tolerance, form):
    ramp = np.add.outer(np.arange(16), 4 * np.arange(24)).astype(np.uint8)
    data = cv2.imencode(ending, ramp)[1].tobytes()
    grey = to_grey(CompressedImageMessage(HEADER, form, data), "x")
    np.testing.assert_allclose(grey, ramp, atol=tolerance)


@pytest.mark.parametrize(
    ("form", "data", "word"),
    [
        ("16UC1; compressedDepth png", b"\0" * 12 + b"\x89PNG\r\n\x1a\n", "compressedDepth"),
        ("32FC1; png compressed ", b"\x89PNG\r\n\x1a\n", "depths"),
        ("h264", b"\0\0\0\1\x67", "none of PNG, JPEG, TIFF, WebP"),
        ("jpeg", b"", "b''"),
    ],
)
def test_other_compressions_are_refused_by_name(form, data, word):
    with pytest.raises(InputError, match=word):
        to_grey(CompressedImageMessage(HEADER, form, data), "x")


@pytest.mark.parametrize("form", ["16UC1; png compressed ", "16UC1"])
def test_sixteen_bit_files_are_depths_by_the_name_of_the_topic(form):
    message = CompressedImageMessage(HEADER, form, b"\x89PNG\r\n\x1a\n")
    assert "depths" in refusal(message, "/camera/depth/image_raw/compressed")
    assert refusal(message, "/camera/infra1/image_raw/compressed") is None


@pytest.mark.parametrize("ending", [".webp", ".tiff"])
def test_shortened_file_is_refused(rng, ending, capfd):
    pixels = rng.integers(0, 256, (40, 60), dtype=np.uint8)
    data = cv2.imencode(ending, pixels)[1].tobytes()
    with pytest.raises(InputError, match="cannot be decoded"):
        to_grey(CompressedImageMessage(HEADER, "", data[: len(data) // 2]), "x")
    capfd.readouterr()


def test_damaged_file_is_refused():
    with pytest.raises(InputError, match="cannot be decoded") as caught:
        to_grey(CompressedImageMessage(HEADER, "jpeg", b"\xff\xd8\xff\xe0nothing"), "at 3 s")
    assert caught.value.where == "at 3 s"
