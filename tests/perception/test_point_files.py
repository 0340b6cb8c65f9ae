"""Point files: separators, columns and headers that say one thing and hold another, and arrays of every shape."""

import json
import os
import struct

import numpy as np
import pytest

from sgnlp.base.errors import InputError
from sgnlp.perception import point_files, text_rows
from sgnlp.perception.clouds import read, safe_name
from sgnlp.perception.observation import load, observe

P = np.random.default_rng(0).uniform(0.05, 0.15, (60, 3)).round(5)


def text(form="%.5f %.5f %.5f", rows=P, change=lambda i, line: line, end="\n"):
    return end.join(change(i, form % tuple(row)) for i, row in enumerate(rows))


COMMA = text("%.5f %.5f %.5f").replace(".", ",")
READ = {
    "blanks": text(),
    "tabs and Windows": text("%.5f\t%.5f\t%.5f", end="\r\n"),
    "commas": text("%.5f,%.5f,%.5f"),
    "commas and blanks": text("%.5f, %.5f, %.5f"),
    "semicolons": text("%.5f;%.5f;%.5f"),
    "decimal commas": COMMA,
    "decimal commas and semicolons": COMMA.replace(" ", ";"),
    "decimal commas, commas and blanks": COMMA.replace(" ", ", "),
    "a heading": "X,Y,Z\n" + text("%.5f,%.5f,%.5f"),
    "named columns": "r,z,y,x\n" + text("7,%.5f,%.5f,%.5f", P[:, ::-1]),
    "a running number": text("%d %.5f %.5f %.5f", np.c_[np.arange(60), P]),
    "numbers of pixels": text("%d,%.5f,%.5f,%.5f", np.c_[7 * np.arange(60) + 3, P]),
    "colours behind": text("%.5f %.5f %.5f %d 4 200", np.c_[P, np.arange(60)]),
    "its count": "60\n" + text(),
    "comments": "# x y z\n// more\n" + text(),
    "a mark of its bytes": "\ufeff" + text(),
    "exponents": text("%.4e %.4e %.4e"),
    "ParaView's headings": '"Intensity","Points:0","Points:1","Points:2"\n' + text("0.7,%.5f,%.5f,%.5f"),
    "ParaView's newer headings": '"Point ID","Points_0","Points_1","Points_2","Points_Magnitude","Normals_0"\n'
    + text("%d,%.5f,%.5f,%.5f,0.2,1", np.c_[np.arange(60) % 7, P]),
    "headings with units": "t [s]; x [m]; y [m]; z [m]\n" + text("0.5; %.5f; %.5f; %.5f"),
    "names with a word before": "label pos_x pos_y pos_z\n" + text("1 %.5f %.5f %.5f"),
    "columns counted from 1": "i,P(1),P(2),P(3)\n" + text("0.5,%.5f,%.5f,%.5f"),
    "a scalar first, named in a comment": "# intensity x y z\n" + text("0.5 %.5f %.5f %.5f"),
    "CloudCompare's comment": "//Scalar_field X Y Z\n60\n" + text("0.5 %.5f %.5f %.5f"),
    "normals first, named in a comment": "# made by me\n# nx ny nz x y z\n" + text("0.6 0.8 0.0 %.5f %.5f %.5f"),
    "numbers for names": ",0,1,2\n" + text("%d,%.5f,%.5f,%.5f", np.c_[np.arange(60), P]),
    "a title": "Scan of my own cup\n" + text(),
    "a list of JSON": json.dumps(P.tolist()),
    "a list of JSON, indented": json.dumps(P.tolist(), indent=1),
    "tuples": "\n".join(map(str, map(tuple, P.tolist()))),
    "rows in brackets": text("[%.5f %.5f %.5f]"),
    "headings with units and frames": "world_z_mm,world_y_mm,world_x_mm\n" + text("%.5f,%.5f,%.5f", P[:, ::-1]),
    "a long comment": "#" + 200_000 * "a" + "\n" + text(),
}


@pytest.mark.parametrize("content", READ.values(), ids=READ.keys())
def test_text_is_read_whatever_separates_its_numbers(content):
    np.testing.assert_allclose(text_rows.points(content.encode()).points, P, atol=6e-6)
    np.testing.assert_allclose(text_rows.points(content.lstrip("\ufeff").encode("utf-16")).points, P, atol=6e-6)


