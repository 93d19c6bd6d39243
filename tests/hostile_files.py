"""HDF5 files that somebody made to harm the reader, and run files that are right and unusual."""

from __future__ import annotations

import zlib
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
from h5py import h5d, h5f, h5p, h5s, h5t

SAMPLES = 64
SECRET = "the content of another file"


def a_run_file(path: Path, **options: object) -> None:
    """A run file as another program writes it; the options are those of `h5py.File`."""
    with h5py.File(path, "w", **options) as file:
        describe(file)
        add_channel(file, "displacement", "m")
        add_channel(file, "force", "N")


def describe(file: h5py.File, samples: int = SAMPLES) -> None:
    file.attrs.update(
        {
            "format": "damper-rig/run",
            "format_version": 1,
            "run_id": "x",
            "created": "2026-01-02T03:04:05Z",
            "specimen": "s",
            "excitation_kind": "custom",
            "status": "complete",
            "sample_rate": 500.0,
            "samples": samples,
            "period_samples": 0,
        }
    )


def add_channel(file: h5py.File, name: str, unit: str, **options: object) -> h5py.Dataset:
    values = options.pop("data", np.linspace(0.0, 1.0, SAMPLES))
    dataset = file.create_dataset(f"channels/{name}", data=values, **options)
    dataset.attrs["unit"] = unit
    return dataset


Change = Callable[[h5py.File, Path], None]


def changed(change: Change, **options: object) -> Callable[[Path], None]:
    def write(path: Path) -> None:
        a_run_file(path, **options)
        with h5py.File(path, "r+", **{k: v for k, v in options.items() if k == "libver"}) as file:
            change(file, path)

    return write


def external_storage(file: h5py.File, path: Path) -> None:
    secret = path.with_name("secret.bin")
    secret.write_bytes(np.arange(SAMPLES, dtype=float).tobytes())
    del file["channels/force"]
    force = file.create_dataset("channels/force", (SAMPLES,), "f8", external=[(str(secret.absolute()), 0, SAMPLES * 8)])
    force.attrs["unit"] = "N"


def external_link(file: h5py.File, path: Path) -> None:
    other = path.with_name("other.h5")
    a_run_file(other)
    del file["channels/force"]
    file["channels/force"] = h5py.ExternalLink(str(other.absolute()), "/channels/force")


def virtual(file: h5py.File, path: Path) -> None:
    other = path.with_name("other.h5")
    a_run_file(other)
    layout = h5py.VirtualLayout((SAMPLES,), "f8")
    layout[:] = h5py.VirtualSource(str(other.absolute()), "channels/force", (SAMPLES,))
    del file["channels/force"]
    file.create_virtual_dataset("channels/force", layout).attrs["unit"] = "N"


def _linked(target: object, name: str = "more") -> Change:
    return lambda file, path: file.__setitem__(name, target)


def cycle(file: h5py.File, path: Path) -> None:
    file["channels/again"] = file["/"]


def second_name(file: h5py.File, path: Path) -> None:
    file["channels/current"] = file["channels/force"]


def _attribute(value: object, *, on: str = "/", name: str = "more") -> Change:
    return lambda file, path: file[on].attrs.__setitem__(name, value)


def _dataset(**options: object) -> Change:
    return lambda file, path: file.create_dataset("more", **options)


def object_reference(file: h5py.File, path: Path) -> None:
    file.create_dataset("more", data=file["channels"].ref, dtype=h5py.ref_dtype)


def region_reference(file: h5py.File, path: Path) -> None:
    file["channels"].attrs["more"] = file["channels/force"].regionref[:3]


def named_type(file: h5py.File, path: Path) -> None:
    file["more"] = np.dtype("f8")


def of_a_named_type(file: h5py.File, path: Path) -> None:
    file["name"] = np.dtype("f8")
    file.create_dataset("more", (3,), dtype=file["name"])
    del file["name"]


def many_attributes(file: h5py.File, path: Path) -> None:
    for k in range(300):
        file["channels"].attrs[f"a{k}"] = 1.0


def large_attribute(file: h5py.File, path: Path) -> None:
    file["channels"].attrs["more"] = np.zeros(1 << 18)


def many_objects(file: h5py.File, path: Path) -> None:
    group = file.create_group("more", track_order=False)
    for k in range(10_001):
        group.id.links.create_hard(f"{k}".encode(), file.id, b"/channels")


def deep_groups(file: h5py.File, path: Path) -> None:
    file.create_group("/".join(["a"] * 20))


