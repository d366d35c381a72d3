"""Valid documents with something wrong in them, as hypothesis draws it."""

import copy

from hypothesis import strategies as st

NASTY = (
    None, True, 0, -1, 2.5, 10**17, 1e300, -1e300, 1e29, 1e-300, float("nan"), float("-inf"),
    "", "no", "12:30", "1e-05", "0x1F", "../../etc/passwd", "/dev/zero", "a\0b", "\x1b[31m",
    "x" * 5000, [], {}, [[]], [0, 0, 0], [0, 0, 0, 0], [1e30, 0, 0], [[0.0] * 6] * 6,
    [[1e30 * (i == j) for j in range(6)] for i in range(6)], {"translation": [0, 0, 0]},
    {"matrix": [[2, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]}, ["a"] * 300,
    "eye-to-hand", "base-in-gripper", "wxyz", "mm",
)  # fmt: skip
"""Values that some place in a document does not expect."""
FACTORS = (-1.0, 0.0, 1e-12, 1e-3, 1.001, 1e3, 1e25)
UNKNOWN = ("zz", "setpu", "", "a\nb", "covariance", "name")
LONG = 200
"""Times a list is repeated."""


def spots(value, path=()):
    """Yield the path of everything in a document, of long lists the first and the last."""
    yield path
    if isinstance(value, dict):
        for key, item in value.items():
            yield from spots(item, (*path, key))
    elif isinstance(value, list):
        for index in sorted({0, 1, len(value) - 1} & set(range(len(value)))):
            yield from spots(value[index], (*path, index))


def at(document, path):
    for key in path:
        document = document[key]
    return document


def mutated(document):
    """Draw a document with one to three faults."""

    @st.composite
    def draw_one(draw):
        spoilt = copy.deepcopy(document)
        for _ in range(draw(st.integers(1, 3))):
            path = draw(st.sampled_from([path for path in spots(spoilt) if path]))
            parent, key = at(spoilt, path[:-1]), path[-1]
            draw(st.sampled_from(FAULTS))(draw, parent, key)
        return spoilt

    return draw_one()


def other_value(draw, parent, key):
    parent[key] = copy.deepcopy(draw(st.sampled_from(NASTY)))


def gone(_, parent, key):
    del parent[key]


def scaled(draw, parent, key):
    if isinstance(parent[key], int | float) and not isinstance(parent[key], bool):
        parent[key] *= draw(st.sampled_from(FACTORS))


def repeated(_, parent, key):
    if isinstance(parent[key], list):
        parent[key] = parent[key] * LONG


def unknown_key(draw, parent, key):
    if isinstance(parent[key], dict):
        name = draw(st.sampled_from(UNKNOWN))
        parent[key][name] = copy.deepcopy(draw(st.sampled_from(NASTY)))


def nested(draw, parent, key):
    for _ in range(draw(st.sampled_from([1, 10, 100]))):
        parent[key] = [parent[key]]


FAULTS = (other_value, other_value, gone, scaled, scaled, repeated, unknown_key, nested)