REFUSED = {
    "two marks": (
        text(change=lambda i, line: line if i % 2 else line.replace(".", ",")),
        "mixes decimal commas .in 30 ",
    ),
    "commas for both": (COMMA.replace(" ", ","), "commas both as decimal marks and between"),
    "thousands": (text("1,%07.3f 2,%07.3f 1,%07.3f", 1e3 * P), "commas between thousands"),
    "half of the lines short": (
        text(change=lambda i, line: line if i % 2 else line.rsplit(" ", 1)[0]),
        "30 of 60 lines do not hold 3 numbers",
    ),
    "half of the lines long": (text(change=lambda i, line: f"{line} {line}" if i < 20 else line), "20 of 60 lines"),
    "colours first": (text("12 %d 255 %.5f %.5f %.5f", np.c_[np.arange(60), P]), "as colours are"),
    "normals first": (text("0.6 0.8 0.0 %.5f %.5f %.5f"), "as normals are"),
    "another count": ("30\n" + text(), "promises 30 points, but 60 lines follow"),
    "two columns": (text("%.5f %.5f", P[:, :2]), "no line of three numbers, but lines of 2"),
    "words": ("nothing\nhere", "no line of three numbers"),
    "labels first": (text("%d %.5f %.5f %.5f", np.c_[np.arange(60) % 3, P]), "whole numbers, as labels and indices"),
    "a shuffled index first": (text("%d %.5f %.5f %.5f", np.c_[np.arange(60)[::-1], P]), "as labels and indices"),
    "a heading without coordinates": ("a,b,c,d\n" + text("1.5,%.5f,%.5f,%.5f"), "no columns x, y and z: a, b, c, d"),
    "a heading of two coordinates": ("x,y,intensity\n" + text("%.5f,%.5f,%.5f"), "no columns x, y and z: x, y, inten"),
    "a heading with a blank too many": (
        "Point ID x y z\n" + text("1.5 %.5f %.5f %.5f"),
        "its heading names 5 columns, but its lines have 4: Point ID x y z; separate",
    ),
    "two columns of one name": ("x,y,z,x\n" + text("%.5f,%.5f,%.5f,1.5"), "names two columns x: x, y, z, x"),
}


@pytest.mark.parametrize(("content", "message"), REFUSED.values(), ids=REFUSED.keys())
def test_text_that_leaves_a_doubt_is_refused(content, message):
    with pytest.raises(InputError, match=message):
        text_rows.points(content.encode())


def test_a_first_line_of_zeros_is_a_point_and_no_heading():
    np.testing.assert_array_equal(text_rows.points(("0 0 0\n" + text()).encode()).points, [[0, 0, 0], *P])


def test_the_first_of_many_columns_without_names_are_taken_and_told():
    said = "Took the first 3 of 4 columns for x y z: no heading names them."
    assert text_rows.points(text("%.5f %.5f %.5f 0.5").encode()).notes == (said,)
    named = "x y z intensity\n" + text("%.5f %.5f %.5f 0.5")
    assert text_rows.points(named.encode()).notes == text_rows.points(text().encode()).notes == ()


@pytest.mark.parametrize("word", ["--", "null", "N/A", "nan"])
def test_lines_of_words_for_no_return_are_dropped_and_counted(word):
    content = text(change=lambda i, line: line if i % 3 else " ".join([word] * 3))
    found = text_rows.points(content.encode())
    finite = found.points[np.isfinite(found.points).all(axis=1)]
    np.testing.assert_array_equal(finite, P[np.arange(60) % 3 > 0])
    assert (found.notes == ("Dropped 20 of 60 lines without a number.",)) == (word != "nan")


def test_a_few_broken_lines_are_dropped_and_counted():
    found = text_rows.points((text() + "\n0.1 0.2\nEOF").encode())
    assert found.notes == ("Dropped lines: 2 of 62 lines do not hold 3 numbers as the others do.",)
    np.testing.assert_array_equal(found.points, P)


