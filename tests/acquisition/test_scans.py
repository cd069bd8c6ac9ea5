"""Reading scans: every format, every way a file can be broken, and the folder layouts."""

import struct
import sys
import warnings
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from ersatz.acquisition import depth_images, layouts
from ersatz.acquisition.camera import CameraSettings
from ersatz.acquisition.cloud_files import read_cloud
from ersatz.acquisition.depth_sensor import Intrinsics
from ersatz.acquisition.extras import open3d
from ersatz.acquisition.layouts import FolderSettings, iter_scans, list_scans, select_paper
from ersatz.acquisition.parametric import box, tumbler
from ersatz.acquisition.scans import Scan, read_scan
from ersatz.errors import ErsatzWarning, InputError, MissingDependencyError, ScanError
from ersatz.measurements import Origin

CLOUD = np.random.default_rng(0).uniform(-0.05, 0.05, (200, 3)) + np.array([0, 0, 0.7])


def pcd(points: NDArray[np.float64], coding: str = "ascii", **changed: str) -> bytes:
    header = {
        "FIELDS": "x y z",
        "SIZE": "4 4 4",
        "TYPE": "F F F",
        "COUNT": "1 1 1",
        "WIDTH": str(len(points)),
        "HEIGHT": "1",
        "VIEWPOINT": "0 0 0 1 0 0 0",
        "POINTS": str(len(points)),
        "DATA": coding,
    } | changed
    text = "# .PCD v.7\n" + "".join(f"{key} {value}\n" for key, value in header.items())
    plain = points.astype("<f4")
    if coding == "ascii":
        body = "".join(" ".join(map(repr, map(float, row))) + "\n" for row in plain).encode()
    elif coding == "binary":
        body = plain.tobytes()
    else:
        data = plain.T.tobytes()
        # Literal runs only: valid LZF that any reader must understand.
        packed = b"".join(
            bytes([len(data[i : i + 32]) - 1]) + data[i : i + 32] for i in range(0, len(data), 32)
        )
        body = struct.pack("<II", len(packed), len(data)) + packed
    return text.encode() + body


def ply(points: NDArray[np.float64], triangles: NDArray[np.int64], coding: str) -> bytes:
    order = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}[coding]
    head = (
        f"ply\nformat {coding} 1.0\ncomment made for a test\nelement vertex {len(points)}\n"
        "property float x\nproperty float y\nproperty float z\n"
        f"element face {len(triangles)}\nproperty list uchar int vertex_indices\nend_header\n"
    ).encode()
    if not order:
        rows = [" ".join(map(repr, map(float, p))) for p in points] + [
            f"3 {a} {b} {c}" for a, b, c in triangles
        ]
        return head + ("\n".join(rows) + "\n").encode()
    faces = b"".join(struct.pack(f"{order}B3i", 3, *map(int, row)) for row in triangles)
    return head + points.astype(f"{order}f4").tobytes() + faces


@pytest.mark.parametrize("coding", ["ascii", "binary", "binary_compressed"])
def test_pcd_codings_hold_the_same_points(tmp_path: Path, coding: str) -> None:
    path = tmp_path / "apple_1_1_1.pcd"
    path.write_bytes(pcd(CLOUD, coding))
    scan = read_scan(path, "apple", "apple_1")
    np.testing.assert_array_equal(scan.points, CLOUD.astype(np.float32))
    assert scan.partial
    assert scan.sensor is not None and (scan.sensor == 0).all()
    assert (scan.object_class, scan.instance, scan.source.name) == ("apple", "apple_1", "apple_1_1_1.pcd")
    assert len(scan.source.sha256) == 64


def test_lzf_back_references(tmp_path: Path) -> None:
    """A run of equal bytes, packed as one literal and an overlapping copy, as PCL's writer does."""
    points = np.full((60, 3), 0.5) + np.arange(60)[:, None] * [0.0, 0.0, 0.001] + [0, 0.3, 0]
    points[30:, 1] += 0.1
    data = points.astype("<f4").T.tobytes()
    first = data[:4]
    # Column x is 60 times one number: 4 literal bytes, then copies of 4 bytes back.
    copies = b"".join(bytes([7 << 5, 200 - 9, 3]) for _ in range(1)) + bytes([(236 - 200 - 2) + 0 & 0])
    packed = bytes([3]) + first + copies[:3]
    rest = data[204:]
    packed += b"".join(bytes([len(rest[i : i + 32]) - 1]) + rest[i : i + 32] for i in range(0, len(rest), 32))
    head = pcd(points, "binary").split(b"DATA")[0] + b"DATA binary_compressed\n"
    path = tmp_path / "runs.pcd"
    path.write_bytes(head + struct.pack("<II", len(packed), len(data)) + packed)
    np.testing.assert_array_equal(read_cloud(path).points, points.astype(np.float32))


