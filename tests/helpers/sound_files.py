"""Small sound files of every format, to be damaged; and grains to read contacts with."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from functools import cache, partial
from importlib import import_module
from pathlib import Path
from tempfile import mkdtemp

import h5py
import meshio
import numpy as np
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

# of the sample files: larger ones make each execution slow
MOST_BYTES = 17_000

Seed = tuple[str, bytes]
"""Name, whose ending matters, and content."""


@cache
def companion_grains(format: str) -> tuple[GrainTable, Family]:
    """Sound grains to read contacts with: the table, and the file."""
    format = "table" if format in TITLED else format
    if format in SMALL:
        path = SMALL[format](Path(mkdtemp(prefix="companion-")))[0]
    else:
        path = {
            "lammps": FLOOR / "shuffled.txt",
            "liggghts": FLOOR / "shuffled.txt",
            "table": FLOOR / "truth_grains.csv",
            "yade": YADE / "id-spheres-00000000.vtk.gz",
        }.get(format, FLOOR / "grains_30000.vtp")
    reader = reader_named("vtk" if path.suffix == ".vtp" else format)
    grains = reader.read_grains(reader.snapshots(path)[-1], ReadOptions())
    return grains, Family(str(path), {1: path}, reader, "grains")


def seeds(format: str, folder: Path) -> list[Seed]:
    """Sound files to damage: tiny ones, made in the folder, before those of sample_data."""
    made = {
        **SMALL,
        **{name: partial(_titled, name) for name in TITLED},
        "lammps": _lammps_files,
        "liggghts": _liggghts_files,
        "npz": partial(_packings, (".npz", ".contacts.csv", ".frame.csv", ".columns.csv")),
        "on-dem": _on_dem_files,
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
    """Whether a file of sample_data is one for the reader of a format."""
    is_yade = YADE in path.parents
    return {
        "vtk": path.name.removesuffix(".gz")[-4:] in (".vtk", ".vtp", ".vtu"),
        "lammps": path.suffix == ".txt" and not is_yade,
        "liggghts": not is_yade,
        "yade": is_yade,
    }.get(format, False)


def _written(folder: Path, files: Mapping[str, str | bytes]) -> list[Path]:
    """Files with these contents, by name."""
    for name, data in files.items():
        (folder / name).write_bytes(data.encode() if isinstance(data, str) else data)
    return [folder / name for name in files]


def entry(format: str, path: Path) -> Path:
    """The file to read: for the file of one of ESyS' workers a header beside it, which names it."""
    if format != "esys" or not path.read_bytes()[:1].isdigit():
        return path
    head = path.with_name(f"{path.stem}_head_0.txt")
    return write(head, esys.HEADER.format(step=1, files=path.name))


def _groups(path: Path) -> Path:
    """Kratos' HDF5 of two times."""
    with h5py.File(path, "w") as file:
        for time in (0.5, 1.0):
            group = file.create_group(f"{time * 2:.0f}")
            group.attrs["time"] = time
            group["id"] = np.array([1, 2])
            for column in ("x", "y", "z", "radius"):
                group[column] = np.array([1.0, 2.0]) + time
    return path


def _small(format: str, folder: Path) -> list[Path]:
    """The files of a format that has few of them."""
    if format == "esys":
        return [esys.run(folder, prefix=""), *(folder / f"snap_t=30_{k}.txt" for k in (1, 2))]
    if format == "gsd":
        return [gsd.gsd_file(folder / "a.gsd", gsd.frame(0), gsd.frame(5, count=2))]
    if format == "kratos":
        return [*_written(folder, {"a.mdpa": kratos.MDPA}), _groups(folder / "a.hdf5")]
    return _written(folder, TEXTS[format])


TEXTS = {
    "lf-dem": {"par.dat": lf_dem.grains_text(), "int.dat": lf_dem.pairs_text()},
    "mercurydpm": {
        "run.data": mercurydpm.data_frame(0.1) + mercurydpm.data_frame(0.2),
        "flat.data": "1 0.5 0 0 1 2 \n0.1 1 9 9 0.1 0 0 0\n",
        "run.fstat": mercurydpm.fstat_frame(0.2, mercurydpm.contacts_at(0.2)),
        "run.restart": mercurydpm.restart(),
    },
    "mfix": {"a.dat": mfix.version_2(), "particle_input_f_1.dat": "0.1 0.2 0.5D-1 2650 7 8\n"},
    "musen": {"a.txt": musen.export(*musen.ROWS)},
}
SMALL = {name: partial(_small, name) for name in ("esys", "gsd", "kratos", *TEXTS)}


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
        "a.yaml": yaml_text(100) + yaml_text(200),
    }
    paths = [*_written(folder, files), netcdf(folder / "a.nc", written=2)]
    return [*paths, *_binary_dumps(folder, new=True), *_binary_dumps(folder)]


