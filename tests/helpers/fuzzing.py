"""Damaged files for the readers, and all that the package does with a file."""

from __future__ import annotations

import re
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import cache, partial
from pathlib import Path
from random import Random
from tempfile import mkdtemp

import h5py
import meshio
import numpy as np
import pyvista

from scanfab.base.errors import ScanfabError, ScanfabNote, ScanfabWarning
from scanfab.io.convert import convert
from scanfab.io.families import Family
from scanfab.io.parse.vtk_mesh import read_bounds
from scanfab.io.reader import GrainTable, ReadOptions
from scanfab.io.registry import reader_for, reader_named
from scanfab.io.series import Series
from scanfab.testing import made_up_packings
from tests.helpers.dumps import (
    PAIRS,
    ROWS,
    binary_dump,
    dump_text,
    local_text,
    pairs_text,
    small_save,
    write,
    yade_lines,
    yade_spheres,
)
from tests.helpers.made import esys, gsd, kratos, lf_dem, mercurydpm, mfix, musen
from tests.helpers.made.data_files import data_file
from tests.helpers.made.lammps import netcdf, yaml_text
from tests.helpers.truth import FLOOR, PERIODIC, YADE

READERS = (
    "esys",
    "gsd",
    "kratos",
    "lammps",
    "lf-dem",
    "liggghts",
    "mercurydpm",
    "mfix",
    "musen",
    "npz",
    "on-dem",
    "table",
    "vtk",
    "xyz",
    "yade",
)
NAMES = (
    "f_1.txt",
    "f_1.vtk",
    "f_1.vtp",
    "f_1.vtu",
    "f_1.pvd",
    "f_1.xdmf",
    "f_1.txt.gz",
    "f_1.xml",
    "f_1.vtkhdf",
    "f_1.xyz",
    "f_1.contacts.csv",
    "f_1.csv",
    "f_1.xyzd",
    "f_1.csv.zst",
    "f_1.csv.lz4",
    "f_1.bin",
    "f_1.data",
    "f_1.fstat",
    "f_1.restart",
    "f_1.nc",
    "f_1.gsd",
    "f_1.mdpa",
    "f_1.hdf5",
    "particle_input_f_1.dat",
)
OPTIONS = (
    ReadOptions(),
    ReadOptions(radius=0.1),
    ReadOptions(cell=(1.0, 1.0, 1.0)),
    ReadOptions(cell=(1.0, 1.0, 1.0, 0.2, 0.1, 0.0), periodic="xy"),
    ReadOptions(contact_columns="pos id force"),
    ReadOptions(contact_columns="id force", periodic="z"),
    ReadOptions(columns={"radius": "type", "id": "id"}),
    ReadOptions(columns={"x": "y"}, radius=0.1),
    ReadOptions(contact_columns="id1=c_con[1],id2=c_con[2]", periodic="xy"),
    ReadOptions(contact_columns="id1=c_con[1],id2=c_con[2],fx=c_con[3],fy=c_con[4],fz=c_con[5]"),
    ReadOptions(columns={"x": "2", "y": "3", "z": "4", "diameter": "5"}, skip=1),
    ReadOptions(contact_columns="id1=1,id2=2,fx=3,fy=4,fz=5"),
    ReadOptions(columns={"id": "1", "x": "3", "y": "4", "z": "5", "radius": "6"}),
)
# of the sample files: larger ones make each execution slow
MOST_BYTES = 17_000

Seed = tuple[str, bytes]
"""Name, whose ending matters, and content."""
Mutation = Callable[[bytes, Random], bytes]