@pytest.mark.parametrize("coding", ["ascii", "binary_little_endian", "binary_big_endian"])
def test_ply_codings_hold_the_same_mesh(tmp_path: Path, coding: str) -> None:
    mesh = box(0.1, 0.2, 0.3)
    path = tmp_path / "box.ply"
    path.write_bytes(ply(mesh.vertices, mesh.triangles, coding))
    scan = read_scan(path)
    assert scan.mesh is not None and not scan.partial
    np.testing.assert_allclose(scan.mesh.vertices, mesh.vertices, atol=1e-7)
    np.testing.assert_array_equal(scan.mesh.triangles, mesh.triangles)


def test_obj_stl_xyz_npz(tmp_path: Path) -> None:
    mesh = box(0.1, 0.2, 0.3)
    vertices = "".join(f"v {x} {y} {z}\n" for x, y, z in mesh.vertices)
    (tmp_path / "a.obj").write_text(
        vertices + "".join(f"f {a + 1}/1 {b + 1}/1 {c + 1}/1\n" for a, b, c in mesh.triangles)
    )
    corners = mesh.corners.astype("<f4")
    records = b"".join(bytes(12) + c.tobytes() + bytes(2) for c in corners)
    (tmp_path / "a.stl").write_bytes(bytes(80) + struct.pack("<I", len(corners)) + records)
    lines = ["solid a"]
    for triangle in corners:
        lines += [
            "facet normal 0 0 0",
            "outer loop",
            *(f"vertex {x} {y} {z}" for x, y, z in triangle),
            "endloop",
            "endfacet",
        ]
    (tmp_path / "b.stl").write_text("\n".join([*lines, "endsolid a"]))
    for name in ("a.obj", "a.stl", "b.stl"):
        scan = read_scan(tmp_path / name)
        assert scan.mesh is not None
        assert scan.mesh.areas.sum() == pytest.approx(2 * (0.02 + 0.03 + 0.06), rel=1e-5), name
    np.savetxt(tmp_path / "a.xyz", CLOUD)
    np.savez(tmp_path / "a.npz", points=CLOUD, sensor=np.array([0.0, 0, 1]))
    np.testing.assert_allclose(read_scan(tmp_path / "a.xyz").points, CLOUD)
    assert not read_scan(tmp_path / "a.xyz").partial
    assert read_scan(tmp_path / "a.npz").partial


def test_dae_through_open3d(tmp_path: Path) -> None:
    (tmp_path / "broken.dae").write_text("<COLLADA>")
    with pytest.raises(ScanError, match="no geometry"):
        read_scan(tmp_path / "broken.dae")


def test_units_scale_points_and_sensor(tmp_path: Path) -> None:
    path = tmp_path / "mm.pcd"
    path.write_bytes(pcd(CLOUD * 1000))
    np.testing.assert_allclose(read_scan(path, unit="mm").points, CLOUD, atol=1e-6)
    with pytest.raises(ScanError, match="millimetres"):
        read_scan(path)
    with pytest.raises(ScanError, match="unknown unit 'ell'"):
        read_scan(path, unit="ell")


