"""Small sound files of every format, to be damaged; and grains to read contacts with."""

import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cache
from importlib import import_module
from pathlib import Path
from tempfile import mkdtemp

import h5py
import meshio
import numpy as np
import polars
import pyvista

from scanfab.io.convert import convert
from scanfab.io.families import Family
from scanfab.io.files import COMPRESSED_SUFFIXES, DECOMPRESSORS
from scanfab.io.reader import GrainTable, ReadOptions, reader_named
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
from tests.helpers.made import esys, gsd, kratos, lf_dem, mercurydpm, mfix, musen, on_dem
from tests.helpers.made.data_files import data_file
from tests.helpers.made.lammps import netcdf, yaml_text
from tests.helpers.truth import FLOOR, PERIODIC, YADE

# larger files of sample_data would make each execution slow
MOST_BYTES = 17_000
GRAINS = [(i, x, y, z, r) for i, _, x, y, z, r in ROWS]
PUSHES = [(*pair, 0.1, 1.5, 0) for pair in PAIRS]

Seed = tuple[str, bytes]
"""Name, whose ending matters, and content."""


def text(rows: Iterable[Sequence[object]], sign: str = " ", *above: str) -> str:
    """A table with a sign between its columns, below some lines."""
    return "\n".join([*above, *(sign.join(map(str, row)) for row in rows)]) + "\n"


def _binary_dumps(kind: str, **more) -> dict[str, bytes]:
    """Binary dumps of one step and of two; tilted, in blocks, without grains."""
    return {
        f"{kind}_one.bin": binary_dump(**more),
        f"{kind}_two.bin": binary_dump(blocks=2, **more)
        + binary_dump(step=100, tilt=(0.2, 0.1, 0.0), **more),
        f"{kind}_walled.bin": binary_dump(flags=(1, 1, 0, 0, 3, 2), blocks=3, **more),
        f"{kind}_empty.bin": binary_dump(np.zeros((0, 6)), **more),
    }


OLD_DUMPS = {
    **_binary_dumps("old"),
    "old_pairs.bin": binary_dump([(*pair, 0.1, 1.5, 0, 0) for pair in PAIRS]),
}
TILTED = " xy xz yz pp pp ff"
PFC = "contact.end1.id,contact.end2.id," + ",".join(f"contact.force.global.{x}" for x in "xyz")
EDEM_GRAINS = ("ID", "Position X (m)", "Position Y (m)", "Position Z (m)", "Radius (m)")
EDEM_PAIRS = (
    "ID First",
    "ID Second",
    *(f"{x} Force {y}" for x in ("Normal", "Tangential") for y in "XYZ"),
)


def _edem(kind: str, words: Sequence[str]) -> str:
    """The titles of an export by EDEM."""
    return ",".join(f"Q{k:02} : {kind} {word}" for k, word in enumerate(words, 1))


