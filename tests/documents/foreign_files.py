"""Data sets in the formats of other tools, written from their descriptions and not by our code."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import yaml
from scipy.spatial.transform import Rotation

from handeye_cli.conventions import PoseUnits, Setup
from handeye_cli.documents import imports
from handeye_cli.documents.imports import ImportOptions
from handeye_cli.images import encode_png
from handeye_cli.records import Camera, GreyImage, TargetSpec

COUNT = 4
CAMERA = Camera(64, 48, 60.5, 61.25, 31.5, 23.75, (-0.125, 0.0, 0.0, 0.0, 0.0))
BOARD = TargetSpec("chessboard", {"columns": 9, "rows": 6, "square_mm": 20})


@dataclass(frozen=True)
class Shots:
    """What a robot and its camera have seen: (N, 4, 4) poses, and pictures where there are any."""

    setup: Setup
    base_T_gripper: np.ndarray
    camera_T_target: np.ndarray
    pictures: tuple[GreyImage, ...] = ()
    camera: Camera | None = None


@dataclass(frozen=True)
class Form:
    """A way to write shots: `write` returns the path to import and what the user says with it."""

    kind: str
    write: Callable[[Shots, Path], tuple[Path, ImportOptions]]
    pictures: bool = False


def quaternion(T):
    return dict(zip("xyzw", Rotation.from_matrix(T[:3, :3]).as_quat().tolist(), strict=True))


def vector(T):
    return dict(zip("xyz", T[:3, 3].tolist(), strict=True))


def transform(T):
    return {"translation": vector(T), "rotation": quaternion(T)}


def turned(shots):
    """The robot's poses as easy_handeye samples them: inverted for a camera beside the robot."""
    hand = shots.setup is Setup.EYE_IN_HAND
    return shots.base_T_gripper if hand else np.linalg.inv(shots.base_T_gripper)


def pairs(shots):
    return zip(shots.base_T_gripper, shots.camera_T_target, strict=True)


def said(shots, **more):
    return ImportOptions(setup=shots.setup, **more)


def dump(data, path):
    path.write_text(yaml.safe_dump(data, sort_keys=False), encoding="utf-8")
    return path


def save_pictures(shots, folder, name):
    folder.mkdir(parents=True, exist_ok=True)
    for index, image in enumerate(shots.pictures):
        (folder / name(index)).write_bytes(encode_png(image))


def easy_handeye2(shots, folder):
    kind = {Setup.EYE_IN_HAND: "eye_in_hand", Setup.EYE_TO_HAND: "eye_on_base"}[shots.setup]
    samples = [
        {"robot": transform(A), "tracking": transform(B)}
        for A, B in zip(turned(shots), shots.camera_T_target, strict=True)
    ]
    head = {"name": "", "calibration_type": kind, "move_group_namespace": "/"}
    return dump({"parameters": head, "samples": samples}, folder / "arm.samples"), ImportOptions()


def easy_handeye2_untold(shots, folder):
    path, _ = easy_handeye2(shots, folder)
    data = yaml.safe_load(path.read_text(encoding="utf-8"))
    data["parameters"]["calibration_type"] = ""
    return dump(data, path), said(shots)


def easy_handeye_lists(shots, folder):
    data = {
        "camera_marker_samples": {"transforms": [transform(B) for B in shots.camera_T_target]},
        "hand_world_samples": {"transforms": [transform(A) for A in turned(shots)]},
    }
    return dump({"samples": data}, folder / "list.yaml"), said(shots)


def moveit(shots, folder):
    data = [
        {"effector_wrt_world": A.ravel().tolist(), "object_wrt_sensor": B.ravel().tolist()}
        for A, B in pairs(shots)
    ]
    return dump(data, folder / "samples.yaml"), said(shots)


def moveit_json(shots, folder):
    path = folder / "pose_samples.json"
    path.write_text(json.dumps([[A.tolist(), B.tolist()] for A, B in pairs(shots)]))
    return path, said(shots)


def opencv_lists(shots, folder):
    A, B = shots.base_T_gripper, shots.camera_T_target
    data = {
        "R_gripper2base": A[:, :3, :3].tolist(),
        "t_gripper2base": A[:, :3, 3:].tolist(),
        "R_target2cam": Rotation.from_matrix(B[:, :3, :3]).as_rotvec()[..., None].tolist(),
        "t_target2cam": B[:, :3, 3].tolist(),
        "num_poses": len(A),
    }
    path = folder / "hand_eye_data.json"
    path.write_text(json.dumps(data), encoding="utf-8")
    return path, said(shots)


def opencv_samples(shots, folder):
    samples = [
        {"r_gripper2base": A[:3, :3].tolist(), "t_gripper2base": (1e3 * A[:3, 3]).tolist(),
         "r_target2cam": B[:3, :3].ravel().tolist(), "t_target2cam": (1e3 * B[:3, 3]).tolist()}
        for A, B in pairs(shots)
    ]  # fmt: skip
    return dump({"samples": samples}, folder / "data.yml"), said(shots, pose_units=PoseUnits.MM)


