"""Extraction of target points against OpenCV and the Cramer-Rao bound, on one core.

python benchmarks/extract.py
python benchmarks/extract.py --tables detection --sizes vga --views 1000 --lost
python benchmarks/extract.py --tables accuracy --views 150
python benchmarks/extract.py --tables real --data ../shared/data
"""

from __future__ import annotations

import argparse
from pathlib import Path

import cv2
from extraction import accuracy, boards, detection, real

TABLES = {
    "detection": detection.report,
    "accuracy": accuracy.report,
    "boards": boards.report,
    "real": real.report,
}
DATA = Path(__file__).resolve().parents[2] / "shared" / "data"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--tables", default=",".join(TABLES), help="of " + ", ".join(TABLES))
    parser.add_argument("--views", type=int, default=30, help="views of each size")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--sizes", default="vga,2mp,5mp", help="of vga, 2mp, 5mp")
    parser.add_argument("--no-opencv", action="store_true", help="this project alone")
    parser.add_argument("--lost", action="store_true", help="list the views that were lost")
    parser.add_argument("--data", default=str(DATA), help="folder of real recordings")
    options = parser.parse_args()
    cv2.setNumThreads(1)
    for name in options.tables.split(","):
        TABLES[name](options)
        print()


if __name__ == "__main__":
    main()