NUMBER = re.compile(rb"[-+]?\d+(?:\.\d*)?(?:[eE][-+]?\d+)?")
WORD = re.compile(rb"[^\s<>=\"]+")
VALUES = (
    b"nan",
    b"inf",
    b"-inf",
    b"1e400",
    b"1e308",
    b"-1e200",
    b"1e-320",
    b"-1",
    b"0",
    b"1",
    b"3",
    b"1e15",
    b"1000000000000000",
    b"100000000",
    b"4294967296",
    b"9223372036854775807",
    b"9" * 25,
    b"9" * 5000,
    b"text",
    b"2.5",
    b"\xff\xfe",
    b"\xd9\xa3",
    b"",
)
PATTERNS = (
    b"\x00",
    b"\xff",
    b"\x00\x00\x00\x00",
    b"\xff\xff\xff\xff",
    b"\x7f\xff\xff\xff",
    b"\xff\xff\xff\x7f",
    b"\x00\x00\x00\x00\x00\x00\xf0\x7f",
    b"\x7f\xf0\x00\x00\x00\x00\x00\x00",
    b"\x00\x00\x00\x7f\x00\x00\x00\x00",
    b"\n",
    b"\r\n",
    b" ",
    b"<",
    b"_",
)


def mutate(data: bytes, random: Random) -> bytes:
    """The data with one to three damages."""
    for _ in range(random.randint(1, 3)):
        data = random.choice(MUTATIONS)(data, random)
    return data


def _cut(data: bytes, random: Random) -> bytes:
    return data[: random.randint(0, len(data))]


def _flip(data: bytes, random: Random) -> bytes:
    changed = bytearray(data)
    for _ in range(random.randint(1, 4) if data else 0):
        changed[random.randrange(len(data))] ^= 1 << random.randrange(8)
    return bytes(changed)


def _overwrite(data: bytes, random: Random) -> bytes:
    place, pattern = random.randint(0, len(data)), random.choice(PATTERNS)
    return data[:place] + pattern + data[place + len(pattern) :]


def _insert(data: bytes, random: Random) -> bytes:
    place = random.randint(0, len(data))
    return data[:place] + random.choice(PATTERNS) + data[place:]


def _remove_part(data: bytes, random: Random) -> bytes:
    one, two = sorted(random.randint(0, len(data)) for _ in range(2))
    return data[:one] + data[two:]


def _remove_line(data: bytes, random: Random) -> bytes:
    lines = data.split(b"\n")
    del lines[random.randrange(len(lines))]
    return b"\n".join(lines)


def _duplicate_line(data: bytes, random: Random) -> bytes:
    lines = data.split(b"\n")
    lines.insert(random.randrange(len(lines)), random.choice(lines))
    return b"\n".join(lines)


def _swap_lines(data: bytes, random: Random) -> bytes:
    lines = data.split(b"\n")
    one, two = (random.randrange(len(lines)) for _ in range(2))
    lines[one], lines[two] = lines[two], lines[one]
    return b"\n".join(lines)


def _replace_number(data: bytes, random: Random) -> bytes:
    # headers decide more than rows do: half of the numbers are taken from the first ones
    found = list(NUMBER.finditer(data))
    if not found:
        return data
    match = random.choice(found[:20] if random.random() < 0.5 else found)
    return data[: match.start()] + random.choice(VALUES) + data[match.end() :]


def _replace_word(data: bytes, random: Random) -> bytes:
    found = list(WORD.finditer(data))
    if not found:
        return data
    match = random.choice(found[:40] if random.random() < 0.5 else found)
    return data[: match.start()] + random.choice(found)[0] + data[match.end() :]


MUTATIONS: tuple[Mutation, ...] = (
    _cut,
    _flip,
    _overwrite,
    _insert,
    _remove_part,
    _remove_line,
    _duplicate_line,
    _swap_lines,
    _replace_number,
    _replace_number,
    _replace_number,
    _replace_word,
)


class ForbiddenError(Exception):
    """Something came out of reading that is neither an answer nor an error of scanfab."""


