"""The flags of `handeye report`."""

from dataclasses import dataclass
from functools import partial
from typing import Annotated

from handeye_cli.cli.flags import Argument, Flag
from handeye_cli.cli.options import Source

_judgement = partial(Flag, rich_help_panel="Judgement")
_output = partial(Flag, rich_help_panel="Output")


@dataclass(frozen=True)
class Sources(Source):
    """All that is read; flags about the input act on the recording, or on the first document."""

    further: Annotated[
        list[str] | None,
        Argument(
            metavar="FILE",
            help="More for the same page: documents, or MCAP files of the same recording.",
            show_default=False,
        ),
    ] = None


@dataclass(frozen=True)
class Accepted:
    """What an answer must keep to be good."""

    max_rotation_mrad: Annotated[
        float | None,
        _judgement(min=0.0, metavar="MRAD", help="Red, and exit 6, when an error is above it."),
    ] = None
    max_translation_mm: Annotated[
        float | None,
        _judgement(min=0.0, metavar="MM", help="Red, and exit 6, when an error is above it."),
    ] = None


@dataclass(frozen=True)
class Page:
    """Where the page goes and what is on it."""

    output: Annotated[
        str,
        _output("--output", "-o", metavar="FILE", help="Write the page to FILE; - is stdout."),
    ] = "report.html"
    force: Annotated[bool, _output("--force", help="Replace a file that exists.")] = False
    no_images: Annotated[
        bool, _output("--no-images", help="Leave out the images, for a small page.")
    ] = False
    json: Annotated[
        bool, _output("--json", help="Print the lights and their reasons on stdout, as JSON.")
    ] = False
    quiet: Annotated[
        bool, _output("--quiet", "-q", help="No progress; findings and errors remain.")
    ] = False
