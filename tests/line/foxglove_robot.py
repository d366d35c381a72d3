"""A recorded robot whose messages are those of Foxglove, as protobuf."""

import numpy as np
from line.recordings import PEDESTAL, RecordedRobot
from mcap.writer import Writer
from recording import foxglove
from recording.bags import ns, pose_numbers


class FoxgloveRobot(RecordedRobot):
    """The same motion and pictures; its static link is a transform that is sent once."""

    def static(self):
        link = foxglove.frame_transform(ns(0), "world", "base_link", pose_numbers(PEDESTAL))
        return [(ns(0), "/still", *_message("FrameTransforms", {"transforms": [link]}))]

    def links(self):
        for t in np.arange(0.0, self.duration, 1 / self.rate):
            pose = pose_numbers(self.noisy(self.lower, t))
            link = foxglove.frame_transform(ns(t), "base_link", "tool", pose)
            yield ns(t + 0.002), "/moving", *_message("FrameTransform", link)

    def _image(self, stamp, png):
        values = foxglove.compressed_image(stamp, "camera_optical", png, "png")
        return "/camera/image", *_message("CompressedImage", values)

    def infos(self):
        camera = self.camera
        k = (camera.fx, 0.0, camera.cx, 0.0, camera.fy, camera.cy, 0.0, 0.0, 1.0)
        for t in np.arange(0.01, self.duration, 0.5):
            values = foxglove.camera_calibration(
                ns(t), "camera_optical", k=k, d=camera.distortion, model="plumb_bob",
                p=(0.0,) * 12, size=(camera.width, camera.height),
            )  # fmt: skip
            yield ns(t), "/camera/calibration", *_message("CameraCalibration", values)


def _message(name, values):
    return f"foxglove.{name}", foxglove.as_protobuf(f"foxglove.{name}", values)


def write(path, messages):
    """Write (log time, topic, schema name, payload) in this order."""
    with path.open("wb") as file:
        writer = Writer(file, chunk_size=1_000_000)
        writer.start(profile="", library="test")
        channels = {}
        for log_ns, topic, schema, payload in messages:
            if topic not in channels:
                number = writer.register_schema(schema, "protobuf", foxglove.descriptor())
                channels[topic] = writer.register_channel(topic, "protobuf", number)
            writer.add_message(channels[topic], log_ns, payload, log_ns)
        writer.finish()
    return path
