"""The page: whole, harmless whatever stands in the documents, and the same every time."""

from __future__ import annotations

import re
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest
from reporting import cases
from simulate.paper_setting import PAPER

from handeye_cli.conventions import Setup
from handeye_cli.gates import Limits
from handeye_cli.pipeline import Steps
from handeye_cli.plan import plan
from handeye_cli.records import Inspection, ProvenanceStep
from handeye_cli.records.batch import Batch, BatchRow, BatchStatus
from handeye_cli.records.moving import TimeOffset
from handeye_cli.records.recording_summary import RecordingSummary, TopicSummary, UsedParts
from handeye_cli.render.calibration import show_calibration
from handeye_cli.render.page.drawing import Pen
from handeye_cli.render.page.markup import table, text
from handeye_cli.render.page.page import html_page
from handeye_cli.render.page.sections import SECTIONS
from handeye_cli.render.page.telling import Teller
from handeye_cli.render.residuals import show_residuals
from handeye_cli.reporting.case import Case
from handeye_cli.reporting.colour import Colour
from handeye_cli.reporting.contents import contents_of, distances
from handeye_cli.reporting.pictures import Album, Picture
from handeye_cli.simulate.figures import simulate_figures

EVIL = '<script>alert("$x$")</script>&\x1b'
_EMPTY = {"meta", "link", "br", "img"}


class Reader(HTMLParser):
    """Reads a page, and complains about elements that are not closed in their order."""

    def __init__(self, page):
        super().__init__()
        self.open, self.tags, self.links, self.ids, self.words = [], [], [], [], []
        self.feed(page)
        assert self.open == []

    def handle_starttag(self, tag, attributes):
        self.tags.append(tag)
        if tag not in _EMPTY:
            self.open.append(tag)
        self._attributes(attributes)

    def handle_startendtag(self, tag, attributes):
        self.tags.append(tag)
        self._attributes(attributes)

    def _attributes(self, attributes):
        for name, value in attributes:
            assert not name.startswith("on")
            if name in ("src", "href", "xlink:href", "srcset", "action"):
                self.links.append(value)
            if name == "id":
                self.ids.append(value)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if self.open and self.open[-1] not in ("style", "script"):
            self.words.append(data)


def page_of(*some, **more):
    every = [contents_of(each, Limits(), Steps(workers=1), **more) for each in some]
    return html_page(every, distances(some))


def full_case():
    """A case with something in every section."""
    answer = replace(
        cases.calibration(),
        diagnosis=(cases.finding("warning", EVIL),),
        provenance=(ProvenanceStep("solve", "1", ((EVIL, "ab"),), {"target": EVIL}),),
    )
    rows = tuple(
        replace(each, name=EVIL) if k == 3 else each for k, each in enumerate(answer.stations)
    )
    return replace(
        cases.case(),
        name=EVIL,
        calibration=replace(answer, stations=rows),
        verifications=(cases.verification(), cases.left_out()),
        inspection=Inspection(Setup.EYE_IN_HAND, rows),
        plans=(plan(5, distance=0.17, tilt=np.radians(30), verification=2),),
        simulations=(simulate_figures([12], PAPER, 4, 0),),
        batches=(batch(),),
        remarks=(EVIL,),
    )


def batch():
    """A batch of one good recording and one that failed."""
    return Batch((
        BatchRow("good.mcap", stations=8, used=7, predicted_rotation=1e-3, seen_rotation=2e-3,
                 seen_translation=3e-3, calibration="answers/good.yaml"),
        BatchRow(EVIL, BatchStatus.FAILED, 4, message=EVIL, advice="look again",
                 findings=("plate-bowed",)),
    ))  # fmt: skip


@pytest.fixture(scope="module")
def full():
    return page_of(full_case(), unreached=f"{EVIL} is gone")


def test_every_section_is_there(full):
    reader = Reader(full)
    assert reader.tags.count("section") == len(SECTIONS)
    assert set(re.findall(r'<section class="(\w+)"', full)) == set(SECTIONS)
    assert reader.tags.count("svg") == 9


