"""Speed, accuracy and memory, side by side with OpenCV and with what physics allows.

`python -m benchmarks` in the checkout runs everything; `--help` tells of parts of it.
"""
