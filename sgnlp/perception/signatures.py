"""What a file is by its first bytes, whatever its name says: an archive, a picture, a web page, another tool's file."""

from typing import NamedTuple

from sgnlp.base.errors import InputError

HEAD = 512
"""[bytes] Enough of a file to know it by."""


class Kind(NamedTuple):
    """A kind of file, the bytes that it begins with, and what to do with it."""

    key: str
    heads: tuple[bytes, ...]
    name: str
    remedy: str


PICTURE = "`sgnlp cloud` makes a cloud of depth images"
SAVE = "save its points as .npy, .npz, .ply or .pcd with the tool that wrote it"
MESH = "`sgnlp observe` makes the cloud of a mesh"
KINDS = (
    Kind("npy", (b"\x93NUMPY",), "an array of NumPy", "name it .npy"),
    Kind("zip", (b"PK\x03\x04", b"PK\x05\x06"), "an npz or a zip archive", "name it .npz, or unpack it"),
    Kind("ply", (b"ply\n", b"ply\r"), "a .ply", "name it so"),
    Kind("pcd", (b"# .PCD", b"VERSION 0.7", b"VERSION .7"), "a .pcd", "name it so"),
    Kind("packed", (b"\x1f\x8b", b"BZh", b"\xfd7zXZ", b"7z\xbc\xaf", b"\x28\xb5\x2f\xfd"), "packed", "unpack it first"),
    Kind("lfs", (b"version https://git-lfs",), "a pointer of Git LFS, not the file itself", "fetch it: git lfs pull"),
    Kind("html", (b"<!DOCTYPE html", b"<!doctype html", b"<html", b"<HTML"), "a web page", "download the file itself"),
    Kind("hdf5", (b"\x89HDF",), "HDF5", SAVE),
    Kind("mat", (b"MATLAB ",), "of MATLAB", "save its points as text: writematrix(points, 'points.txt')"),
    Kind("las", (b"LASF",), "a LAS of laser scanning", SAVE),
    Kind("e57", (b"ASTM-E57",), "an E57 of laser scanning", SAVE),
    Kind("bag", (b"#ROSBAG", b"\x89MCAP", b"SQLite format 3"), "a recording (bag)", "save one of its clouds as .pcd"),
    Kind("pickle", (b"\x80\x02", b"\x80\x03", b"\x80\x04", b"\x80\x05"), "a pickle, which is never read",
         "load it where you trust it, and save the points by numpy.save"),
    Kind("png", (b"\x89PNG",), "a picture", PICTURE),
    Kind("jpeg", (b"\xff\xd8\xff",), "a picture", PICTURE),
    Kind("tiff", (b"II*\x00", b"MM\x00*"), "a picture", PICTURE),
    Kind("exr", (b"\x76\x2f\x31\x01",), "an OpenEXR picture", "save its depths by numpy.save as .npy"),
    Kind("pdf", (b"%PDF",), "a PDF", "give the file of the points"),
    Kind("gltf", (b"glTF",), "a mesh", MESH),
)  # fmt: skip
PICTURES = ("png", "jpeg", "tiff")
"""Keys of the kinds that are pictures of any content."""


def kind_of(head: bytes, *own: str) -> Kind | None:
    """The kind of a file with these first bytes; None if it is not known, or one of its `own` keys."""
    text = head.removeprefix(b"\xef\xbb\xbf").lstrip(b"\r\n ")
    return next((kind for kind in KINDS if kind.key not in own and text.startswith(kind.heads)), None)


def refuse_others(head: bytes, *own: str) -> None:
    """Raise `InputError` if a file with these first bytes is known to be of another kind than its `own` keys."""
    if kind := kind_of(head, *own):
        raise InputError(f"is {kind.name}; {kind.remedy}")