def test_words_of_documents_do_nothing(full):
    reader = Reader(full)
    assert "script" not in reader.tags
    assert "\x1b" not in full
    assert "alert" in "".join(reader.words)


def test_the_page_loads_nothing(full):
    links = Reader(full).links
    assert links
    assert all(link.startswith(("data:", "#")) for link in links)
    assert "default-src 'none'" in full
    style = full[full.index("<style>") : full.index("</style>")]
    assert "@import" not in style
    assert "url(" not in style.replace("url(#", "")
    # names of XML are no addresses that are loaded
    addresses = set(re.findall(r"https?://[^\"'\s<]+", full))
    assert addresses <= {"http://www.w3.org/1999/xlink", "http://www.w3.org/2000/svg"}


@pytest.fixture(scope="module")
def both():
    """A page of two answers."""
    return page_of(cases.case(), cases.case(Setup.EYE_TO_HAND))


@pytest.fixture
def undrawn(monkeypatch):
    """Leave out the figures, which take long."""
    monkeypatch.setattr(Pen, "draw", lambda *_: "<svg></svg>")


def test_what_a_figure_points_at_is_there_and_no_name_is_used_twice(both):
    reader = Reader(both)
    assert len(reader.ids) == len(set(reader.ids))
    pointed = {link[1:] for link in reader.links if link.startswith("#")}
    assert pointed
    assert pointed <= set(reader.ids)


def test_figures_have_the_pages_colours(full):
    figures = "".join(re.findall(r"<svg.*?</svg>", full, flags=re.DOTALL))
    assert "var(--blue)" in figures
    assert "var(--ink)" in figures
    assert not re.findall(r"#(?:01010\d|000000|ffffff)", figures)


def test_the_same_documents_make_the_same_bytes(full):
    assert page_of(full_case(), unreached=f"{EVIL} is gone") == full


def test_the_numbers_of_the_answer_are_on_the_page(full):
    words = "".join(Reader(full).words)
    answer = cases.calibration()
    assert f"{1e3 * answer.predicted_error.rotation:.3f} mrad" in words
    assert f"{1e3 * answer.predicted_error.translation_95:.3f} mm" in words
    assert f"x {1e3 * answer.mount_T_camera.matrix[0, 3]:.3f}" in words
    assert "Seen at stations left out" in words
    assert "1.100 mrad and 0.120 mm" in words


@pytest.mark.usefixtures("undrawn")
def test_an_answer_that_was_not_verified_says_so():
    words = "".join(Reader(page_of(cases.case())).words)
    assert "predicted only, not verified" in words


@pytest.mark.usefixtures("undrawn")
def test_answers_stand_side_by_side(both):
    alone = page_of(cases.case())
    assert 'class="summary"' not in alone
    assert 'class="summary"' in both
    assert Reader(both).tags.count("article") == 2
    plan_beside = page_of(cases.case(), Case("plan.yaml", plans=full_case().plans))
    assert 'class="summary"' not in plan_beside


@pytest.mark.usefixtures("undrawn")
def test_documents_without_an_answer_make_a_page():
    for lone in (
        Case("features.yaml", features=cases.shot().features),
        Case("stations.yaml", stations=cases.stations()),
        Case("verification.yaml", verifications=(cases.verification(),)),
        Case("inspection.yaml", inspection=Inspection(None, ())),
        Case("plan.yaml", plans=full_case().plans),
    ):
        assert Reader(page_of(lone)).tags.count("section") >= 1