BROKEN: dict[str, tuple[str, Callable[[], bytes], str]] = {
    "missing": ("a.pcd", lambda: b"", "no such file"),
    "empty file": ("a.pcd", lambda: b"\n", "no line 'DATA'"),
    "no points": ("a.pcd", lambda: pcd(CLOUD[:0]), "holds no points"),
    "one point": ("a.pcd", lambda: pcd(CLOUD[:1]), "1 distinct point"),
    "all NaN": ("a.pcd", lambda: pcd(CLOUD * np.nan), "0 distinct point"),
    "one point many times": ("a.pcd", lambda: pcd(np.repeat(CLOUD[:1], 99, axis=0)), "1 distinct point"),
    "on one line": ("a.pcd", lambda: pcd(np.linspace(0, 0.1, 99)[:, None] * [1, 2, 3]), "on one line"),
    "too small": ("a.pcd", lambda: pcd((CLOUD - CLOUD.mean(axis=0)) * 1e-3), "too small"),
    "truncated ascii": ("a.pcd", lambda: pcd(CLOUD)[:-2000], "truncated: 200 rows"),
    "truncated binary": ("a.pcd", lambda: pcd(CLOUD, "binary")[:-1], "truncated: 200 records of 12 bytes"),
    "truncated compressed": ("a.pcd", lambda: pcd(CLOUD, "binary_compressed")[:-1], "truncated"),
    "wrong packed size": (
        "a.pcd",
        lambda: pcd(CLOUD, "binary_compressed", WIDTH="199", POINTS="199"),
        "truncated",
    ),
    "impossible field size": (
        "a.pcd",
        lambda: pcd(CLOUD, "binary", SIZE="3 4 4"),
        "impossible type and size 'f3'",
    ),
    "sizes do not match fields": ("a.pcd", lambda: pcd(CLOUD, SIZE="4 4"), "3 fields, but 2 sizes"),
    "points do not match width": (
        "a.pcd",
        lambda: pcd(CLOUD, POINTS="7"),
        "POINTS 7 is not WIDTH x HEIGHT = 200",
    ),
    "absurd number of points": (
        "a.pcd",
        lambda: pcd(CLOUD, WIDTH="99999999999", POINTS="99999999999"),
        "at most",
    ),
    "unknown coding": (
        "a.pcd",
        lambda: pcd(CLOUD).replace(b"DATA ascii", b"DATA base64"),
        "'base64' is none of",
    ),
    "no coordinates": ("a.pcd", lambda: pcd(CLOUD, FIELDS="a b c"), "no fields x, y, z"),
    "not a number": ("a.pcd", lambda: pcd(CLOUD).replace(b"0.", b"x.", 9), "not a readable PCD"),
    "truncated ply": (
        "a.ply",
        lambda: ply(CLOUD, np.array([[0, 1, 2]]), "binary_little_endian")[:-1],
        "truncated",
    ),
    "truncated ascii ply": (
        "a.ply",
        lambda: ply(CLOUD, np.array([[0, 1, 2]] * 3), "ascii")[:-9],
        "truncated|corners",
    ),
    "bad index": ("a.ply", lambda: ply(CLOUD, np.array([[0, 1, 200]]), "ascii"), "vertex 200"),
    "not a ply": ("a.ply", lambda: b"plywood", "readable|end_header"),
    "obj without vertices": ("a.obj", lambda: b"# nothing\n", "no vertex line"),
    "truncated stl": (
        "a.stl",
        lambda: bytes(80) + struct.pack("<I", 5) + bytes(100),
        "truncated: 5 triangles",
    ),
    "ragged xyz": ("a.xyz", lambda: b"1 2 3\n1 2\n", "rows of \\[2, 3\\] numbers"),
    "npz without points": ("a.npz", lambda: b"PK\x05\x06" + bytes(18), "no array 'points'"),
    "unknown kind": ("a.docx", lambda: b"x", "unknown kind of file '.docx'"),
}


@pytest.mark.filterwarnings("ignore::ersatz.errors.ErsatzWarning")
@pytest.mark.parametrize("case", BROKEN)
def test_broken_scans_are_clear_errors(tmp_path: Path, case: str) -> None:
    name, content, message = BROKEN[case]
    path = tmp_path / name
    if content():
        path.write_bytes(content())
    with pytest.raises(ScanError, match=message) as caught:
        read_scan(path)
    assert name in str(caught.value)
    assert "\n" not in str(caught.value)


def test_doubtful_scans_are_read_with_a_warning(tmp_path: Path) -> None:
    holes = CLOUD.copy()
    holes[:120] = np.nan
    (tmp_path / "holes.pcd").write_bytes(pcd(holes))
    with pytest.warns(ErsatzWarning, match="120 of 200 points are not finite"):
        assert len(read_scan(tmp_path / "holes.pcd").points) == 80
    flat = CLOUD * [1, 1, 0] + [0, 0, 0.7]
    (tmp_path / "flat.pcd").write_bytes(pcd(flat))
    with pytest.warns(ErsatzWarning, match="in one plane"):
        read_scan(tmp_path / "flat.pcd")
    few_holes = np.concatenate([CLOUD, np.full((50, 3), np.nan), np.zeros((20, 3)), CLOUD[:30]])
    (tmp_path / "organised.pcd").write_bytes(pcd(few_holes))
    assert len(read_scan(tmp_path / "organised.pcd").points) == 200