def huge(file: h5py.File, path: Path) -> None:
    """Half a tebibyte is declared and none of it written."""
    del file["channels/force"]
    force = file.create_dataset("channels/force", (1 << 36,), "f8", chunks=(1 << 22,))
    force.attrs["unit"] = "N"


def sparse(file: h5py.File, path: Path) -> None:
    """4 GB in some kilobytes: every channel is declared and none is written."""
    file.attrs["samples"] = 1 << 27
    for name, unit in (("displacement", "m"), ("force", "N")):
        del file[f"channels/{name}"]
        file.create_dataset(f"channels/{name}", (1 << 27,), "f8").attrs["unit"] = unit


def decompression(file: h5py.File, path: Path) -> None:
    """64 MB of zeros in 70 kB."""
    zeros = np.zeros(1 << 23)
    file.create_dataset("channels/current", data=zeros, chunks=(1 << 20,), compression="gzip").attrs["unit"] = "A"


def chunk_that_grows(file: h5py.File, path: Path) -> None:
    """A chunk of 8 kB that unpacks to 64 MB."""
    dataset = file.create_dataset("channels/current", (1024,), "f8", chunks=(1024,), compression="gzip")
    dataset.attrs["unit"] = "A"
    dataset.id.write_direct_chunk((0,), zlib.compress(bytes(1 << 26), 9))


def gzip_twice(file: h5py.File, path: Path) -> None:
    properties = h5p.create(h5p.DATASET_CREATE)
    properties.set_chunk((64,))
    properties.set_deflate(9)
    properties.set_deflate(9)
    h5d.create(file.id, b"more", h5t.IEEE_F64LE, h5s.create_simple((64,)), properties)


def unknown_filter(file: h5py.File, path: Path) -> None:
    properties = h5p.create(h5p.DATASET_CREATE)
    properties.set_chunk((64,))
    properties.set_filter(32015, h5py.h5z.FLAG_OPTIONAL, (1,))
    h5d.create(file.id, b"more", h5t.IEEE_F64LE, h5s.create_simple((64,)), properties)


def strange_number(file: h5py.File, path: Path) -> None:
    kind = h5t.IEEE_F64LE.copy()
    kind.set_size(16)
    kind.set_precision(100)
    h5d.create(file.id, b"more", kind, h5s.create_simple((4,)))


def tiny_chunks(file: h5py.File, path: Path) -> None:
    file.create_dataset("more", (300_000,), "f8", chunks=(1,))


def one_text_a_thousand_times(file: h5py.File, path: Path) -> None:
    """A text of 20 MB that a thousand attributes would hold."""
    for k in range(100):
        file["channels"].attrs[f"a{k}"] = "x"
    file["channels"].attrs["long"] = "x" * (20 << 20)


