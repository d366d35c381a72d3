"""Transforms read at one look: the same as in full, and only where nothing else changed."""

import numpy as np
import pytest
import zstandard
from recording import bags, ros2

from handeye_cli.recording import decoding, known_links, survey

FORMS = {
    "cdr": ("cdr", ros2.Cdr),
    "big-endian": ("cdr", lambda: ros2.Cdr(little=False)),
    "ros1": ("ros1", ros2.Ros1),
}
SCHEMA = "tf2_msgs/msg/TFMessage"
LINKS = [("base", "a"), ("a", "bb"), ("bb", "tool")]


def links_at(rng, stamp, names=LINKS):
    """Some links at one time, with numbers that have all their digits."""
    return [(stamp, parent, child, rng.normal(size=7)) for parent, child in names]


def sent(payloads, topic="/tf"):
    return [(index, topic, SCHEMA, payload) for index, payload in enumerate(payloads)]


@pytest.fixture
def decoded(monkeypatch):
    """Payloads that were decoded in full."""
    found, decode = [], decoding.ChannelDecoder.decode

    def noted(self, data):
        found.append(data)
        return decode(self, data)

    monkeypatch.setattr(decoding.ChannelDecoder, "decode", noted)
    return found


@pytest.fixture
def taken(tmp_path, monkeypatch):
    """Take the payloads of /tf out of a file, in full or not."""

    def take(payloads, encoding="cdr", *, most=known_links._MOST):
        monkeypatch.setattr(known_links, "_MOST", most)
        schemas = {"/tf": (encoding, "ros2msg", "")}
        path = bags.write(tmp_path / f"{most}.mcap", sent(payloads), schemas)
        content = survey.take(path)
        return content, [
            (link.parent, link.child, link.stamps_ns.tolist(), link.log_times_ns.tolist(),
             link.numbers.tolist())
            for link in content.links
        ]  # fmt: skip

    return take


def quaternions(link):
    """The link with a quaternion of length one, as only such are kept."""
    *names, numbers = link
    numbers = np.array(numbers)
    numbers[3:] /= np.linalg.norm(numbers[3:])
    return (*names, numbers)


def payload(links, to=ros2.Cdr):
    return ros2.transforms(*map(quaternions, links), to=to)


@pytest.mark.parametrize("form", FORMS)
def test_they_are_what_decoding_gives(taken, decoded, form):
    encoding, to = FORMS[form]
    rng = np.random.default_rng(1)
    names = [LINKS, LINKS[:1], [("base", "b")], LINKS]
    payloads = [payload(links_at(rng, 10**9 + k, names[k % 4]), to) for k in range(40)]
    _, fast = taken(payloads, encoding)
    assert len(decoded) == 3
    _, full = taken(payloads, encoding, most=0)
    assert len(decoded) == 3 + 40
    assert fast == full
    assert [len(stamps) for _, _, stamps, *_ in fast] == [30, 20, 20, 10]


def test_what_fills_the_gaps_does_not_matter_and_the_byte_order_does(taken, decoded):
    rng = np.random.default_rng(2)
    first, second = (bytearray(payload(links_at(rng, stamp, LINKS[1:2]))) for stamp in (1, 2))
    gap = bytes(second).index(b"a\0") + 2
    second[gap : gap + 2] = b"\xaa\xbb"
    swapped = payload(links_at(rng, 3, LINKS[1:2]), FORMS["big-endian"][1])
    assert len(first) == len(second) == len(swapped)
    content, _ = taken([bytes(first), bytes(second), swapped])
    assert decoded == [bytes(first), swapped]
    assert content.links[0].stamps_ns.tolist() == [1, 2, 3]


def test_damage_is_told_of_as_before(taken):
    rng = np.random.default_rng(3)
    payloads = [payload(links_at(rng, stamp)) for stamp in range(1, 9)]
    payloads[4] = payloads[4].replace(b"tool\0", b"tool!")
    payloads[5] = payloads[5][:4] + b"\xff" * 4 + payloads[5][8:]
    payloads[6] = payloads[6][:-1]
    content, fast = taken(payloads)
    assert content.unreadable["/tf"].count == 3
    assert content.unreadable["/tf"].total == 8
    assert taken(payloads, most=0)[1] == fast
    assert fast[0][2] == [1, 2, 3, 4, 8]


def test_other_names_of_the_same_length_are_other_links(taken):
    rng = np.random.default_rng(4)
    payloads = [payload(links_at(rng, k, [("base", f"link_{k % 7}")])) for k in range(70)]
    _, fast = taken(payloads)
    assert [child for _, child, *_ in fast] == [f"link_{k}" for k in range(7)]
    assert fast == taken(payloads, most=0)[1]


def test_what_is_kept_in_mind_does_not_grow_with_the_recording(taken, decoded):
    rng = np.random.default_rng(5)
    many = [payload(links_at(rng, k, [("base", f"link_{k}")])) for k in range(9)]
    long = payload(links_at(rng, 1, [("base", "x" * known_links._LONGEST)]))
    payloads = [*many, *many, long, long]
    _, found = taken(payloads, most=5)
    assert len(decoded) == 9 + 4 + 2
    assert [len(stamps) for _, _, stamps, *_ in found] == [2] * 10


def test_messages_packed_by_themselves_and_without_links_are_read_in_full(taken, decoded):
    rng = np.random.default_rng(6)
    packed = [zstandard.compress(payload(links_at(rng, stamp, LINKS[:1]))) for stamp in range(3)]
    _, found = taken([payload([]), *packed, payload([])])
    assert len(decoded) == 5
    assert [len(stamps) for _, _, stamps, *_ in found] == [3]
