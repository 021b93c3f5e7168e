"""Files of sequences, as other programs write them."""

import json
import struct

import numpy as np


def write_ply(path, vertices, faces, comment=""):
    """Binary, in float64."""
    header = (f"ply\nformat binary_little_endian 1.0\n{comment}element vertex {len(vertices)}\n"
              "property double x\nproperty double y\nproperty double z\n"
              f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n")
    rows = np.zeros(len(faces), [("n", "u1"), ("corners", "<i4", 3)])
    rows["n"], rows["corners"] = 3, faces
    path.write_bytes(header.encode() + np.asarray(vertices, "<f8").tobytes() + rows.tobytes())


def write_stl(path, vertices, faces):
    """Binary, in float32: three vertices for each triangle."""
    rows = np.zeros(len(faces), [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("more", "<u2")])
    rows["corners"] = vertices[faces]
    path.write_bytes(bytes(80) + struct.pack("<I", len(faces)) + rows.tobytes())


def write_obj(path, vertices, faces):
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in np.asarray(vertices, float).tolist()]
    lines += ["f " + " ".join(str(corner + 1) for corner in face) for face in faces]
    path.write_text("\n".join(lines) + "\n")


def write_pc2(path, frames, start=0.0, rate=1.0, announced=None):
    frames = np.asarray(frames, "<f4")
    header = struct.pack("<12siiffi", b"POINTCACHE2\0", 1, frames.shape[1], start, rate,
                         announced or len(frames))
    path.write_bytes(header + frames.tobytes())


class Gltf:
    """A glTF document in the making, with its numbers in one buffer."""

    def __init__(self):
        self.data = b""
        self.json = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
                     "bufferViews": [], "accessors": [], "nodes": [], "meshes": []}

    def add(self, numbers, kind, component=5126):
        """The number of a new accessor."""
        array = np.asarray(numbers, {5126: "<f4", 5125: "<u4", 5123: "<u2"}[component])
        self.json["bufferViews"].append(
            {"buffer": 0, "byteOffset": len(self.data), "byteLength": array.nbytes})
        width = {"SCALAR": 1, "VEC3": 3, "VEC4": 4, "MAT4": 16}[kind]
        self.json["accessors"].append({"bufferView": len(self.json["bufferViews"]) - 1,
                                       "componentType": component, "count": array.size // width,
                                       "type": kind})
        self.data += array.tobytes() + bytes(-array.nbytes % 4)
        return len(self.json["accessors"]) - 1

    def mesh(self, vertices, faces, targets=(), **attributes):
        """The number of a new mesh."""
        primitive = {"attributes": {"POSITION": self.add(vertices, "VEC3"), **attributes},
                     "indices": self.add(faces, "SCALAR", 5125)}
        if len(targets):
            primitive["targets"] = [{"POSITION": self.add(t, "VEC3")} for t in targets]
        self.json["meshes"].append({"primitives": [primitive]})
        return len(self.json["meshes"]) - 1

    def animate(self, *channels):
        """(node, path, times, values, interpolation) of each channel."""
        kinds = {"rotation": "VEC4", "weights": "SCALAR"}
        animation = {"channels": [], "samplers": []}
        for node, path, times, values, interpolation in channels:
            animation["channels"].append({"sampler": len(animation["samplers"]),
                                          "target": {"node": node, "path": path}})
            animation["samplers"].append({"input": self.add(times, "SCALAR"),
                                          "output": self.add(values, kinds.get(path, "VEC3")),
                                          "interpolation": interpolation})
        self.json.setdefault("animations", []).append(animation)

    def write(self, path):
        """As .glb."""
        self.json["buffers"] = [{"byteLength": len(self.data)}]
        text = json.dumps(self.json).encode()
        text += b" " * (-len(text) % 4)
        path.write_bytes(b"glTF" + struct.pack("<II", 2, 28 + len(text) + len(self.data))
                         + struct.pack("<I4s", len(text), b"JSON") + text
                         + struct.pack("<I4s", len(self.data), b"BIN\0") + self.data)