@contextmanager
def only_scanfabs_warnings() -> Iterator[None]:
    """ForbiddenError if a warning is not scanfab's."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        yield
    for warning in caught:
        if not issubclass(warning.category, (ScanfabWarning, ScanfabNote)):
            place = f"{Path(warning.filename).name}:{warning.lineno}"
            raise ForbiddenError(f"{warning.category.__name__} at {place}: {warning.message}")


def read_everything(path: Path, format: str, options: ReadOptions) -> None:
    """All that the package does with a file, as grains and as contacts; any result will do."""
    reader = reader_named(format, options)
    grains, companion = companion_grains(format)
    with only_scanfabs_warnings():
        with suppress(ScanfabError):
            reader_for(path)
        with suppress(ScanfabError):
            reader.kind(path)
        with suppress(ScanfabError):
            frames = list(Series("", _family(path, format, "grains"), options=options))
            for frame in frames[:1] + frames[1:][-1:]:
                with suppress(ScanfabError):
                    frame.read()
        with suppress(ScanfabError):
            for snapshot in reader.snapshots(path)[-1:]:
                reader.read_contacts(snapshot, options, grains)
        if format != "yade":
            with suppress(ScanfabError):
                read_bounds(path)
        with suppress(ScanfabError):
            own = Series("", companion, (_family(path, format, "contacts"),), "auto", options)
            next(iter(own)).read()


def _family(path: Path, format: str, kind) -> Family:
    return Family(str(path), {1: path}, reader_named(format), kind)


@cache
def companion_grains(format: str) -> tuple[GrainTable, Family]:
    """Sound grains to read contacts with: the table, and the file."""
    if format in SMALL:
        folder = Path(mkdtemp(prefix="companion-"))
        path = SMALL[format](folder)[0]
        reader = reader_named(format)
        snapshot = reader.snapshots(path)[-1]
        return reader.read_grains(snapshot, ReadOptions()), _family(path, format, "grains")
    path = {
        "lammps": FLOOR / "shuffled.txt",
        "liggghts": FLOOR / "shuffled.txt",
        "npz": FLOOR / "grains_30000.vtp",
        "on-dem": FLOOR / "grains_30000.vtp",
        "table": FLOOR / "truth_grains.csv",
        "xyz": FLOOR / "grains_30000.vtp",
        "vtk": FLOOR / "grains_30000.vtp",
        "yade": YADE / "id-spheres-00000000.vtk.gz",
    }[format]
    reader = reader_named("vtk" if path.suffix == ".vtp" else format)
    grains = reader.read_grains(reader.snapshots(path)[0], ReadOptions())
    return grains, _family(path, reader.name, "grains")


def seeds(format: str, folder: Path) -> list[Seed]:
    """Sound files to damage: tiny ones, made in the folder, before those of sample_data."""
    made = {
        **SMALL,
        "lammps": _lammps_files,
        "liggghts": _liggghts_files,
        "npz": partial(_packings, (".npz", ".contacts.csv", ".frame.csv", ".columns.csv")),
        "on-dem": partial(_packings, (".vtkhdf",)),
        "table": _table_files,
        "xyz": partial(_packings, (".xyz",)),
        "vtk": _vtk_files,
        "yade": _yade_files,
    }[format](folder)
    samples = [
        path
        for place in (FLOOR, PERIODIC, YADE)
        for path in sorted(place.iterdir())
        if path.is_file()
        and path.suffix not in (".csv", ".py", ".md", ".stl")
        and path.stat().st_size < MOST_BYTES
        and _is_for(format, path)
    ]
    return [(path.name, path.read_bytes()) for path in (*made, *samples)]


def _is_for(format: str, path: Path) -> bool:
    if format == "vtk":
        return path.name.removesuffix(".gz")[-4:] in (".vtk", ".vtp", ".vtu")
    if format in ("npz", "on-dem", "table", "xyz", *SMALL):
        return False
    if format == "lammps":
        return path.suffix == ".txt" and YADE not in path.parents
    return (YADE in path.parents) == (format == "yade")


def _groups(path: Path) -> Path:
    """Kratos' HDF5 of two times."""
    with h5py.File(path, "w") as file:
        for time in (0.5, 1.0):
            group = file.create_group(f"{time * 2:.0f}")
            group.attrs["time"] = time
            for column in ("id", "x", "y", "z", "radius"):
                group[column] = np.array([1.0, 2.0]) + time
    return path