def pcd(folder, body, count=60, fields="x y z", size="4 4 4", kind="F F F", each="1 1 1", data="binary", end="\n"):
    head = f"VERSION 0.7\nFIELDS {fields}\nSIZE {size}\nTYPE {kind}\nCOUNT {each}\nWIDTH {count}\nHEIGHT 1\n"
    head += f"VIEWPOINT 0 0 0 1 0 0 0\nPOINTS {count}\nDATA {data}\n"
    file = folder / "c.pcd"
    file.write_bytes(head.replace("\n", end).encode() + body)
    return file


SINGLE = P.astype("<f4")


def test_binary_and_ascii_pcd_of_every_type_are_read(tmp_path):
    assert np.array_equal(point_files.read(pcd(tmp_path, SINGLE.tobytes())).points, SINGLE)
    assert np.array_equal(point_files.read(pcd(tmp_path, SINGLE.tobytes(), end="\r\n")).points, SINGLE)
    assert np.array_equal(point_files.read(pcd(tmp_path, P.astype("<f8").tobytes(), size="8 8 8")).points, P)
    millimetres = (1000 * P).astype("<i2")
    file = pcd(tmp_path, millimetres.tobytes(), size="2 2 2", kind="I I I")
    assert np.array_equal(point_files.read(file).points, millimetres)
    padded = np.c_[np.zeros(60), SINGLE, np.zeros(60)].astype("<f4").tobytes()
    file = pcd(tmp_path, padded, fields="rgb x y z _", size="4 4 4 4 1", kind="U F F F U", each="1 1 1 1 4")
    assert np.array_equal(point_files.read(file).points, SINGLE)
    assert np.array_equal(point_files.read(pcd(tmp_path, text().encode(), data="ascii")).points, P)
    file = pcd(tmp_path, text("9 %.5f %.5f %.5f", P[:, ::-1]).encode(), fields="i z y x", size="4 4 4 4",
               kind="F F F F", each="1 1 1 1", data="ascii")  # fmt: skip
    assert np.array_equal(point_files.read(file).points, P)


@pytest.mark.parametrize("promised", [30, 90])
@pytest.mark.parametrize(("data", "body"), [("binary", SINGLE.tobytes()), ("ascii", text().encode())])
def test_a_pcd_that_promises_another_number_of_points_is_refused(tmp_path, promised, data, body):
    with pytest.raises(InputError, match=f"damaged .pcd file: the header says {promised} points, the file holds 60"):
        point_files.read(pcd(tmp_path, body, promised, data=data))


def test_a_compressed_pcd_is_compared_with_its_header_before_it_is_unpacked(tmp_path):
    packed = struct.pack("<II", 100, 60 * 12) + bytes(50)
    with pytest.raises(InputError, match="it ends after 58 of 108 bytes"):
        point_files.read(pcd(tmp_path, packed, data="binary_compressed"))
    with pytest.raises(InputError, match="the header says 30 points, the file holds 60"):
        point_files.read(pcd(tmp_path, packed, 30, data="binary_compressed"))
    doubles = struct.pack("<II", 100, 60 * 24) + bytes(100)
    with pytest.raises(InputError, match="not 32-bit floats"):
        point_files.read(pcd(tmp_path, doubles, size="8 8 8", data="binary_compressed"))


def test_a_pcd_without_coordinates_or_with_a_garbled_header_is_refused(tmp_path):
    with pytest.raises(InputError, match="names no x, y, z among its fields: nx ny nz"):
        point_files.read(pcd(tmp_path, SINGLE.tobytes(), fields="nx ny nz"))
    for wrong in ({"size": "4 4"}, {"kind": "F F Q"}, {"size": "4 4 x"}, {"size": "3 4 4"}, {"data": "zip"}):
        with pytest.raises(InputError, match=r"is a damaged \.pcd file"):
            point_files.read(pcd(tmp_path, SINGLE.tobytes(), **wrong))
    (tmp_path / "c.pcd").write_bytes(b"nothing")
    with pytest.raises(InputError, match=r"is a damaged \.pcd file"):
        point_files.read(tmp_path / "c.pcd")


def ply(body, count=60, form="binary_little_endian", names="xyz", more="", end="\n"):
    properties = "".join(f"property float {name}\n" for name in names)
    head = f"ply\nformat {form} 1.0\nelement vertex {count}\n{properties}{more}end_header\n"
    return head.replace("\n", end).encode() + body