def opencv_npz(shots, folder):
    G, B = np.linalg.inv(shots.base_T_gripper), shots.camera_T_target
    arrays = {
        "R_base2gripper": G[:, :3, :3], "t_base2gripper": G[:, :3, 3],
        "R_target2cam": B[:, :3, :3], "t_target2cam": B[:, :3, 3:],
    }  # fmt: skip
    np.savez(folder / "data.npz", **arrays)
    return folder / "data.npz", said(shots)


def opencv_file_storage(shots, folder):
    def matrices(blocks):
        rows, columns = blocks[0].shape
        head = f"   - !!opencv-matrix\n      rows: {rows}\n      cols: {columns}\n      dt: d\n"
        return "".join(f"{head}      data: {each.ravel().tolist()}\n" for each in blocks)

    A, B = shots.base_T_gripper, shots.camera_T_target
    named = {
        "R_gripper2base": A[:, :3, :3], "t_gripper2base": A[:, :3, 3:],
        "R_target2cam": B[:, :3, :3], "t_target2cam": B[:, :3, 3:],
    }  # fmt: skip
    body = "".join(f"{name}:\n{matrices(blocks)}" for name, blocks in named.items())
    path = folder / "handeye.yml"
    path.write_text(f"%YAML:1.0\n---\n{body}", encoding="utf-8")
    return path, said(shots)


def visp_pose(T, path):
    numbers = [*T[:3, 3], *Rotation.from_matrix(T[:3, :3]).as_rotvec()]
    rows = "".join(f"  - [{number!r}]\n" for number in map(float, numbers))
    path.write_text(f"rows: 6\ncols: 1\ndata: \n{rows}", encoding="utf-8")


def visp_camera(camera, path, models=""):
    k1 = camera.distortion[0] if camera.distortion else 0.0
    common = (
        f"<px>{camera.fx!r}</px><py>{camera.fy!r}</py><!--Principal point-->"
        f"<u0>{camera.cx!r}</u0><v0>{camera.cy!r}</v0>"
    )
    path.write_text(
        '<?xml version="1.0"?>\n<root>\n  <camera>\n    <name>Camera</name>\n'
        f"<image_width>{camera.width}</image_width><image_height>{camera.height}</image_height>\n"
        f"<model><type>perspectiveProjWithoutDistortion</type>{common}</model>\n{models}"
        f"<model><type>perspectiveProjWithDistortion</type>{common}"
        f"<kud>{k1!r}</kud><kdu>{-k1!r}</kdu></model>\n  </camera>\n</root>\n",
        encoding="utf-8",
    )


def visp_poses(shots, folder):
    folder = folder / "run"
    folder.mkdir()
    for index, (A, B) in enumerate(pairs(shots), start=1):
        visp_pose(A, folder / f"franka_pose_fPe_{index}.yaml")
        visp_pose(B, folder / f"pose_cPo_{index}.yaml")
    return folder, said(shots)


def visp_images(shots, folder):
    for index, A in enumerate(shots.base_T_gripper):
        visp_pose(A, folder / f"pose_rPe_{index + 1}.yaml")
    save_pictures(shots, folder, lambda index: f"image-{index + 1}.png")
    visp_camera(shots.camera, folder / "camera.xml")
    return folder, said(shots, folder=folder)


def rct_list(shots, folder):
    (folder / "poses").mkdir()
    for index, A in enumerate(shots.base_T_gripper):
        pose = vector(A) | {f"q{axis}": value for axis, value in quaternion(A).items()}
        dump(pose, folder / f"poses/{index}.yaml")
    save_pictures(shots, folder / "images", lambda index: f"{index}.png")
    count = len(shots.base_T_gripper)
    return [{"pose": f"poses/{k}.yaml", "image": f"images/{k}.png"} for k in range(count)]


def robot_cal_tools(shots, folder):
    path = dump(rct_list(shots, folder), folder / "data.yaml")
    return path, said(shots, folder=folder)


def industrial_calibration(shots, folder):
    camera = shots.camera
    data = {
        "data": rct_list(shots, folder),
        "intrinsics": {"fx": camera.fx, "fy": camera.fy, "cx": camera.cx, "cy": camera.cy},
        "target_finder": {
            "type": "industrial_calibration::CharucoGridTargetFinderPlugin",
            "rows": 5, "cols": 7, "chessboard_dim": 0.012, "aruco_marker_dim": 0.009,
            "dictionary": 0,
        },
        "homography_threshold": 2.0,
        "static_camera": shots.setup is Setup.EYE_TO_HAND,
    }  # fmt: skip
    return dump(data, folder / "cal_data.yaml"), ImportOptions(folder=folder)