def test_a_batch_shows_a_light_for_every_recording_and_what_the_lights_mean():
    page = page_of(Case("batch.yaml", batches=(batch(),)))
    words = " ".join(Reader(page).words)
    assert "Do not rely on all of these" in words
    assert "no answer, or none that could be verified: 1 of 2: " in words
    rows = re.findall(r"<tr><th scope=\"row\">(.*?)</th>(.*?)</tr>", page)
    cells = [re.findall(r"<td.*?>(.*?)</td>", row) for _, row in rows[:2]]
    assert [row[0] for row in cells] == [
        '<span class="lamp red small">red</span>',
        '<span class="lamp green small">green</span>',
    ]
    assert cells[1][1:] == ["ok", "0", "7/8", "1.000", "-", "2.000", "3.000", "answers/good.yaml"]
    for told in (
        "Green: an answer whose errors",
        "Exit codes: 0 done",
        "look again",
        "plate-bowed",
    ):
        assert told in words


def test_a_batch_is_red_where_a_recording_breaks_a_limit_of_the_report():
    good = Case("batch.yaml", batches=(Batch(batch().rows[:1]),))
    assert contents_of(good, Limits(), Steps()).light.colour is Colour.GREEN
    contents = contents_of(good, Limits(rotation_mrad=1.5), Steps())
    page = html_page([contents], [None])
    assert contents.light.colour is Colour.RED
    assert "good.mcap: expected a seen rotation error up to 1.5 mrad, found 2.000" in page


def test_a_named_recording_shows_its_topics():
    used = UsedParts(image_topic="/wrist/image")
    topic = TopicSummary("/wrist/image", "sensor_msgs/msg/Image", "cdr", 23, 5.0, "image")
    summary = RecordingSummary(4.6, False, (topic,), (), (), True, used, (), "handeye solve a.mcap")
    case = Case("a.mcap", summary=summary)
    assert "sensor_msgs/msg/Image" in page_of(case)
    time = TimeOffset(-0.038, 0.003, 0.001, 22)
    looked = Inspection(Setup.EYE_IN_HAND, (), recording=summary, time_offset=time)
    page = page_of(replace(case, inspection=looked))
    assert "Topics of the recording (4.6 s)" in page
    assert "-38.00 +- 3.00" in page


@pytest.mark.usefixtures("undrawn")
def test_images_show_what_was_found_and_what_is_lost():
    station = cases.shot().features.stations[0]
    grey = np.full((480, 640), 120, np.uint8)
    pictures = (
        Picture(station, grey),
        Picture(replace(station, observation=None, reason=EVIL), grey),
        Picture(station, None, reason="a.png: gone"),
    )
    album = Album(pictures, 5, np.zeros((36, 3)) + np.arange(36)[:, None], np.zeros((0, 3)))
    contents = replace(contents_of(cases.case(), Limits(), Steps()), album=album)
    reader = Reader(html_page([contents], [None]))
    words = "".join(reader.words)
    assert reader.tags.count("img") == 2
    assert "00: 36 of 36 points" in words
    assert "00: a.png: gone" in words
    assert "2 more images not shown" in words


def test_a_table_is_told_once_and_under_its_own_line():
    teller = Teller()
    answer = cases.calibration()
    first = teller.tell(show_calibration, answer)
    assert '<p class="caption">Residuals of the stations</p>' in first
    assert '<p class="lead">gripper_T_camera: the camera' in first
    assert teller.tell(show_calibration, answer) == ""
    assert "<table" in teller.tell(show_residuals, answer.stations[:2])


def test_lines_that_are_kept_as_they_are_end_where_they_end(full):
    (line,) = re.findall(r'<p class="kept">(  Line through the RMS.*?)</p>', full)
    assert re.search(r"R2 \d\.\d{4}$", line)


def test_tables_put_words_left_and_numbers_right():
    html = table(["a", "b\nmm"], [["<x>", "1.0"]], words=[0], caption="c & d")
    assert '<th scope="row">&lt;x&gt;</th>' in html
    assert '<td class="n">1.0</td>' in html
    assert '<th scope="col" class="n">b<br>mm</th>' in html
    assert 'aria-label="c &amp; d"' in html


def test_text_is_harmless_in_attributes_too():
    assert text("\"'<&\x00") == "&quot;&#x27;&lt;&amp;\N{REPLACEMENT CHARACTER}"