@pytest.mark.parametrize("thickness", [0.0, 1e-4, 1e-3])
def test_a_flat_mesh_is_refused_and_a_thin_one_is_not(thickness: float, tmp_path: Path) -> None:
    """A mesh of one side of a thing would be measured as a thing without volume, hollowness or content."""
    flat = tmp_path / "cloth" / "cloth_1.ply"
    flat.parent.mkdir()
    whole, turn = box(0.25, 0.13, 1.0), np.linalg.qr(np.ones((3, 3)) + np.eye(3))[0]
    flat.write_bytes(ply(whole.vertices * [1, 1, thickness] @ turn, whole.triangles, "ascii"))
    if thickness >= 1e-3:
        assert read_scan(flat).mesh is not None
        return
    with pytest.raises(ScanError, match=r"cloth_1\.ply: flat: the mesh is 0\.25 m long and .* m thick"):
        read_scan(flat)
    with pytest.warns(ErsatzWarning, match="skipped: .*cloth_1.ply: flat"):
        assert not list(iter_scans(tmp_path, FolderSettings(keep_going=True)))


def test_huge_cloud_is_thinned_with_a_warning(tmp_path: Path) -> None:
    points = np.random.default_rng(1).uniform(0, 0.2, (1_200_000, 3))
    (tmp_path / "huge.pcd").write_bytes(pcd(points, "binary"))
    with pytest.warns(ErsatzWarning, match="1200000 points, of which every 3th"):
        assert len(read_scan(tmp_path / "huge.pcd").points) == 400_000


def test_pickles_are_not_opened(tmp_path: Path) -> None:
    np.savez(tmp_path / "evil.npz", points=np.array([{"a": 1}], dtype=object))
    with pytest.raises(ScanError, match="allow_pickle"):
        read_scan(tmp_path / "evil.npz")


def test_missing_open3d_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "open3d", None)
    with pytest.raises(MissingDependencyError, match=r"ersatz\[scans\].*libusb-1.0-0 libgl1 libegl1"):
        open3d()


def test_scan_checks_its_arrays() -> None:
    with pytest.raises(ScanError, match=r"shape \(n, 3\)"):
        Scan(np.zeros((0, 3)))
    with pytest.raises(ScanError, match="not a finite number"):
        Scan(np.array([[0, 0, np.inf]]))
    with pytest.raises(ScanError, match="normals have shape"):
        Scan(CLOUD, normals=CLOUD[:3])
    with pytest.raises(ScanError, match="mass of -1"):
        Scan(CLOUD, mass=-1.0)


def write_png(path: Path, image: NDArray[np.generic]) -> None:
    library = open3d()
    assert library.io.write_image(str(path), library.geometry.Image(np.ascontiguousarray(image)))


def test_depth_image_mask_and_corner(tmp_path: Path) -> None:
    depth = np.zeros((40, 60), dtype=np.uint16)
    depth[10:30, 10:50] = 700 + np.arange(40)
    mask = np.zeros((40, 60), dtype=np.uint8)
    mask[10:30, 10:40] = 255
    write_png(tmp_path / "cup_1_1_7_depthcrop.png", depth)
    write_png(tmp_path / "cup_1_1_7_maskcrop.png", mask)
    (tmp_path / "cup_1_1_7_loc.txt").write_text("311,221")
    scan = depth_images.read_depth_scan(tmp_path / "cup_1_1_7_depthcrop.png")
    assert len(scan.points) == 20 * 30
    camera = Intrinsics()
    assert scan.points[0] == pytest.approx(
        [(10 + 310 - camera.cx) / camera.fx * 0.7, (10 + 220 - 240) / 570.3 * 0.7, 0.7]
    )
    assert scan.sensor is not None
    write_png(tmp_path / "cup_1_1_7_maskcrop.png", mask[:5])
    with pytest.raises(ScanError, match="mask has shape"):
        depth_images.read_depth_scan(tmp_path / "cup_1_1_7_depthcrop.png")
    (tmp_path / "broken.png").write_bytes((tmp_path / "cup_1_1_7_depthcrop.png").read_bytes()[:-20])
    with pytest.raises(ScanError, match="not a complete PNG"):
        depth_images.read_depth_scan(tmp_path / "broken.png")


def washington(folder: Path, instances: int, frames: int) -> None:
    for number in range(1, instances + 1):
        place = folder / "rgbd-dataset" / "food_can" / f"food_can_{number}"
        place.mkdir(parents=True)
        for frame in range(1, frames + 1):
            (place / f"food_can_{number}_1_{frame}.pcd").write_bytes(pcd(CLOUD))


def test_washington_layout_and_paper_selection(tmp_path: Path) -> None:
    washington(tmp_path, 15, 11)
    files = list_scans(tmp_path)
    assert len(files) == 165
    assert {f.object_class for f in files} == {"food can"}
    chosen = list_scans(tmp_path, paper_selection=True)
    assert len(chosen) == 14 * 2
    assert {f.instance for f in chosen} == {f"food_can_{n}" for n in range(1, 15)}
    assert [f.observation for f in chosen[:2]] == ["1_1", "1_11"]
    scan = chosen[0].load()
    assert (scan.instance, scan.observation, scan.partial) == ("food_can_1", "1_1", True)