def _binary_dumps(folder: Path, new: bool = False) -> list[Path]:
    """Of one step and of two, tilted, in blocks, of either order of bytes; contacts as well."""
    more = {"names": "id type x y z radius", "time": 0.5} if new else {}
    grains = {
        "one": binary_dump(**more),
        "two": binary_dump(blocks=2, **more) + binary_dump(step=100, tilt=(0.2, 0.1, 0.0), **more),
        "walled": binary_dump(flags=(1, 1, 0, 0, 3, 2), blocks=3, **more),
        "empty": binary_dump(np.zeros((0, 6)), **more),
    }
    if not new:
        grains["pairs"] = binary_dump([(*pair, 0.1, 1.5, 0, 0) for pair in PAIRS])
    kind = "new" if new else "old"
    return _written(folder, {f"{kind}_{name}.bin": data for name, data in grains.items()})


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
    spheres = folder / "named.vtk"
    pyvista.PolyData(_centres()).save(spheres, binary=False)
    spheres.write_bytes(spheres.read_bytes().replace(b"vtk output", b"Generated by LIGGGHTS"))
    return [*_written(folder, files), spheres, *_binary_dumps(folder)]


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
    paths = _written(folder, files)
    one, two, *pushed = np.array(pushes).T
    listed = {"id1": one.astype(int), "id2": two.astype(int)}
    listed |= zip(("fx", "fy", "fz"), pushed, strict=True)
    np.savez(folder / "a.npz", **columns)
    np.savez_compressed(folder / "b.npz", position=numbers[:, 1:4], r=numbers[:, 4])
    np.savez(folder / "pairs.npz", **listed)
    parquet.write_table(pyarrow.table(columns), folder / "a.parquet", compression="zstd")
    parquet.write_table(pyarrow.table(columns), folder / "b.parquet", compression="none")
    parquet.write_table(pyarrow.table(listed), folder / "pairs.parquet")
    more = "a.npz b.npz pairs.npz a.parquet b.parquet pairs.parquet"
    rows = np.column_stack([*list(columns.values())[:3], np.ones(12)]).astype("<f8")
    return [
        *paths,
        *_written(folder, {"wide.csv": files["named.csv"].encode("utf-16")}),
        *(folder / name for name in more.split()),
        *_written(folder, {"a.xyzd": rows.tobytes()}),
        *_packed(folder / "named.csv"),
        *_packed(folder / "pairs.csv"),
    ]


def _packed(path: Path) -> list[Path]:
    """A file in every way that scanfab unpacks."""
    modules = zip(COMPRESSED_SUFFIXES, dict.fromkeys(DECOMPRESSORS.values()), strict=True)
    paths = []
    for suffix, module in modules:
        paths.append(path.with_name(path.name + suffix))
        with import_module(module).open(paths[-1], "wb") as file:
            file.write(path.read_bytes())
    return paths


# readers of tables whose columns have the titles of a program
TITLED = {
    "pfc": (
        "ball.id,ball.pos.x,ball.pos.y,ball.pos.z,ball.radius",
        "contact.end1.id,contact.end2.id,contact.force.global.x,contact.force.global.y,"
        "contact.force.global.z",
    ),
    "edem": (
        "Q01 : Particle ID,Q02 : Particle Position X (m),Q03 : Particle Position Y (m),"
        "Q04 : Particle Position Z (m),Q05 : Particle Radius (m)",
        "Q01 : Contact ID First,Q02 : Contact ID Second,Q03 : Contact Normal Force X,"
        "Q04 : Contact Normal Force Y,Q05 : Contact Normal Force Z,"
        "Q06 : Contact Tangential Force X,Q07 : Contact Tangential Force Y,"
        "Q08 : Contact Tangential Force Z",
    ),
}


def _titled(format: str, folder: Path) -> list[Path]:
    names, titles = TITLED[format]
    rows = "".join(f"{i},{x},{y},{z},{r}\n" for i, _, x, y, z, r in ROWS)
    more = ",0,.5,0" * (format == "edem")
    pairs = "".join(f"{one},{two},0.1,1.5,0{more}\n" for one, two in PAIRS)
    grains = f"{names}\n{rows}"
    files = {
        "grains.csv": grains,
        "pairs.csv": f"{titles}\n{pairs}",
        "grains.txt": grains.replace(",", "\t"),
    }
    return _written(folder, files)


def _on_dem_files(folder: Path) -> list[Path]:
    """Those of other exporters, too: of both drafts, with walls and with blocks."""
    return [
        *_packings((".vtkhdf",), folder),
        on_dem.draft_1(folder / "first.vtkhdf"),
        on_dem.draft_2(folder / "second.vtkhdf"),
    ]