HOSTILE: dict[str, tuple[Callable[[Path], None], str]] = {
    "external storage": (changed(external_storage), "/channels/force: external storage"),
    "a link to another file": (changed(external_link), "/channels/force: a link to another file"),
    "a soft link": (changed(_linked(h5py.SoftLink("/channels/force"))), "/more: a soft link"),
    "a dangling soft link": (changed(_linked(h5py.SoftLink("/nowhere"))), "/more: a soft link"),
    "a soft link to the file system": (changed(_linked(h5py.SoftLink("/etc/passwd"))), "/more: a soft link"),
    "a virtual dataset": (changed(virtual, libver="latest"), "/channels/force: a virtual dataset"),
    "a cycle of hard links": (changed(cycle), "/channels/again: a second name"),
    "an object with two names": (changed(second_name), "a second name of another object"),
    "an object reference": (changed(object_reference), "/more: of a type that is an object or region reference"),
    "a region reference": (
        changed(region_reference),
        "/channels: attribute more: of a type that is an object or region",
    ),
    "an opaque type": (changed(_dataset(data=np.void(b"abc"))), "/more: of a type that is opaque"),
    "a compound type": (
        changed(_dataset(data=np.zeros(3, dtype=[("a", "f8"), ("b", "i4")]))),
        "/more: of a type that is compound",
    ),
    "an enumeration": (
        changed(_dataset(data=[1], dtype=h5py.enum_dtype({"a": 1, "b": 2}))),
        "/more: of a type that is an enumeration",
    ),
    "numbers of variable length": (
        changed(_dataset(shape=(3,), dtype=h5py.vlen_dtype("f8"))),
        "/more: of a type that is of variable length",
    ),
    "arrays in a dataset": (
        changed(_dataset(shape=(3,), dtype=np.dtype("(4,)f8"))),
        "/more: of a type that is an array",
    ),
    "a number of 16 bytes": (changed(strange_number), "/more: a number of 16 bytes"),
    "a named type": (changed(named_type), "/more: a named data type"),
    "a dataset of a named type": (changed(of_a_named_type), "/more: a named data type"),
    "huge texts": (changed(_dataset(shape=(1,), dtype="S40000000")), "/more: texts of 40000000 bytes"),
    "a long text": (changed(one_text_a_thousand_times), "bytes of text in all"),
    "texts of variable length in an attribute": (
        changed(_attribute(["a", "b"])),
        "attribute more: 2 texts of variable length",
    ),
    "many attributes": (changed(many_attributes), "/channels: 300 attributes"),
    "a large attribute": (changed(large_attribute, libver="latest"), "attribute more: 2097152 bytes"),
    "many objects": (changed(many_objects), "objects: at most 10000"),
    "deep groups": (changed(deep_groups), "deep: at most 8"),
    "a declared size beyond memory": (changed(huge), "declare 549755814400 bytes in a file of"),
    "a sparse file": (changed(sparse), "declare 2147483648 bytes in a file of"),
    "a decompression bomb": (changed(decompression), "declare 67109888 bytes in a file of"),
    "a chunk that unpacks to more": (changed(chunk_that_grows), "/channels/current: a chunk unpacks to more than"),
    "gzip twice": (changed(gzip_twice), "/more: the filters gzip, gzip"),
    "an unknown filter": (changed(unknown_filter), "/more: filter 32015"),
    "the filter lzf": (changed(_dataset(data=np.zeros(64), compression="lzf")), "/more: filter 32000"),
    "the filter scale-offset": (changed(_dataset(data=np.zeros(64), scaleoffset=3)), "/more: filter 6"),
    "chunks beyond memory": (
        changed(_dataset(shape=(0,), maxshape=(None,), chunks=(1 << 28,), dtype="f8")),
        "/more: chunks of",
    ),
    "tiny chunks": (changed(tiny_chunks), "/more: 300000 chunks"),
    "many dimensions": (changed(_dataset(data=np.zeros((1,) * 20))), "/more: 20 dimensions"),
    "a user block": (lambda path: a_run_file(path, userblock_size=512), "user block"),
    "a family of files": (lambda path: a_family(path), "family driver should be used"),
    "an old family of files": (lambda path: a_family(path, "earliest"), "a file of several"),
}
"""What somebody sends, and what the refusal says. Each is a run file but for the one thing."""


def a_family(path: Path, version: str = "v110") -> None:
    """One of the files that HDF5 has divided a large one into."""
    access = h5p.create(h5p.FILE_ACCESS)
    access.set_fapl_family(1 << 20, None)
    bound = {"earliest": h5f.LIBVER_EARLIEST, "v110": h5f.LIBVER_V110}[version]
    access.set_libver_bounds(bound, h5f.LIBVER_V110)
    pattern = path.with_name("part-%d.h5")
    made = h5f.create(str(pattern).encode(), fapl=access)
    with h5py.File(made) as file:
        describe(file)
        add_channel(file, "force", "N")
    path.with_name("part-0.h5").replace(path)


UNUSUAL: dict[str, Callable[[Path], None]] = {
    "of the latest format": lambda path: a_run_file(path, libver="latest"),
    "with compressed, shuffled and checked channels": changed(
        lambda file, path: add_channel(file, "current", "A", compression="gzip", shuffle=True, fletcher32=True)
    ),
    "with channels in single precision": changed(
        lambda file, path: add_channel(file, "current", "A", data=np.ones(SAMPLES, dtype=">f4"))
    ),
    "with integers and events": changed(
        lambda file, path: file.create_dataset("counters/frames", data=np.arange(SAMPLES, dtype="u2"))
    ),
    "with texts of variable length": changed(
        lambda file, path: file.create_dataset("notes", data=["grün", "b"], dtype=h5py.string_dtype())
    ),
    "with a constant channel, compressed": changed(
        lambda file, path: add_channel(file, "current", "A", compression="gzip", data=np.zeros(SAMPLES))
    ),
    "with a channel that was never written": changed(
        lambda file, path: file.create_dataset("channels/current", (SAMPLES,), "f8").attrs.__setitem__("unit", "A")
    ),
}
"""Run files that keep to the layout, as other programs write them."""