FACES = "element face 1\nproperty list uchar int vertex_indices\n"
PLY = {
    "as it says": (ply(SINGLE.tobytes()), ""),
    "text": (ply(text().encode(), form="ascii", end="\r\n"), ""),
    "faces": (ply(text().encode() + b"\n3 0 1 2", form="ascii", more=FACES), "Left 1 faces aside"),
    "less": (ply(SINGLE.tobytes(), 30), "the header says 30 points, the file holds 60"),
    "less text": (ply(text().encode(), 30, form="ascii"), "the header says 30 points, the file holds 60"),
    "less text with faces": (ply(text().encode() + b"\n3 0 1 2", 30, "ascii", more=FACES), "says 30 .* holds 60"),
    "more": (ply(SINGLE.tobytes(), 90), "the header says 90 points, the file holds 60"),
    "decimal commas": (ply(COMMA.encode(), form="ascii"), "Read the commas as decimal marks"),
    "lists first": (
        ply(SINGLE.tobytes()).replace(b"element vertex", FACES.encode() + b"element vertex"),
        "has lists before or among its points",
    ),
    "another element first": (
        ply(b"\0" * 8 + SINGLE.tobytes()).replace(
            b"element vertex", b"element camera 2\nproperty float f\nelement vertex"
        ),
        "",
    ),
    "capitals": (ply(SINGLE.tobytes(), names="XYZ"), ""),
    "other names": (ply(SINGLE.tobytes(), names="uvw"), "names no x, y, z among its fields: u v w"),
    "half floats": (ply(SINGLE.tobytes()).replace(b"property float x", b"property float16 x"), "of the type 'float16'"),
}


@pytest.mark.parametrize(("content", "message"), PLY.values(), ids=PLY.keys())
def test_the_header_of_a_ply_is_compared_with_what_follows(tmp_path, content, message):
    file = tmp_path / "c.ply"
    file.write_bytes(content)
    if message.startswith(("Left", "Read")) or not message:
        found = point_files.read(file)
        assert " ".join(found.notes).startswith(message)
        np.testing.assert_allclose(found.points, P, atol=6e-6)
        return
    with pytest.raises(InputError, match=message):
        point_files.read(file)


def test_a_big_endian_ply_is_read(tmp_path):
    file = tmp_path / "c.ply"
    file.write_bytes(ply(P.astype(">f4").tobytes(), form="binary_big_endian", end="\r\n"))
    np.testing.assert_array_equal(point_files.read(file).points, SINGLE)


def test_a_first_line_that_names_no_columns_is_told():
    assert text_rows.points(("lon,lat,alt\n" + text("%.5f,%.5f,%.5f")).encode()).notes == (
        "Read commas as separators.",
        "Left the first line aside, which names no x, y and z: lon,lat,alt",
    )
    assert text_rows.points(("x,y,z\n" + text("%.5f,%.5f,%.5f")).encode()).notes == ("Read commas as separators.",)


def test_a_refusal_repeats_what_was_assumed_of_a_file(tmp_path):
    file = tmp_path / "c.xyz"
    file.write_text(text("%.3f %.5f %.5f %.5f", np.c_[np.random.default_rng(0).random(60), P]))
    with pytest.raises(
        InputError, match=r"m wide, .* \(Took the first 3 of 4 columns for x y z: no heading names them\.\)"
    ):
        load(file)
    faces = b"element face 0\nproperty list uchar int vertex_indices\n".replace(b"face 0", b"face 1")
    file = tmp_path / "c.ply"
    file.write_bytes(
        ply((6 * P).astype("<f4").tobytes()).replace(b"end_header", faces + b"end_header") + b"\3" + bytes(12)
    )
    with pytest.raises(InputError, match=r"\(Left 1 faces aside: `sgnlp observe`"):
        load(file)


def test_bytes_in_the_wrong_order_are_refused_in_one_line(tmp_path, recwarn):
    file = tmp_path / "c.ply"
    file.write_bytes(ply(P.astype("<f4").tobytes(), form="binary_big_endian"))
    with pytest.raises(InputError, match="another order of bytes"):
        load(file)
    assert not recwarn.list


