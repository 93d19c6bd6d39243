"""The whole structure of an HDF5 file, walked without reading any data.

Every link is looked at before it is followed, and every dataset's properties before its extent is asked for: HDF5 opens
other files when it is asked for the extent of a virtual dataset.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cache
from math import prod
from typing import Any, Final

from h5py import h5a, h5d, h5g, h5l, h5o, h5s, h5t, h5z

from excitation.errors import ExcitationFileError
from excitation.untrusted.limits import (
    FREE_BYTES,
    MOST_ATTRIBUTE_BYTES,
    MOST_ATTRIBUTES,
    MOST_CHUNK_BYTES,
    MOST_CHUNKS,
    MOST_DEPTH,
    MOST_OBJECTS,
    MOST_PACKED_RATIO,
    MOST_PLAIN_RATIO,
    MOST_RANK,
    MOST_TEXT_BYTES,
    MOST_TEXTS,
    Limits,
)

__all__ = ["Structure", "walk"]

_FILTERS: Final = {h5z.FILTER_DEFLATE: "gzip", h5z.FILTER_SHUFFLE: "shuffle", h5z.FILTER_FLETCHER32: "fletcher32"}
_LINKS: Final = {h5l.TYPE_SOFT: "a soft link", h5l.TYPE_EXTERNAL: "a link to another file"}
_KINDS: Final = {
    h5t.OPAQUE: "opaque",
    h5t.COMPOUND: "compound",
    h5t.REFERENCE: "an object or region reference",
    h5t.ENUM: "an enumeration",
    h5t.VLEN: "of variable length",
    h5t.ARRAY: "an array",
    h5t.BITFIELD: "a bit field",
    h5t.TIME: "a time",
}
_PLAIN: Final = "it must be a number or a text"

# Any, here and below: h5py has no types.
Id = Any


@dataclass(slots=True)
class Structure:
    """What was found so far; ``packed`` and ``texts`` are the datasets and attributes whose content is checked next."""

    limits: Limits
    objects: int = 0
    chunks: int = 0
    texts_of_any_length: int = 0
    bytes_in_memory: int = 0
    compressed: bool = False
    seen: set[int] = field(default_factory=set)  # addresses of objects
    chunked: list[tuple[str, Id]] = field(default_factory=list)
    contiguous: list[tuple[str, Id]] = field(default_factory=list)
    texts: list[tuple[str, Id]] = field(default_factory=list)  # datasets of texts of variable length
    text_attributes: list[tuple[str, Id]] = field(default_factory=list)


def walk(file: Id, limits: Limits) -> Structure:
    """What the file holds; ExcitationFileError, one line, for anything that no file of ours needs. Reads no data."""
    found = Structure(limits)
    root = h5o.open(file, b"/")
    _enter(found, root, "/")
    _group(found, root, "", 0)
    return found


def check_size(found: Structure, file_bytes: int) -> None:
    """Raise ExcitationFileError where the datasets are larger in memory than a file of this size can mean."""
    ratio = MOST_PACKED_RATIO if found.compressed else MOST_PLAIN_RATIO
    most = min(found.limits.most_bytes, max(FREE_BYTES, ratio * file_bytes))
    if found.bytes_in_memory > most:
        raise ExcitationFileError(
            f"the datasets declare {found.bytes_in_memory} bytes in a file of {file_bytes}: at most {most} are read"
        )


def _group(found: Structure, group: Id, place: str, depth: int) -> None:
    if depth > MOST_DEPTH:
        raise _refusal(place, f"groups {depth} deep", f"at most {MOST_DEPTH} levels are read")
    count = group.get_num_objs()
    if found.objects + count > MOST_OBJECTS:
        raise _refusal(place or "/", f"{found.objects + count} objects", f"at most {MOST_OBJECTS} are read")
    names: list[bytes] = []
    group.links.iterate(names.append)
    for name in names:
        _member(found, group, name, place, depth)


def _member(found: Structure, group: Id, name: bytes, place: str, depth: int) -> None:
    where = f"{place}/{ascii(name)[2:-1]:.60}"
    if name in (b"", b".", b"..") or b"/" in name:
        raise _refusal(where, "a member without a proper name", "a name has no '/' and is no '.'")
    kind = group.links.get_info(name).type
    if kind != h5l.TYPE_HARD:
        raise _refusal(where, _LINKS.get(kind, "a link of an unknown kind"), "the data must be in this file, here")
    member = h5o.open(group, name)
    _enter(found, member, where)
    if isinstance(member, h5g.GroupID):
        _group(found, member, where, depth + 1)
    elif isinstance(member, h5d.DatasetID):
        _dataset(found, member, where)
    else:
        raise _refusal(where, "a named data type", "a group or a dataset is due")


def _enter(found: Structure, member: Id, where: str) -> None:
    """Count an object and look at its attributes."""
    found.objects += 1
    address = h5o.get_info(member).addr
    if address in found.seen:
        raise _refusal(where, "a second name of another object (a hard link)", "every object must have one name")
    found.seen.add(address)
    count = h5a.get_num_attrs(member)
    if count > MOST_ATTRIBUTES:
        raise _refusal(where, f"{count} attributes", f"at most {MOST_ATTRIBUTES} are read")
    for index in range(count):
        attribute = h5a.open(member, index=index)
        _attribute(found, attribute, f"{where}: attribute {ascii(attribute.get_name())[2:-1]:.60}")


def _attribute(found: Structure, attribute: Id, where: str) -> None:
    kind = attribute.get_type()
    _check_type(found, kind, where)
    points = _points(attribute.get_space(), where)
    if _is_text_of_any_length(kind):
        if points > 1:
            raise _refusal(where, f"{points} texts of variable length", "one text is due")
        found.text_attributes.append((where, attribute))
    elif points * kind.get_size() > MOST_ATTRIBUTE_BYTES:
        raise _refusal(where, f"{points * kind.get_size()} bytes", f"at most {MOST_ATTRIBUTE_BYTES} are read")


def _dataset(found: Structure, dataset: Id, where: str) -> None:
    properties = dataset.get_create_plist()
    layout = properties.get_layout()
    if layout == h5d.VIRTUAL:
        raise _refusal(where, "a virtual dataset, made of others", "the data must be in this file, here")
    if properties.get_external_count():
        raise _refusal(where, "external storage: its data are in another file", "the data must be in this file")
    kind = dataset.get_type()
    _check_type(found, kind, where)
    filters = _check_filters(properties, where)
    points = _points(dataset.get_space(), where)
    found.bytes_in_memory += points * (kind.get_size() if kind.get_class() == h5t.STRING else 8)
    if layout == h5d.CHUNKED:
        _check_chunks(found, dataset, properties.get_chunk(), where)
        found.compressed = found.compressed or h5z.FILTER_DEFLATE in filters
        found.chunked.append((where, dataset))
    elif layout == h5d.CONTIGUOUS:
        found.contiguous.append((where, dataset))
    elif layout != h5d.COMPACT:
        raise _refusal(where, f"an unknown layout ({layout})", "it must be contiguous, chunked or compact")
    if _is_text_of_any_length(kind):
        found.texts_of_any_length += points
        if found.texts_of_any_length > MOST_TEXTS:
            raise _refusal(where, f"{points} texts of variable length", f"at most {MOST_TEXTS} are read")
        found.texts.append((where, dataset))


def _check_filters(properties: Id, where: str) -> list[int]:
    codes = [properties.get_filter(k)[0] for k in range(min(properties.get_nfilters(), 32))]
    for code in codes:
        if code not in _FILTERS:
            raise _refusal(where, f"filter {code}", f"only {', '.join(_FILTERS.values())} are read")
    shuffled = [code for code in codes if code != h5z.FILTER_FLETCHER32]
    if len(set(codes)) < len(codes) or shuffled == [h5z.FILTER_DEFLATE, h5z.FILTER_SHUFFLE]:
        names = ", ".join(_FILTERS[code] for code in codes)
        raise _refusal(where, f"the filters {names}", "each may come once, shuffle before gzip")
    return codes


def _check_chunks(found: Structure, dataset: Id, chunk: tuple[int, ...], where: str) -> None:
    size = prod(chunk) * dataset.get_type().get_size()
    if not 0 < size <= MOST_CHUNK_BYTES:
        raise _refusal(where, f"chunks of {size} bytes", f"at most {MOST_CHUNK_BYTES} are read")
    found.chunks += prod(-(-length // part) for length, part in zip(dataset.shape, chunk, strict=True))
    if found.chunks > MOST_CHUNKS:
        raise _refusal(where, f"{found.chunks} chunks", f"at most {MOST_CHUNKS} are read: write larger ones")


def _points(space: Id, where: str) -> int:
    rank = space.get_simple_extent_ndims()
    if rank > MOST_RANK:
        raise _refusal(where, f"{rank} dimensions", f"at most {MOST_RANK} are read")
    if space.get_simple_extent_type() == h5s.NULL:
        return 0
    return prod(space.get_simple_extent_dims())


def _check_type(found: Structure, kind: Id, where: str) -> None:
    if kind.committed():
        raise _refusal(where, "a named data type", "it must have a type of its own")
    group = kind.get_class()
    if group == h5t.STRING:
        if kind.get_size() > MOST_TEXT_BYTES:
            raise _refusal(where, f"texts of {kind.get_size()} bytes", f"at most {MOST_TEXT_BYTES} are read")
    elif group in (h5t.INTEGER, h5t.FLOAT):
        if not any(kind.equal(known) for known in _numbers()):
            raise _refusal(where, f"a number of {kind.get_size()} bytes that no processor has", _PLAIN)
    elif not (group == h5t.ENUM and found.limits.booleans and _is_boolean(kind)):
        raise _refusal(where, f"of a type that is {_KINDS.get(group, f'unknown ({group})')}", _PLAIN)


@cache
def _numbers() -> tuple[Id, ...]:
    """The most frequent types first."""
    names = [f"IEEE_F{bits}{order}" for order in ("LE", "BE") for bits in (64, 32, 16)]
    names += [f"STD_{sign}{bits}{order}" for sign in "IU" for order in ("LE", "BE") for bits in (64, 32, 16, 8)]
    return tuple(getattr(h5t, name) for name in names)


def _is_boolean(kind: Id) -> bool:
    if kind.get_nmembers() != 2 or not kind.get_super().equal(h5t.STD_I8LE):
        return False
    return {kind.get_member_name(k): kind.get_member_value(k) for k in (0, 1)} == {b"FALSE": 0, b"TRUE": 1}


def _is_text_of_any_length(kind: Id) -> bool:
    return bool(kind.get_class() == h5t.STRING and kind.is_variable_str())


def _refusal(where: str, what: str, right: str) -> ExcitationFileError:
    return ExcitationFileError(f"{where}: {what}: {right}")