TEXTS: dict[str, dict[str, str | bytes]] = {
    "edem": {
        "grains.csv": text(GRAINS, ",", _edem("Particle", EDEM_GRAINS)),
        "pairs.csv": text([(*x, 0, 0.5, 0) for x in PUSHES], ",", _edem("Contact", EDEM_PAIRS)),
    },
    "kratos": {"a.mdpa": kratos.MDPA},
    "lammps": {
        "units.lammpstrj": dump_text(before="ITEM: UNITS\nsi\nITEM: TIME\n0.5\n"),
        "tilted.lammpstrj": dump_text(flags=TILTED, box=((0, 2.7, 1.2), (0, 1, 0), (0, 1, 0.3))),
        "general.lammpstrj": dump_text(
            flags=" abc origin pp pp ff", box=((1, 0.5, 0, -1), (-0.25, 1, 0, 2), (0, 0.125, 1, 3))
        ),
        "pairs.local": local_text([(*push, 0) for push in PUSHES]),
        "grains.data": data_file(title="LAMMPS data file, timestep = 12", style=" # sphere"),
        "a.yaml": yaml_text(100) + yaml_text(200),
        **_binary_dumps("new", names="id type x y z radius", time=0.5),
        **OLD_DUMPS,
    },
    "lf-dem": {"par.dat": lf_dem.grains_text(), "int.dat": lf_dem.pairs_text()},
    "liggghts": {
        "one.txt": dump_text(),
        "two.txt": dump_text() + dump_text(step=100, before="ITEM: TIME\n0.5\n"),
        "tilted.txt": dump_text(flags=TILTED, box=((0, 1.5, 0.5), (0, 1, 0), (0, 1, 0))),
        "scaled.txt": dump_text(names="id element xs ys zs diameter", flags=" pp pp pp"),
        "pairs.txt": pairs_text(),
        "pos.txt": local_text(
            [(*ROWS[0][2:5], *ROWS[1][2:5], *pair, 0, 1, 0, 0) for pair in PAIRS]
        ),
        "empty.txt": dump_text(()) + pairs_text((), step=1),
        "plain.data": data_file(),
        "hybrid.data": data_file("hybrid", behind=" 7 0 0 1"),
        **OLD_DUMPS,
    },
    "mercurydpm": {
        "run.data": mercurydpm.data_frame(0.1) + mercurydpm.data_frame(0.2),
        "flat.data": "1 0.5 0 0 1 2 \n0.1 1 9 9 0.1 0 0 0\n",
        "run.fstat": mercurydpm.fstat_frame(0.2, mercurydpm.contacts_at(0.2)),
        "run.restart": mercurydpm.restart(),
    },
    "mfix": {"a.dat": mfix.version_2(), "particle_input_f_1.dat": "0.1 0.2 0.5D-1 2650 7 8\n"},
    "musen": {"a.txt": musen.export(*musen.ROWS)},
    "pfc": {
        "grains.csv": text(GRAINS, ",", "ball.id,ball.pos.x,ball.pos.y,ball.pos.z,ball.radius"),
        "pairs.csv": text(PUSHES, ",", PFC),
    },
    "table": {
        "named.csv": text(GRAINS, ",", "id,x,y,z,radius"),
        "comma.csv": text(GRAINS, ";", "id;x;y;z;diameter").replace(".", ","),
        "tabs.tsv": text(GRAINS, "\t", "id\tx\ty\tz\tr"),
        "guess.txt": text([(float(k), 0.0, 0.0, 0.5) for k in range(12)], "  "),
        "comment.txt": text([row[1:] for row in GRAINS], " ", "# x y z r"),
        "quoted.csv": '"id","x","y","z","radius"\n"1","1D0","2","3",.5\n2,3,4,5,"a"\n',
        "pairs.csv": text(PUSHES, ",", "id1,id2,fx,fy,fz"),
        "kinds.csv": "contact_type,id1,id2,fn,ix,iy,iz\nSS,1,2,.5,0,0,0\nSA,2,1,1,0,0,0\n",
        "a.xyzd": np.array([(k, 0, 0, 1) for k in range(12)], "<f8").tobytes(),
    },
    "yade": {
        "attrs.txt": "#format x_y_z_r_attrs\n# x y z r one two\n0 0 0 1 2 3\n2 0 0 1 4 5\n",
        "pack.txt": "##PERIODIC:: 4 4 4\n0 0 0 1 -1\n2 0 0 1 -1\n",
        "save.xml": small_save(),
    },
}


def _written(folder: Path, files: Mapping[str, str | bytes]) -> list[Path]:
    """Files with these contents, by name."""
    for name, data in files.items():
        (folder / name).write_bytes(data.encode() if isinstance(data, str) else data)
    return [folder / name for name in files]


def _kratos_files(folder: Path) -> list[Path]:
    """An HDF5 file of two times."""
    path = folder / "a.hdf5"
    with h5py.File(path, "w") as file:
        for time in (0.5, 1.0):
            group = file.create_group(f"{time * 2:.0f}")
            group.attrs["time"] = time
            group["id"] = np.array([1, 2])
            for column in ("x", "y", "z", "radius"):
                group[column] = np.array([1.0, 2.0]) + time
    return [path]


def _liggghts_files(folder: Path) -> list[Path]:
    path = folder / "named.vtk"
    pyvista.PolyData(_centres()).save(path, binary=False)
    return [write(path, path.read_text().replace("vtk output", "Generated by LIGGGHTS"))]


