"""Writes the corpus: a few small good inputs for each reader. Run it when a writer changes."""

import json

import cv2
import numpy as np
from fuzz.readers import CORPUS
from mcap.writer import CompressionType
from recording import bags, ros2

URDF = """<robot name="arm">
  <joint name="a" type="revolute"><parent link="base"/><child link="arm"/>
    <origin xyz="0 0 0.1" rpy="0 0 1"/><axis xyz="0 0 1"/></joint>
  <joint name="b" type="prismatic"><parent link="arm"/><child link="tool"/>
    <mimic joint="a" multiplier="0.5" offset="1"/></joint>
</robot>
"""
POSE = {"translation": [0.1, 0.2, 0.3], "quaternion": [0, 0, 0, 1]}
STATION = {"name": "00", "base_T_gripper": POSE, "camera_T_target": POSE}
STATIONS = {"schema": "handeye/stations/1", "setup": "eye-in-hand", "stations": [STATION]}
BLOCK = """schema: handeye/stations/1  # a comment
setup: &setup eye-in-hand
stations:
- name: "00"
  base_T_gripper: {translation: [1e-05, .5, -0x1F], quaternion: [0, 0, 0, 1]}
  reason: >
    folded text, and *setup
again: *setup
"""
METADATA = """rosbag2_bagfile_information:
  version: 5
  storage_identifier: mcap
  relative_file_paths: [some.mcap]
"""
PARTS = {
    "robot": {
        "translation": {"x": 0, "y": 0, "z": 1},
        "rotation": {"x": 0, "y": 0, "z": 0, "w": 1},
    },
}
PARTS["tracking"] = PARTS["robot"]
EASY = {"parameters": {"calibration_type": "eye_in_hand"}, "samples": [PARTS] * 3}
CSV = "time,x,y,z,qx,qy,qz,qw\n0.1,1,2,3,0,0,0,1\n0.2,1,2,4,0,0,1,0\n"


def picture(dtype=np.uint8):
    ramp = np.linspace(0, np.iinfo(dtype).max, 12 * 16)
    return ramp.astype(dtype).reshape(12, 16)


def encoded(ending, dtype=np.uint8):
    return cv2.imencode(ending, picture(dtype))[1].tobytes()


def payload_files():
    pose = (0.1, 0.2, 0.3, 0.0, 0.0, 0.0, 1.0)
    return {
        "transforms": ros2.transforms((10**9, "base", "tool", pose)),
        "image": ros2.image(10**9, "camera", picture()),
        "compressed": ros2.compressed_image(10**9, "camera", encoded(".png"), "mono8"),
    }


def main():
    for name, content in payload_files().items():
        save("payloads", name, content)
    for ending in (".png", ".jpg", ".tiff", ".pgm", ".bmp", ".webp"):
        save("image", f"ramp{ending}", encoded(ending))
    save("image", "deep.png", encoded(".png", np.uint16))
    save("yaml", "stations.json", json.dumps(STATIONS).encode())
    save("yaml", "block.yaml", BLOCK.encode())
    save("metadata", "metadata.yaml", METADATA.encode())
    save("description", "arm.urdf", URDF.encode())
    save("samples", "arm.samples", json.dumps(EASY).encode())
    save("table", "poses.csv", CSV.encode())
    messages = list(bags.Robot(stations=1, rate=2.0, image_rate=1.0).messages())[:12]
    for name, options in {
        "plain": {"compression": CompressionType.NONE},
        "packed": {"compression": CompressionType.ZSTD},
        "unchunked": {"use_chunking": False},
    }.items():
        path = CORPUS / "mcap" / f"{name}.mcap"
        path.parent.mkdir(parents=True, exist_ok=True)
        bags.write(path, messages, **options)


def save(reader, name, content):
    path = CORPUS / reader / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(content)


if __name__ == "__main__":
    main()