def row(T):
    return [*T[:3, 3].tolist(), *quaternion(T).values()]


def table(rows, path, header=None, separator=","):
    with path.open("w", newline="", encoding="utf-8") as file:
        csv.writer(file, delimiter=separator).writerows([header, *rows] if header else rows)
    return path


def csv_with_images(shots, folder):
    save_pictures(shots, folder / "shots", lambda index: f"{index}.png")
    rows = [[f"shots/{k}.png", *row(A)] for k, A in enumerate(shots.base_T_gripper)]
    header = ["Image", "pose.position.x", "pose.position.y", "pose.position.z",
              *(f"pose.orientation.{axis}" for axis in "xyzw")]  # fmt: skip
    return table(rows, folder / "poses.csv", header), said(shots, folder=folder)


def csv_by_number(shots, folder):
    """Degrees about moving axes, millimetres, shuffled, in the style of a robot's teach pendant."""
    save_pictures(shots, folder / "frames", lambda index: f"frame_{index + 1:04d}.png")
    angles = Rotation.from_matrix(shots.base_T_gripper[:, :3, :3]).as_euler("ZYX", degrees=True)
    places = 1e3 * shots.base_T_gripper[:, :3, 3]
    rows = [[k + 1, *places[k].tolist(), *angles[k].tolist()] for k in range(len(places))]
    path = table(rows[::-1], folder / "poses.csv", ["id", "X", "Y", "Z", "rx", "ry", "rz"], ";")
    more = {"pose_units": PoseUnits.MM, "rotation": "ZYX:deg", "images": str(folder / "frames")}
    return path, said(shots, folder=folder, **more)


def tum(shots, folder):
    """Poses at 50 Hz with pictures between: the robot stands still for a while at each station."""
    save_pictures(shots, folder / "rgb", lambda index: f"{1305031102 + 10 * index}.175304.png")
    lines = ["# ground truth trajectory", "# timestamp tx ty tz qx qy qz qw"]
    for index, A in enumerate(shots.base_T_gripper):
        for step in range(-5, 6):
            stamp = f"{1305031102 + 10 * index}.{175304 + 20000 * step + 7000:06d}"
            lines.append(" ".join([stamp, *map(repr, row(A))]))
    path = folder / "groundtruth.txt"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path, said(shots, folder=folder, images=str(folder / "rgb"))


FORMS = {
    "easy_handeye2": Form("easy-handeye", easy_handeye2),
    "easy_handeye2-untold": Form("easy-handeye", easy_handeye2_untold),
    "easy_handeye-lists": Form("easy-handeye", easy_handeye_lists),
    "moveit": Form("moveit", moveit),
    "moveit-json": Form("moveit", moveit_json),
    "opencv-lists": Form("opencv", opencv_lists),
    "opencv-samples": Form("opencv", opencv_samples),
    "opencv-npz": Form("opencv", opencv_npz),
    "opencv-file-storage": Form("opencv", opencv_file_storage),
    "visp-poses": Form("visp", visp_poses),
    "visp-images": Form("visp", visp_images, pictures=True),
    "robot_cal_tools": Form("industrial-calibration", robot_cal_tools, pictures=True),
    "industrial_calibration": Form("industrial-calibration", industrial_calibration, pictures=True),
    "csv-with-images": Form("trajectory", csv_with_images, pictures=True),
    "csv-by-number": Form("trajectory", csv_by_number, pictures=True),
    "tum": Form("trajectory", tum, pictures=True),
}


def shots(setup=Setup.EYE_IN_HAND):
    """Random poses that solve to nothing, and pictures that show nothing."""
    poses = np.tile(np.eye(4), (2 * COUNT, 1, 1))
    poses[:, :3, :3] = Rotation.random(2 * COUNT, random_state=3).as_matrix()
    poses[:, :3, 3] = np.random.default_rng(3).normal(size=(2 * COUNT, 3))
    grey = tuple(np.full((48, 64), 10 * index, np.uint8) for index in range(COUNT))
    return Shots(setup, poses[:COUNT], poses[COUNT:], grey, CAMERA)


def written(folder, name, /, setup=Setup.EYE_IN_HAND, **more):
    """Write the shots in a form; return the path, and the options with all that it leaves open."""
    path, options = FORMS[name].write(shots(setup), folder)
    common = {"target": BOARD, "own_camera": True} if FORMS[name].pictures else {}
    return path, replace(options, **common | more)


def import_changed(folder, name, change, /, **more):
    """Import a YAML or JSON form after a function has changed its data."""
    path, options = written(folder, name, **more)
    data = yaml.safe_load(path.read_text(encoding="utf-8"))
    change(data)
    path.write_text(json.dumps(data), encoding="utf-8")
    return imports.read(str(path), options, FORMS[name].kind)
