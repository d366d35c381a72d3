"""The page in a real browser: no complaint, light and dark, wide and narrow, and on paper."""

from __future__ import annotations

import re
import shutil
import subprocess
from dataclasses import replace

import cv2
import numpy as np
import pytest
from reporting import cases

from handeye_cli.gates import Limits
from handeye_cli.pipeline import Steps
from handeye_cli.render.page.page import html_page
from handeye_cli.reporting.contents import contents_of

BROWSER = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("chrome")
FLAGS = [
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--hide-scrollbars",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--enable-logging=stderr",
    "--virtual-time-budget=2000",
]
MEASURE = (
    "<script>document.body.dataset.width=document.documentElement.scrollWidth;"
    "document.body.dataset.figure=Math.round("
    "document.querySelector('svg').getBoundingClientRect().width)</script></body>"
)

WIDTHS = (390, 1200)
GATHER = (
    "<script>window.onload=()=>{for(const frame of document.querySelectorAll('iframe')){"
    "const found=frame.contentDocument.body.dataset;"
    "document.body.append(`measured ${found.width} ${found.figure};`)}}</script>"
)

pytestmark = pytest.mark.skipif(BROWSER is None, reason="needs Chromium")


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    case = replace(cases.case(), verifications=(cases.verification(), cases.left_out()))
    path = tmp_path_factory.mktemp("page") / "report.html"
    path.write_text(html_page([contents_of(case, Limits(), Steps())], [None]), encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def profile(tmp_path_factory):
    """A folder for what the browser keeps from one start to the next."""
    return tmp_path_factory.mktemp("profile")


@pytest.fixture
def browse(tmp_path, profile):
    """Open a page; returns stdout after checking that the browser found nothing wrong."""

    def run(page, *flags):
        done = subprocess.run(
            [BROWSER, *FLAGS, f"--user-data-dir={profile}", *flags, page.as_uri()],
            capture_output=True,
            text=True,
            check=True,
            timeout=60,
            cwd=tmp_path,
        )
        assert "CONSOLE" not in done.stderr
        return done.stdout

    return run


@pytest.mark.parametrize(("scheme", "dark"), [(1, False), (0, True)])
def test_light_and_dark(page, browse, tmp_path, scheme, dark):
    shot = tmp_path / "shot.png"
    browse(
        page,
        f"--blink-settings=preferredColorScheme={scheme}",
        "--window-size=1200,1500",
        f"--screenshot={shot}",
    )
    image = cv2.imread(str(shot), cv2.IMREAD_GRAYSCALE)
    assert image.shape == (1500, 1200)
    assert (np.median(image) < 60) == dark
    # letters and figures stand out from the ground
    apart = np.abs(image.astype(int) - int(np.median(image))) > 100
    assert 0.005 < apart.mean() < 0.2


def test_nothing_is_wider_than_the_window(page, browse, tmp_path):
    html = re.sub(r"<meta http-equiv=.*?>", "", page.read_text(encoding="utf-8"))
    (tmp_path / "measured.html").write_text(html.replace("</body>", MEASURE), encoding="utf-8")
    # a window may be wider than what was asked for, but a frame is not
    frame = tmp_path / "frame.html"
    frames = "".join(f'<iframe src="measured.html" width="{width}"></iframe>' for width in WIDTHS)
    frame.write_text(f"<body>{frames}{GATHER}</body>", encoding="utf-8")
    dom = browse(frame, "--dump-dom", "--allow-file-access-from-files", "--window-size=1300,900")
    found = re.findall(r"measured (\d+) (\d+);", dom)
    assert len(found) == len(WIDTHS)
    for width, (wide, drawn) in zip(WIDTHS, found, strict=True):
        assert int(wide) <= width
        assert int(drawn) > (300 if width == 390 else 450)


def test_on_paper_it_is_light_and_a_few_pages(page, browse, tmp_path):
    pdf = tmp_path / "report.pdf"
    browse(
        page,
        "--blink-settings=preferredColorScheme=0",
        f"--print-to-pdf={pdf}",
        "--no-pdf-header-footer",
    )
    data = pdf.read_bytes()
    assert data.startswith(b"%PDF")
    assert 2 <= len(re.findall(rb"/Type\s*/Page\b", data)) <= 8
