"""The flags of `handeye batch`; those about a recording are the ones of solve and verify."""

from dataclasses import dataclass
from functools import partial
from typing import Annotated

from handeye_cli.cli.flags import Argument, Flag
from handeye_cli.cli.options import Source

_work = partial(Flag, rich_help_panel="Work (changes nothing in the results)")
_output = partial(Flag, rich_help_panel="Output")


@dataclass(frozen=True)
class Recordings(Source):
    """All that is read, each on its own, and how every one of them is meant."""

    source: Annotated[
        str,
        Argument(
            metavar="RECORDING",
            help="A recording (MCAP, folder or document); @FILE names a file with one name in each "
            "line, @- the same on stdin.",
            show_default=False,
        ),
    ]
    further: Annotated[
        list[str] | None,
        Argument(metavar="RECORDING", help="More recordings.", show_default=False),
    ] = None


@dataclass(frozen=True)
class Labour:
    """Who does the work."""

    jobs: Annotated[
        int | None,
        _work(
            min=1,
            metavar="N",
            help="Recordings at the same time; one per processor if not set.",
        ),
    ] = None
    scheduler: Annotated[
        str | None,
        _work(
            metavar="ADDRESS",
            help="Work on the Dask cluster behind this scheduler instead: tcp://10.0.0.5:8786.",
        ),
    ] = None


@dataclass(frozen=True)
class Kept:
    """What is kept besides the table."""

    out_dir: Annotated[
        str | None,
        _output(metavar="DIR", help="Write each calibration into DIR, named after its recording."),
    ] = None
    times: Annotated[
        bool, _output("--times", help="Put the seconds that each recording took into the document.")
    ] = False
