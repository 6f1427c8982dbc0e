#!/usr/bin/env python3
"""Reads a data set of `replayer --dataset`: dataset_example.py DIR [FRAME]. Needs NumPy and Pillow."""
import json
import pathlib
import sys

import numpy as np
from PIL import Image


class Dataset:
    """Frames by their number. Images are arrays (rows, columns[, channels]) with the first row at the top."""

    def __init__(self, folder):
        self.folder = pathlib.Path(folder)
        self.calibration = json.loads((self.folder / "calibration.json").read_text())
        self.frames = [json.loads(line) for line in (self.folder / "frames.jsonl").open()]

    def __len__(self):
        return len(self.frames)

    def image(self, kind, frame):
        return np.asarray(Image.open(self.folder / kind / f"{frame:06d}.png"))

    def depth_m(self, frame):
        """Depth along the optical axis [m]; NaN beside the round field."""
        raw = self.image("depth", frame).astype(np.float64)
        return np.where(raw > 0, raw * self.calibration["depth_unit_m"], np.nan)

    def temperature_C(self, frame):
        """Temperature of the sheet and of burnt solids; NaN elsewhere."""
        raw = self.image("temperature", frame).astype(np.float64)
        return np.where(raw > 0, raw * self.calibration["temperature_unit_C"], np.nan)

    def points_W(self, frame):
        """Point of each pixel in frame W [m], (rows, columns, 3)."""
        c, z = self.frames[frame], self.depth_m(frame)  # Its focal length: a held scope has a zoom ring.
        v, u = np.indices(z.shape) + 0.5
        points = np.stack([(u - c["cx"]) / c["fx"] * z, (v - c["cy"]) / c["fy"] * z, z], axis=-1)
        pose = np.linalg.inv(np.array(self.frames[frame]["world_to_camera"]))
        return points @ pose[:3, :3].T + pose[:3, 3]


if __name__ == "__main__":
    data = Dataset(sys.argv[1])
    number = int(sys.argv[2]) if len(sys.argv) > 2 else 0
    print(len(data), "frames; classes:", ", ".join(data.calibration["classes"]))
    classes, depth = data.image("class", number), data.depth_m(number)
    for index, name in enumerate(data.calibration["classes"]):
        pixels = depth[classes == index]
        if index > 0 and pixels.size > 0:
            print(f"{name:14s} {pixels.size:7d} pixels, {1e3 * np.nanmin(pixels):6.1f} to {1e3 * np.nanmax(pixels):6.1f} mm away")
    for tool in data.frames[number]["tools"]:
        print(f"tool {tool['tool']}: tip {tool['tip_m']} m, {tool['force_N']:.2f} N")