def _table_files(folder: Path) -> list[Path]:
    """Grains and contacts in binary tables; a text table in every way that scanfab decompresses."""
    grains = dict(zip(("id", "x", "y", "z", "radius"), np.array(GRAINS).T, strict=True))
    pairs = dict(zip(("id1", "id2", "fx", "fy", "fz"), np.array(PUSHES).T, strict=True))
    for name, columns in (("grains", grains), ("pairs", pairs)):
        np.savez(folder / f"{name}.npz", **columns)
        polars.DataFrame(columns).write_parquet(folder / f"{name}.parquet")
    np.savez_compressed(folder / "b.npz", position=np.array(GRAINS)[:, 1:4], r=grains["radius"])
    polars.DataFrame(grains).write_parquet(folder / "b.parquet", compression="uncompressed")
    modules = dict.fromkeys(DECOMPRESSORS.values())
    for suffix, module in zip(COMPRESSED_SUFFIXES, modules, strict=True):
        with import_module(module).open(folder / f"named.csv{suffix}", "wb") as file:
            file.write((folder / "named.csv").read_bytes())
    return sorted({*folder.iterdir()} - {folder / name for name in TEXTS["table"]})


def _saved(folder: Path, meshes: Mapping[str, pyvista.DataObject]) -> list[Path]:
    """Meshes with numbers as text and as bytes, by the ends of their names."""
    for name, mesh in meshes.items():
        for binary in (False, True):
            mesh.save(folder / f"{binary:d}_{name}", binary=binary)
    return [folder / f"{binary}_{name}" for name in meshes for binary in (0, 1)]


def _lines(force: str) -> pyvista.PolyData:
    """Two contacts with their forces."""
    mesh = pyvista.PolyData(_centres(), lines=[2, 0, 1, 2, 1, 2])
    mesh.cell_data[force] = np.array([[1.0, 0, 0], [2.0, 0, 0]])
    mesh.cell_data["id1"], mesh.cell_data["id2"] = np.array([0, 1]), np.array([1, 2])
    return mesh


def _centres() -> np.ndarray:
    return companion_grains("vtk")[0].position[:3]


def _vtk_files(folder: Path) -> list[Path]:
    """Points and lines by VTK and meshio, in each encoding; and lists of such files."""
    from vtkmodules.vtkIOXML import vtkXMLPolyDataWriter

    lines, cloud = _lines("force"), pyvista.PolyData(_centres())
    cloud["radius"], cloud["id"] = np.ones(3), np.arange(3)
    grid = cloud.cast_to_unstructured_grid()
    saved = {"cloud.vtp": cloud, "cloud.vtk": cloud, "grid.vtu": grid}
    files = _saved(folder, {**saved, "lines.vtp": lines, "lines.vtk": lines})
    writer = vtkXMLPolyDataWriter()
    writer.SetInputData(lines)
    for name, encoded in (("base64.vtp", 1), ("raw.vtp", 0)):
        files.append(folder / name)
        writer.SetFileName(str(files[-1]))
        writer.SetDataModeToAppended()
        writer.SetEncodeAppendedData(encoded)
        writer.Write()
    points = meshio.Mesh(_centres(), [("vertex", np.arange(3)[:, None])], {"radius": np.ones(3)})
    for name, how in (
        ("old.vtk", {"file_format": "vtk42", "binary": False}),
        ("xml.xdmf", {"data_format": "XML"}),
        ("binary.xdmf", {"data_format": "Binary"}),
    ):
        files.append(folder / name)
        points.write(files[-1], **how)
    blocks = pyvista.MultiBlock({"grains": cloud, "contacts": lines})
    for name, mesh in (("cloud", cloud), ("grid", grid), ("lines", lines), ("blocks", blocks)):
        files.append(folder / f"{name}.vtkhdf")
        mesh.save(files[-1])
    pieces = {
        "pvtp": ("PPolyData", 'Piece Source="0_cloud.vtp"'),
        "pvtu": ("PUnstructuredGrid", 'Piece Source="1_grid.vtu"'),
        "vtm": ("vtkMultiBlockDataSet", 'DataSet file="1_cloud.vtp"'),
        "pvd": ("Collection", 'DataSet timestep="0" file="0_grid.vtu"'),
    }
    lists = {
        f"all.{ending}": f'<VTKFile type="{kind}"><{kind}><{piece} index="0"/></{kind}></VTKFile>'
        for ending, (kind, piece) in pieces.items()
    }
    return [*files, *_written(folder, lists)]


