"""The images, each with what was found in it."""

from __future__ import annotations

import cv2
import numpy as np

from handeye_cli.records import GreyImage
from handeye_cli.render.detection_picture import ColourImage, draw_detection, enlargement
from handeye_cli.render.page.desk import Desk
from handeye_cli.render.page.markup import element, figure, image, paragraph
from handeye_cli.render.text import count, pixels
from handeye_cli.reporting.contents import Contents
from handeye_cli.reporting.pictures import Album, Picture

HEADING = "Images"

_QUALITY = 72
"""Of the JPEG files; lines and letters stay clear."""


def body(contents: Contents, _: Desk) -> str:
    """Return the images, or why there are none."""
    album = contents.album
    if album is None:
        return paragraph(contents.no_album or "")
    shown = "".join(_picture(each, album) for each in album.pictures)
    more = album.total - len(album.pictures)
    note = f"{count(more, 'more image')} not shown; 'handeye extract --draw' draws all."
    return element("div", shown, "album") + paragraph(note if more else "", "note")


def _picture(picture: Picture, album: Album) -> str:
    station, seen = picture.station, picture.station.observation
    if picture.grey is None:
        return element("figure", paragraph(f"{station.name}: {picture.reason}"), "lost")
    if seen is None:
        words = f"{station.name}: {station.reason or 'not found'}"
    else:
        sigma = "" if seen.sigma_px is None else f", sigma {pixels(seen.sigma_px)} px"
        words = f"{station.name}: {len(seen.ids)} of {count(len(album.points), 'point')}{sigma}"
    drawn = draw_detection(
        picture.grey, station, album.points, discs=album.discs, camera=picture.camera
    )
    data = _jpeg(_without_band(drawn, picture.grey))
    return figure(image(data, "jpeg", words), words)


def _without_band(drawn: ColourImage, grey: GreyImage) -> ColourImage:
    """Return a picture without the words above it, and no larger than its image."""
    factor, (height, width) = enlargement(grey), grey.shape
    cut = drawn[-factor * height :, : factor * width]
    if factor == 1:
        return cut
    shrunk = cv2.resize(cut, (width, height), interpolation=cv2.INTER_AREA)
    return np.asarray(shrunk, dtype=np.uint8)


def _jpeg(drawn: ColourImage) -> bytes:
    _, data = cv2.imencode(".jpg", drawn, [cv2.IMWRITE_JPEG_QUALITY, _QUALITY])
    return bytes(data)