def _mercury_files(folder: Path) -> list[Path]:
    files = {
        "run.data": mercurydpm.data_frame(0.1) + mercurydpm.data_frame(0.2),
        "flat.data": "1 0.5 0 0 1 2 \n0.1 1 9 9 0.1 0 0 0\n",
        "run.fstat": mercurydpm.fstat_frame(0.2, mercurydpm.contacts_at(0.2)),
        "run.restart": mercurydpm.restart(),
    }
    return [write(folder / name, text) for name, text in files.items()]


SMALL: dict[str, Callable[[Path], list[Path]]] = {
    "esys": lambda folder: [esys.run(folder, prefix="")],
    "gsd": lambda folder: [gsd.gsd_file(folder / "a.gsd", gsd.frame(0), gsd.frame(5, count=2))],
    "kratos": lambda folder: [
        write(folder / "a.mdpa", kratos.MDPA),
        _groups(folder / "a.hdf5"),
    ],
    "lf-dem": lambda folder: [
        write(folder / "par.dat", lf_dem.grains_text()),
        write(folder / "int.dat", lf_dem.pairs_text()),
    ],
    "mercurydpm": _mercury_files,
    "mfix": lambda folder: [
        write(folder / "a.dat", mfix.version_2()),
        write(folder / "particle_input_f_1.dat", "0.1 0.2 0.5D-1 2650 7 8\n"),
    ],
    "musen": lambda folder: [write(folder / "a.txt", musen.export(*musen.ROWS))],
}


def _lammps_files(folder: Path) -> list[Path]:
    """Both tilted headers, items before the step, a list of pairs, a data file."""
    general = ((1, 0.5, 0, -1), (-0.25, 1, 0, 2), (0, 0.125, 1, 3))
    rows = "".join(f"{i} {t} {2 * r} 2500 {x} {y} {z}\n" for i, t, x, y, z, r in ROWS)
    files = {
        "units.lammpstrj": dump_text(before="ITEM: UNITS\nsi\nITEM: TIME\n0.5\n"),
        "tilted.lammpstrj": dump_text(
            flags=" xy xz yz pp pp ff", box=((0, 2.7, 1.2), (0, 1, 0), (0, 1, 0.3))
        ),
        "general.lammpstrj": dump_text(flags=" abc origin pp pp ff", box=general),
        "pairs.local": local_text([(*pair, 0.1, 1.5, 0, 0) for pair in PAIRS]),
        "grains.data": (
            "LAMMPS data file via write_data, timestep = 12\n\n3 atoms\n\n0 1 xlo xhi\n"
            f"0 2 ylo yhi\n-1 3 zlo zhi\n0.5 0 0.25 xy xz yz\n\nAtoms # sphere\n\n{rows}\n"
            "Velocities\n\n1 0 0 0 0 0 0\n"
        ),
    }
    paths = [folder / name for name in files]
    for path in paths:
        path.write_text(files[path.name])
    (folder / "a.yaml").write_text(yaml_text(100) + yaml_text(200))
    paths += [folder / "a.yaml", netcdf(folder / "a.nc", written=2)]
    new, old = folder / "new.bin", folder / "old.bin"
    new.write_bytes(binary_dump(names="id type x y z radius", time=0.5, blocks=2))
    old.write_bytes(binary_dump() + binary_dump(step=100, tilt=(0.2, 0.1, 0.0)))
    return [*paths, new, old]