FOREIGN = {
    "packed.ply": (b"\x1f\x8b\x08", "is packed; unpack it first"),
    "pointer.npz": (b"version https://git-lfs.github.com/spec/v1\n", "git lfs pull"),
    "page.ply": (b"\n<!DOCTYPE html><html>", "is a web page"),
    "archive.txt": (b"PK\x03\x04", "is an npz or a zip archive; name it .npz"),
    "cloud.txt": (b"# .PCD v0.7\n", "is a .pcd; name it so"),
    "cloud.npz": (b"ply\nformat ascii 1.0\n", "is a .ply; name it so"),
    "image.npy": (b"\x89PNG\r\n", "is a picture; `sgnlp cloud`"),
    "body.stl": (b"solid body\n", "is a mesh; `sgnlp observe` makes the cloud"),
    "body.step": (b"ISO-10303-21;", "is a mesh"),
    "scan.mat": (b"MATLAB 5.0 MAT-file", "is of MATLAB"),
}


@pytest.mark.parametrize("name", FOREIGN)
def test_a_file_of_another_kind_is_called_by_its_name(tmp_path, name):
    content, message = FOREIGN[name]
    (tmp_path / name).write_bytes(content)
    with pytest.raises(InputError, match=message):
        load(tmp_path / name)


# Arrays ---------------------------------------------------------------------------------------------------------------


def test_arrays_of_images_and_of_records_are_points(tmp_path):
    file = tmp_path / "c.npy"
    for array in (P, P.reshape(6, 10, 3), np.array([(*p, 7) for p in P], "f8, f8, f8, i4").view()):
        named = array if array.dtype.names is None else array.view([("x", "f8"), ("y", "f8"), ("z", "f8"), ("i", "i4")])
        np.save(file, named)
        np.testing.assert_array_equal(load(file, table_height=0.0).points, observe(P, table_height=0.0).points)
    np.savez(tmp_path / "c.npz", points_a=P.reshape(6, 10, 3), points_b=P + 0.001)
    assert load(tmp_path / "c.npz", table_height=0.0).view_names == ("a", "b")


def test_points_under_another_key_are_offered_and_read(tmp_path):
    file = tmp_path / "c.npz"
    np.savez(file, pc=P, mask=np.zeros(60))
    with pytest.raises(InputError, match=r"if 'pc' holds the points, say --key pc; its keys: mask, pc"):
        load(file)
    np.testing.assert_array_equal(read(file, "pc")["points"], P)
    assert load(file, key="pc").reading.key == "pc"
    with pytest.raises(InputError, match="unknown key 'pcd'; valid: mask, pc"):
        load(file, key="pcd")


def test_of_several_arrays_that_may_be_the_points_all_are_offered(tmp_path):
    np.savez(tmp_path / "c.npz", scene=P, cup=P)
    with pytest.raises(InputError, match="say which of scene, cup holds the points, such as --key scene"):
        load(tmp_path / "c.npz")


def test_pickled_files_name_the_line_that_converts_them(tmp_path):
    np.save(tmp_path / "c.npy", {"pc": P}, allow_pickle=True)
    with pytest.raises(InputError, match=r"never read; .*np\.load\('c\.npy', allow_pickle=True\)"):
        load(tmp_path / "c.npy")


@pytest.mark.parametrize("key", ["rgb", "colors", "normals", "labels", "bytes", "directions"])
def test_attributes_of_points_are_no_cameras(tmp_path, key):
    unit = P / np.linalg.norm(P, axis=1, keepdims=True)
    array = {"bytes": (255 * P).astype(np.uint8), "directions": unit}.get(key, P)
    np.savez(tmp_path / "c.npz", points_left=P, **{f"points_{key}": array})
    raw = read(tmp_path / "c.npz")
    assert raw["view_names"] == ("left",)
    assert raw["notes"] == (f"Took points_{key} for attributes of the points, not for cameras.",)


@pytest.mark.parametrize(
    ("name", "safe"),
    [
        ("can (1)", "can _1_"),
        ("can [red]", "can _red_"),
        ("-can", "can"),
        ("can😀", "can_"),
        ("试验", "试验"),
        ("...", "object"),
    ],
)
def test_the_name_of_a_result_is_one_for_a_folder(tmp_path, name, safe):
    assert safe_name(name) == safe
    try:
        os.fsencode(name)
    except UnicodeEncodeError:
        pytest.skip("this locale has no such file names")
    np.save(tmp_path / f"{name}.npy", P)
    assert load(tmp_path / f"{name}.npy").name == safe