def _yade_files(folder: Path) -> list[Path]:
    position = companion_grains("yade")[0].position
    vectors = {"normalForce": [[1, 0, 0]] * 2, "shearForce": [[0, 1, 0]] * 2}
    ends = position[[[0, 1], [1, 2]]]
    return [
        yade_spheres(folder / "spheres.vtk", position[:3], [1, 1, 1], id=[0, 1, 2]),
        yade_lines(folder / "lines.vtk", ends, vectors, id1=[0, 1], id2=[1, 2]),
        *_saved(folder, {"recorder.vtp": _lines("forceN")}),
    ]


def _converted(folder: Path, *suffixes: str) -> list[Path]:
    """Packings as convert writes them, with the files that it adds."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for place, packing in enumerate(made_up_packings().values()):
            for suffix in suffixes:
                convert(packing, folder / f"{suffix[1:]}{place}{suffix}")
    return sorted(folder.iterdir())


MAKERS: dict[str, Callable[[Path], list[Path]]] = {
    "esys": lambda folder: [
        esys.run(folder, prefix=""), *(folder / f"snap_t=30_{k}.txt" for k in (1, 2)),
    ],
    "gsd": lambda folder: [gsd.gsd_file(folder / "a.gsd", gsd.frame(0), gsd.frame(5, count=2))],
    "kratos": _kratos_files,
    "lammps": lambda folder: [netcdf(folder / "a.nc", written=2)],
    "liggghts": _liggghts_files,
    # the files that are added to another format are read by this reader
    "npz": lambda folder: [x for x in _converted(folder, ".npz", ".xyz") if x.suffix != ".xyz"],
    "on-dem": lambda folder: [
        *_converted(folder, ".vtkhdf"),
        on_dem.draft_1(folder / "first.vtkhdf"),
        on_dem.draft_2(folder / "second.vtkhdf"),
    ],
    "table": _table_files,
    "vtk": _vtk_files,
    "xyz": lambda folder: [x for x in _converted(folder, ".xyz") if x.suffix == ".xyz"],
    "yade": _yade_files,
}  # fmt: skip


def made(format: str, folder: Path) -> list[Path]:
    """Files of a format, made in a folder."""
    written = _written(folder, TEXTS.get(format, {}))
    return written + (MAKERS[format](folder) if format in MAKERS else [])


# formats that have few files, of which the first has grains
SMALL = ("esys", "gsd", "kratos", "lf-dem", "mercurydpm", "mfix", "musen")


@cache
def companion_grains(format: str) -> tuple[GrainTable, Family]:
    """Sound grains to read contacts with: the table, and the file."""
    if format in SMALL:
        path = made(format, Path(mkdtemp(prefix="companion-")))[0]
    else:
        path = {
            "lammps": FLOOR / "shuffled.txt",
            "liggghts": FLOOR / "shuffled.txt",
            "yade": YADE / "id-spheres-00000000.vtk.gz",
            **dict.fromkeys(("edem", "pfc", "table"), FLOOR / "truth_grains.csv"),
        }.get(format, FLOOR / "grains_30000.vtp")
    reader = reader_named({".vtp": "vtk", ".csv": "table"}.get(path.suffix, format))
    grains = reader.read_grains(reader.snapshots(path)[-1], ReadOptions())
    return grains, Family(str(path), {1: path}, reader, "grains")


def seeds(format: str, folder: Path) -> list[Seed]:
    """Sound files to damage: tiny ones, made in the folder, before those of sample_data."""
    samples = [
        path
        for place in (FLOOR, PERIODIC, YADE)
        for path in sorted(place.iterdir())
        if path.is_file()
        and path.suffix not in (".csv", ".py", ".md", ".stl")
        and path.stat().st_size < MOST_BYTES
        and _is_for(format, path)
    ]
    return [(path.name, path.read_bytes()) for path in (*made(format, folder), *samples)]


def _is_for(format: str, path: Path) -> bool:
    """Whether a file of sample_data is one for the reader of a format."""
    is_yade = YADE in path.parents
    return {
        "vtk": path.name.removesuffix(".gz")[-4:] in (".vtk", ".vtp", ".vtu"),
        "lammps": path.suffix == ".txt" and not is_yade,
        "liggghts": not is_yade,
        "yade": is_yade,
    }.get(format, False)


def entry(format: str, path: Path) -> Path:
    """The file to read: for the file of one of ESyS' workers a header beside it, which names it."""
    if format != "esys" or not path.read_bytes()[:1].isdigit():
        return path
    head = path.with_name(f"{path.stem}_head_0.txt")
    return write(head, esys.HEADER.format(step=1, files=path.name))