def _liggghts_files(folder: Path) -> list[Path]:
    files = {
        "one.txt": dump_text(),
        "two.txt": dump_text() + dump_text(step=100, before="ITEM: TIME\n0.5\n"),
        "tilted.txt": dump_text(
            flags=" xy xz yz pp pp ff", box=((0, 1.5, 0.5), (0, 1, 0), (0, 1, 0))
        ),
        "scaled.txt": dump_text(names="id element xs ys zs diameter", flags=" pp pp pp"),
        "pairs.txt": pairs_text(),
        "pos.txt": local_text(
            [(*ROWS[0][2:5], *ROWS[1][2:5], *pair, 0, 1, 0, 0) for pair in PAIRS]
        ),
        "empty.txt": dump_text(()) + pairs_text((), step=1),
        "plain.data": data_file(),
        "hybrid.data": data_file("hybrid", behind=" 7 0 0 1"),
    }
    paths = [folder / name for name in files]
    for path in paths:
        path.write_text(files[path.name])
    spheres = folder / "named.vtk"
    pyvista.PolyData(_centres()).save(spheres, binary=False)
    spheres.write_bytes(spheres.read_bytes().replace(b"vtk output", b"Generated by LIGGGHTS"))
    return [*paths, spheres]


def _table_files(folder: Path) -> list[Path]:
    """Grains and contacts in each kind of table."""
    import pyarrow
    from pyarrow import parquet

    numbers = np.array(ROWS)[:, [0, 2, 3, 4, 5]]
    row = np.arange(12.0)
    columns = {"x": row, "y": 0 * row, "z": 0 * row, "radius": 0.5 + 0 * row}
    pushes = [(*pair, 0.1, 1.5, 0) for pair in PAIRS]

    def text(rows, sign: str, names: str = "", comma: bool = False) -> str:
        lines = [sign.join(map(repr, one)) for one in np.asarray(rows).tolist()]
        body = "\n".join([names.replace(" ", sign)] * bool(names) + lines) + "\n"
        return body.replace(".", ",") if comma else body

    files = {
        "named.csv": text(numbers, ",", "id x y z radius"),
        "comma.csv": text(numbers, ";", "id x y z diameter", comma=True),
        "tabs.tsv": text(numbers, "\t", "id x y z r"),
        "guess.txt": text(np.column_stack(list(columns.values())), "  "),
        "comment.txt": "# x y z r\n" + text(numbers[:, 1:], " "),
        "quoted.csv": '"id","x","y","z","radius"\n"1","1D0","2","3",.5\n2,3,4,5,"a"\n',
        "pairs.csv": text(pushes, ",", "id1 id2 fx fy fz"),
        "kinds.csv": "contact_type,id1,id2,fn,ix,iy,iz\nSS,1,2,.5,0,0,0\nSA,2,1,1,0,0,0\n",
    }
    paths = [folder / name for name in files]
    for path in paths:
        path.write_text(files[path.name])
    (folder / "wide.csv").write_bytes(files["named.csv"].encode("utf-16"))
    np.savez(folder / "a.npz", **columns)
    np.savez_compressed(folder / "b.npz", position=numbers[:, 1:4], r=numbers[:, 4])
    parquet.write_table(pyarrow.table(columns), folder / "a.parquet", compression="zstd")
    parquet.write_table(pyarrow.table(columns), folder / "b.parquet", compression="none")
    rows = np.column_stack([*list(columns.values())[:3], np.ones(12)])
    (folder / "a.xyzd").write_bytes(rows.astype("<f8").tobytes())
    more = [folder / name for name in ("wide.csv", "a.npz", "b.npz", "a.parquet", "b.parquet")]
    return [*paths, *more, folder / "a.xyzd"]


def _packings(endings: tuple[str, ...], folder: Path) -> list[Path]:
    """What convert writes, and what it puts beside."""
    for place, packing in enumerate(made_up_packings().values()):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            for ending in (".data", ".npz", ".vtkhdf", ".xyz"):
                convert(packing, folder / f"p{place}{ending}")
    return [path for path in sorted(folder.iterdir()) if path.name.endswith(endings)]