def _packings(endings: tuple[str, ...], folder: Path) -> list[Path]:
    """What convert writes, and what it puts beside."""
    for place, packing in enumerate(made_up_packings().values()):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            for ending in (".data", ".npz", ".vtkhdf", ".xyz"):
                # each beside files of its own
                convert(packing, folder / f"{ending[1:]}{place}{ending}")
    return [path for path in sorted(folder.iterdir()) if path.name.endswith(endings)]


def _yade_files(folder: Path) -> list[Path]:
    grains, _ = companion_grains("yade")
    ends = grains.position[[[0, 1], [1, 2]]]
    files = {
        "attrs.txt": "#format x_y_z_r_attrs\n# x y z r one two\n0 0 0 1 2 3\n2 0 0 1 4 5\n",
        "pack.txt": "##PERIODIC:: 4 4 4\n0 0 0 1 -1\n2 0 0 1 -1\n",
        "save.xml": small_save(),
    }
    vectors = {"normalForce": [[1, 0, 0]] * 2, "shearForce": [[0, 1, 0]] * 2}
    return [
        *_written(folder, files),
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
    files += _hdf_files(folder, cloud, grid)
    pieces = {
        "pvtp": ("PPolyData", 'Piece Source="cloud_ascii.vtp"'),
        "pvtu": ("PUnstructuredGrid", 'Piece Source="grid_binary.vtu"'),
        "vtm": ("vtkMultiBlockDataSet", 'DataSet file="cloud_binary.vtp"'),
    }
    lists = {
        f"all.{ending}": f'<VTKFile type="{kind}"><{kind}><{piece} index="0"/></{kind}></VTKFile>'
        for ending, (kind, piece) in pieces.items()
    }
    steps = "".join(f'<DataSet timestep="{step}" file="grid_ascii.vtu"/>\n' for step in range(2))
    lists["list.pvd"] = (
        '<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1">\n<Collection>\n'
        f"{steps}</Collection>\n</VTKFile>\n"
    )
    return [*files, *_written(folder, lists)]


def _hdf_files(folder: Path, cloud: pyvista.PolyData, grid) -> list[Path]:
    """VTKHDF as VTK writes it: points, cells, lines, blocks, packed."""
    from vtkmodules.vtkIOHDF import vtkHDFWriter

    lines = pyvista.PolyData(_centres(), lines=[2, 0, 1, 2, 1, 2])
    lines.cell_data["force"] = np.array([[1.0, 0, 0], [2.0, 0, 0]])
    blocks = pyvista.MultiBlock({"grains": cloud, "contacts": lines})
    meshes = {"cloud": cloud, "grid": grid, "lines": lines, "blocks": blocks}
    files = [folder / f"{name}.vtkhdf" for name in meshes]
    for path, mesh in zip(files, meshes.values(), strict=True):
        writer = vtkHDFWriter()
        writer.SetInputData(mesh)
        writer.SetFileName(str(path))
        writer.SetCompressionLevel(4 if path.stem == "grid" else 0)
        writer.Write()
    return files


def _recorders(folder: Path, force: str) -> list[Path]:
    """Lines between points with their forces, in each encoding of the XML format."""
    from vtkmodules.vtkIOXML import vtkXMLPolyDataWriter

    mesh = pyvista.PolyData(_centres(), lines=[2, 0, 1, 2, 1, 2])
    mesh.cell_data[force] = np.array([[1.0, 0, 0], [2.0, 0, 0]])
    mesh.cell_data["id1"], mesh.cell_data["id2"] = np.array([0, 1]), np.array([1, 2])
    files = []
    # encoding, whether it is compressed, and whether appended bytes are base64
    kinds = [("Ascii", 0, 0), ("Binary", 0, 0), ("Binary", 1, 0), ("Appended", 0, 0)]
    for mode, packed, base64 in [*kinds, ("Appended", 1, 0), ("Appended", 1, 1)]:
        writer = vtkXMLPolyDataWriter()
        writer.SetInputData(mesh)
        getattr(writer, f"SetDataModeTo{mode}")()
        writer.SetEncodeAppendedData(base64)
        if not packed:
            writer.SetCompressorTypeToNone()
        files.append(folder / f"lines_{mode}_{packed}{base64}.vtp")
        writer.SetFileName(str(files[-1]))
        writer.Write()
    for binary in (False, True):
        files.append(folder / f"lines_{binary:d}.vtk")
        mesh.save(files[-1], binary=binary)
    return files


def _centres() -> np.ndarray:
    grains, _ = companion_grains("vtk")
    return grains.position[:4]