def test_paper_selection_is_table_1() -> None:
    assert sum(a * b for a, b in layouts.PAPER_SELECTION.values()) == 692
    assert sum(a for a, _ in layouts.PAPER_SELECTION.values()) == 146
    assert len(layouts.PAPER_SELECTION) == 22
    assert select_paper([]) == []


def test_folders_of_classes_and_instances(tmp_path: Path) -> None:
    for place in (
        "coffee_mug/mug_a/front.pcd",
        "coffee_mug/mug_a/back.pcd",
        "plate/p.pcd",
        "plate/notes.txt",
    ):
        (tmp_path / place).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / place).write_bytes(pcd(CLOUD))
    found = [(f.object_class, f.instance, f.observation) for f in list_scans(tmp_path)]
    assert found == [("coffee mug", "mug_a", "back"), ("coffee mug", "mug_a", "front"), ("plate", "p", "")]


def test_manifest_gives_mass_origin_and_credit(tmp_path: Path) -> None:
    mesh = tumbler(0.06, 0.08, 0.1, 0.003).mesh
    (tmp_path / "cup.ply").write_bytes(ply(mesh.vertices, mesh.triangles, "binary_little_endian"))
    (tmp_path / "manifest.csv").write_text(
        "category,id,file,kind,mass_kg,dup_group,licence,source\ncup,cup_1,cup.ply,cad,0.12,cups,CC0,here\n"
    )
    camera = CameraSettings(views=3)
    whole, *views = iter_scans(tmp_path, FolderSettings(camera))
    assert (whole.mass, whole.origin, whole.group, whole.observation) == (0.12, Origin.SYNTHETIC, "cups", "")
    assert whole.source.credit == "here; CC0"
    assert [view.observation for view in views] == ["view_0", "view_1", "view_2"]
    assert all(view.virtual and view.partial and view.mesh is None for view in views)
    assert all(len(view.points) > 200 for view in views)
    (tmp_path / "manifest.csv").write_text("category,id,mass_kg\ncup,cup_1,heavy\n")
    with pytest.raises(InputError, match="line 2: mass_kg 'heavy'"):
        list_scans(tmp_path)
    (tmp_path / "manifest.csv").write_text("category,name\ncup,cup_1\n")
    with pytest.raises(InputError, match="no column 'id'"):
        list_scans(tmp_path)


def test_broken_scan_in_a_folder(tmp_path: Path) -> None:
    washington(tmp_path, 1, 3)
    bad = tmp_path / "rgbd-dataset" / "food_can" / "food_can_1" / "food_can_1_1_2.pcd"
    bad.write_bytes(bad.read_bytes()[:-500])
    with pytest.raises(ScanError, match="food_can_1_1_2"):
        list(iter_scans(tmp_path))
    with pytest.warns(ErsatzWarning, match="skipped: .*food_can_1_1_2"):
        assert len(list(iter_scans(tmp_path, FolderSettings(keep_going=True)))) == 2


def test_no_scans(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no scans"):
        list_scans(tmp_path)
    with pytest.raises(InputError, match="no such folder"):
        list_scans(tmp_path / "nowhere")


def test_the_real_washington_file(shared_data: Path) -> None:
    scan = read_scan(shared_data / "washington_sample" / "apple_1_1_1.pcd")
    assert len(scan.points) == 3161
    assert scan.colours is not None and 0 < scan.colours.mean() < 1
    assert scan.points.mean(axis=0)[1] == pytest.approx(0.72, abs=0.02)


def test_every_shared_object_can_be_read_but_a_flat_one(shared_data: Path) -> None:
    """The pack of wipes is a plane of a quarter of a metre, a tenth of a millimetre thick."""
    files = list_scans(shared_data / "objects")
    assert len(files) == 110
    scans, refused = [], []
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ErsatzWarning)
        for file in files:
            try:
                scans.append(replace(file.load(), mesh=None))
            except ScanError as error:
                refused.append((file.instance, str(error)))
    assert [name for name, _ in refused] == ["j17_burts_bees_baby_wipes"]
    assert "flat: the mesh is 0.26 m long and 9e-05 m thick" in refused[0][1]
    assert sum(scan.mass is not None for scan in scans) == 42
    assert not any(scan.partial for scan in scans)