def _yade_files(folder: Path) -> list[Path]:
    grains, _ = companion_grains("yade")
    ends = grains.position[[[0, 1], [1, 2]]]
    head = "#format x_y_z_r_attrs\n# x y z r one two\n"
    text = folder / "attrs.txt"
    text.write_text(head + "0 0 0 1 2 3\n2 0 0 1 4 5\n")
    pack = folder / "pack.txt"
    pack.write_text("##PERIODIC:: 4 4 4\n0 0 0 1 -1\n2 0 0 1 -1\n")
    save = folder / "save.xml"
    save.write_text(small_save())
    vectors = {"normalForce": [[1, 0, 0]] * 2, "shearForce": [[0, 1, 0]] * 2}
    return [
        text,
        pack,
        save,
        yade_spheres(folder / "spheres.vtk", grains.position[:3], [1, 1, 1], id=[0, 1, 2]),
        yade_lines(folder / "lines.vtk", ends, vectors, id1=[0, 1], id2=[1, 2]),
        *_recorders(folder, "forceN"),
    ]


def _vtk_files(folder: Path) -> list[Path]:
    files = _recorders(folder, "force")
    cloud = pyvista.PolyData(_centres())
    cloud["radius"], cloud["id"] = np.ones(4), np.arange(4)
    grid = cloud.cast_to_unstructured_grid()
    for name, mesh in (("cloud", cloud), ("grid", grid)):
        for suffix in (".vtk", ".vtp" if mesh is cloud else ".vtu"):
            for binary in (False, True):
                files.append(folder / f"{name}_{'binary' if binary else 'ascii'}{suffix}")
                mesh.save(files[-1], binary=binary)
    plain = meshio.Mesh(
        _centres(), [("vertex", np.arange(4)[:, None])], point_data={"radius": np.ones(4)}
    )
    options = {
        "old.vtk": {"file_format": "vtk42", "binary": False},
        "old_binary.vtk": {"file_format": "vtk42"},
        "new.vtk": {"file_format": "vtk51", "binary": False},
        "plain.vtu": {"binary": False},
        "packed.vtu": {},
        "xml.xdmf": {"data_format": "XML"},
        "binary.xdmf": {"data_format": "Binary"},
    }
    for name, how in options.items():
        files.append(folder / name)
        plain.write(files[-1], **how)
    index = folder / "list.pvd"
    index.write_text(
        '<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1">\n<Collection>\n'
        + "".join(f'<DataSet timestep="{step}" file="grid_ascii.vtu"/>\n' for step in range(2))
        + "</Collection>\n</VTKFile>\n"
    )
    return [*files, index]


def _recorders(folder: Path, force: str) -> list[Path]:
    """Lines between points with their forces, in each encoding of the XML format."""
    mesh = pyvista.PolyData(_centres(), lines=[2, 0, 1, 2, 1, 2])
    mesh.cell_data[force] = np.array([[1.0, 0, 0], [2.0, 0, 0]])
    mesh.cell_data["id1"], mesh.cell_data["id2"] = np.array([0, 1]), np.array([1, 2])
    files = []
    from vtkmodules.vtkIOXML import vtkXMLPolyDataWriter

    for mode in ("Ascii", "Binary", "Appended"):
        for packed in (False, True):
            for base64 in (False, True):
                if (mode == "Ascii" and (packed or base64)) or (mode == "Binary" and base64):
                    continue
                writer = vtkXMLPolyDataWriter()
                writer.SetInputData(mesh)
                getattr(writer, f"SetDataModeTo{mode}")()
                writer.SetEncodeAppendedData(base64)
                if not packed:
                    writer.SetCompressorTypeToNone()
                files.append(folder / f"lines_{mode}_{packed:d}{base64:d}.vtp")
                writer.SetFileName(str(files[-1]))
                writer.Write()
    for binary in (False, True):
        files.append(folder / f"lines_{binary:d}.vtk")
        mesh.save(files[-1], binary=binary)
    return files


def _centres() -> np.ndarray:
    grains, _ = companion_grains("vtk")
    return grains.position[:4]
