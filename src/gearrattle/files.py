"""Safe reading of files: only regular files, only in allowed folders, and not larger than the memory.

A path in an input file may name anything: a pipe that never ends, a device, a file that the reader must not see, or a
few kilobytes that unpack to gigabytes. So every file is opened here, or checked here before a library opens it.
"""

from __future__ import annotations

import errno
import io
import mmap
import os
import stat
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from typing import Any, BinaryIO, TextIO

from gearrattle.errors import ModelError, Problem

LIMIT = "GEARRATTLE_READ_LIMIT"
"""Environment variable: largest size of a measured file, unpacked, that is read [bytes]."""
_DEFAULT_LIMIT = 1_000_000_000  # bytes
_KINDS = {stat.S_IFIFO: "a pipe", stat.S_IFSOCK: "a socket", stat.S_IFCHR: "a device", stat.S_IFBLK: "a device"}

_HEAP = b"GCOL\x01\0\0\0"
_MOST_SEARCHED = 200_000_000  # bytes, for all heaps together: a tenth of a second
_MOST_CHUNKS = 10_000
_EDGE = 100_000  # bytes at both ends of a dataset that are searched for heaps: a damaged file states wrong positions
_FLAGS = 3  # index of a byte in an encoded HDF5 type: after two bytes of the encoding, one of version and class

_ROOTS: ContextVar[tuple[Path, ...]] = ContextVar("roots", default=())


class Refused(OSError):
    """A file that is not opened because it breaks a rule; the remedy may be empty."""

    def __init__(self, rule: str, remedy: str = "") -> None:
        super().__init__(0, rule)
        self.rule = rule
        self.remedy = remedy


def opened(path: str | os.PathLike[str]) -> BinaryIO:
    """Open a regular file to read bytes.

    Raises
    ------
    Refused
        a folder, a pipe, a device or a socket; a symbolic link that leads back to itself.
    OSError
        no such file, or the machine refused.
    ValueError
        the text cannot be the name of a file.
    """
    try:
        handle = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
    except OSError as error:
        raise _loop() if error.errno == errno.ELOOP else error from None
    try:
        mode = os.fstat(handle).st_mode
        if stat.S_ISDIR(mode):
            raise IsADirectoryError(21, "Is a directory")
        if not stat.S_ISREG(mode):
            kind = _KINDS.get(stat.S_IFMT(mode), "no regular file")
            raise Refused(f"is {kind}; a regular file is needed", "copy its content into a file")
        return os.fdopen(handle, "rb")
    except BaseException:
        os.close(handle)
        raise


def _loop() -> Refused:
    """Refusal of a symbolic link that leads back to itself."""
    return Refused("is a symbolic link that leads back to itself", "let it name a file, or copy the file in its place")


def _resolved(path: Path) -> Path:
    """Return a path without symbolic links.

    Refused for a link that leads back to itself, for which Python 3.11 raises a ``RuntimeError`` and Python 3.13 no
    error.
    """
    try:
        path.stat()
    except OSError as error:
        if error.errno == errno.ELOOP:
            raise _loop() from None
    return path.resolve()


def opened_text(path: str | os.PathLike[str], encoding: str, errors: str = "strict") -> TextIO:
    """Open a regular file to read text; raises as ``opened``."""
    return io.TextIOWrapper(opened(path), encoding=encoding, errors=errors)


def check_regular(path: str | os.PathLike[str]) -> int:
    """Return the size of a regular file [bytes] before a library opens it; raises as ``opened``."""
    with opened(path) as stream:
        return os.fstat(stream.fileno()).st_size


def read_bytes(path: str | os.PathLike[str]) -> bytes:
    """Return the content of a regular file that is within the limit; raises as ``opened``."""
    with opened(path) as stream:
        within_limit(os.fstat(stream.fileno()).st_size)
        return stream.read()


def limit() -> int:
    """Return the largest size of a file, unpacked, that is read [bytes]; Refused if the environment variable does not
    hold a number.
    """
    text = os.environ.get(LIMIT, "")
    if not text:
        return _DEFAULT_LIMIT
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 1.0 <= value < 2.0**62:
        raise Refused(f'the environment variable {LIMIT} is "{text}"; it must be a number of bytes', "such as 4e9")
    return int(value)


def within_limit(size: float) -> None:
    """Refuse a number of bytes above the limit."""
    most = limit()
    if size > most:
        rule = f"would take {size / 1e9:.3g} GB of memory; at most {most / 1e9:.3g} GB of a file are read"
        raise Refused(rule, f"read fewer channels, or raise the limit: {LIMIT}={1.1 * size:.2g}")


def check_archive(path: str | os.PathLike[str]) -> None:
    """Refuse a zip archive, such as NumPy's .npz, that unpacks to more than the limit; raises as ``opened``."""
    with opened(path) as stream, zipfile.ZipFile(stream) as archive:
        within_limit(sum(entry.file_size for entry in archive.infolist()))


def opened_hdf5(path: str | os.PathLike[str], *, in_parts: bool = False) -> Any:
    """Open an HDF5 file (``h5py.File``) after checking that it has no external data and is within the limit.

    Parameters
    ----------
    in_parts
        whether the caller reads bounded parts of datasets, so that their total size does not matter.

    Raises
    ------
    Refused
        the file is netCDF 3, has external links, external storage or virtual datasets, is larger than the limit, or is
        damaged; and as ``opened``.
    """
    import h5py

    with opened(path) as stream:
        if stream.read(3) == b"CDF":
            rule = "is netCDF 3; results are saved as netCDF-4, which is HDF5"
            raise Refused(rule, "nccopy -k nc4 old.nc new.nc converts it")
    file = h5py.File(path, "r")
    try:
        _check_hdf5(file, in_parts=in_parts)
        _check_heaps(path, file)
    except BaseException:
        file.close()
        raise
    return file


def _check_hdf5(file: Any, *, in_parts: bool) -> None:
    import h5py

    size = 0
    _check_types(file)
    for _, item in _objects(file):
        _check_types(item)
        if isinstance(item, h5py.Dataset):
            _check_fill(item)
        if isinstance(item, h5py.Dataset) and item.shape:
            size += item.size * max(item.dtype.itemsize, 8)
    if not in_parts:
        within_limit(size)


def _check_types(item: Any) -> None:
    """Refuse a dataset or an attribute of variable length that is neither a sequence nor a string.

    The library ends the process on such a type (HDF5 2.0.0).
    """
    import h5py

    kinds = [item.id.get_type()] if isinstance(item, h5py.Dataset) else []
    kinds += [h5py.h5a.open(item.id, index=i).get_type() for i in range(h5py.h5a.get_num_attrs(item.id))]
    while kinds:
        kind = kinds.pop()
        group = kind.get_class()
        if group == h5py.h5t.COMPOUND:
            kinds += [kind.get_member_type(i) for i in range(kind.get_nmembers())]
        elif group in (h5py.h5t.VLEN, h5py.h5t.ARRAY):
            kinds.append(kind.get_super())
        if group == h5py.h5t.VLEN and kind.encode()[_FLAGS] & 0xF > 1:
            raise Refused("is damaged: an impossible type of variable length", "write it again")


def _check_fill(item: Any) -> None:
    """Refuse a dataset whose fill value has a size but no value, or a value but no size.

    The library ends the process on such a dataset (HDF5 2.0.0).
    """
    try:
        item.id.get_create_plist().fill_value_defined()
    except (ValueError, RuntimeError):
        raise Refused(
            "is damaged: an impossible value in place of numbers that were not written", "write it again"
        ) from None


def _check_heaps(path: str | os.PathLike[str], file: Any) -> None:
    """Refuse an HDF5 file with a global heap that the library would read for ever.

    Strings of variable length are stored in global heaps: a header of 8 bytes and the size of the heap, then objects
    with an index (2 bytes), 6 bytes of counts and a size. The library steps from object to object by their sizes; it
    never ends if a size is zero or so large that the sum overflows (HDF5 2.0.0, H5HG__cache_heap_deserialize). The free
    space of a heap has index 0 and a size that includes its own header. The inside of large datasets is not searched
    for heaps. Format: The HDF Group, HDF5 File Format Specification 3.0, III.E.

    A dataset refers to a string by its length (4 bytes), the address of the heap and the index of the object (4 bytes);
    the library allocates as much memory as the length says. These references are checked as well, except in files with
    very many heaps.

    Raises
    ------
    Refused
        the heap has an object with such a size, or a string is longer than the file.
    """
    import h5py

    # layout of a heap in this file
    (address, width) = file.id.get_create_plist().get_sizes()
    size = os.path.getsize(path)
    objects = 0
    header = 8 + width
    most = 2 ** (8 * width)
    insides = _insides(file)
    with opened(path) as stream, mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ) as content:
        # objects of every heap, by their sizes
        heaps: list[tuple[int, int]] = []
        for begin in _places(content, _HEAP, insides):
            if heaps and begin < heaps[-1][1]:
                continue  # text in a heap
            claimed = begin + int.from_bytes(content[begin + 8 : begin + header], "little")
            end = min(claimed, size)
            heaps.append((begin, claimed if claimed <= size else begin))
            at = begin + header
            while at + header <= end:
                index = int.from_bytes(content[at : at + 2], "little")
                length = int.from_bytes(content[at + 8 : at + header], "little")
                padded = (header + (length + 7) // 8 * 8 if index else length) % most
                objects += 1
                if not header <= padded < most // 2 or objects > size // header:
                    raise Refused("is damaged: an object of a global heap has an impossible size", "write it again")
                at += padded
        # lengths of strings in datasets
        for _, item in datasets(file):
            at = item.id.get_offset()
            kind = item.id.get_type()
            if at and (kind.get_class() == h5py.h5t.VLEN or getattr(kind, "is_variable_str", bool)()):
                lengths = content[at : at + item.size * (8 + address)]
                step = 8 + address
                if any(int.from_bytes(lengths[i : i + 4], "little") > size for i in range(0, len(lengths), step)):
                    raise Refused("is damaged: a string is longer than the file", "write it again")
        # lengths of other strings that refer to a heap
        elsewhere = sorted([*heaps, *_numbers(file)])  # text and numbers may look like such a reference
        searched = size - sum(end - first for first, end in elsewhere)
        for begin, _ in heaps if len(heaps) * searched < _MOST_SEARCHED else []:
            for at in _places(content, (begin - file.userblock_size).to_bytes(address, "little"), elsewhere):
                length = int.from_bytes(content[max(0, at - 4) : at], "little")
                index = int.from_bytes(content[at + address : at + address + 4], "little")
                if length > size and 0 < index < 2**16:  # refers to a string in this heap
                    raise Refused("is damaged: a string is longer than the file", "write it again")


def _places(content: mmap.mmap, what: bytes, insides: list[tuple[int, int]]) -> Iterator[int]:
    """Yield the positions of a byte sequence in a file, except inside large datasets."""
    last = 0
    for first, end in [*insides, (len(content), len(content))]:
        while (last := content.find(what, last, first + len(what))) >= 0:
            yield last
            last += 1
        last = max(first, end)


def _insides(file: Any) -> list[tuple[int, int]]:
    """Begin and end of the inside of every large dataset in an HDF5 file, ascending [bytes]."""
    extents = [(item.id.get_offset() or 0, item.id.get_storage_size()) for _, item in datasets(file)]
    return sorted((at + _EDGE, at + size - _EDGE) for at, size in extents if at and size > 4 * _EDGE)


def _numbers(file: Any) -> list[tuple[int, int]]:
    """Begin and end of the values of every dataset in an HDF5 file except strings of variable length [bytes]."""
    import h5py

    regions = []
    for _, item in datasets(file):
        if item.id.get_type().get_class() == h5py.h5t.VLEN or getattr(item.id.get_type(), "is_variable_str", bool)():
            continue
        if item.chunks is None:
            regions.append((item.id.get_offset() or 0, item.id.get_storage_size()))
        else:
            chunks = (item.id.get_chunk_info(k) for k in range(min(item.id.get_num_chunks(), _MOST_CHUNKS)))
            regions += [(chunk.byte_offset, chunk.size) for chunk in chunks if chunk.byte_offset is not None]
    return [(begin, begin + length) for begin, length in regions if begin and length > 0]


def datasets(file: Any) -> Iterator[tuple[str, Any]]:
    """Yield names and datasets of an HDF5 file, in its order; raises as ``_objects``."""
    import h5py

    return ((name, item) for name, item in _objects(file) if isinstance(item, h5py.Dataset))


def _objects(file: Any) -> Iterator[tuple[str, Any]]:
    """Yield names, groups and datasets of an HDF5 file in its order, every object once and without soft links.

    Refused for an external link, external storage or a virtual dataset.
    """
    import h5py

    # groups from the root on, each object once
    rule = "points to data in another file"
    remedy = "copy the data into the file"
    visited: set[Any] = set()
    open_groups = [("", file, iter(list(file)))]
    while open_groups:
        prefix, group, keys = open_groups[-1]
        key = next(keys, None)
        if key is None:
            open_groups.pop()
            continue
        # links: external ones refused, soft ones left out
        name = f"{prefix}{key}"
        link = group.get(key, getlink=True)
        if isinstance(link, h5py.ExternalLink):
            raise Refused(f"{name}: {rule}", remedy)
        if not isinstance(link, h5py.HardLink):
            continue
        item = group[key]
        address = h5py.h5o.get_info(item.id).addr
        if address in visited:
            continue
        visited.add(address)
        # groups, and datasets without external data
        if isinstance(item, h5py.Group):
            open_groups.append((f"{name}/", item, iter(list(item))))
        elif isinstance(item, h5py.Dataset) and (item.external or item.is_virtual):
            raise Refused(f"{name}: {rule}", remedy)
        yield name, item


def private_folder(path: Path) -> bool:
    """Make a folder that no other user can write, for files that are trusted later; return whether this succeeded.

    The folder and its parent must be owned by this user, be no symbolic links and have mode 700; both are made if they
    do not exist.
    """
    for folder in (path.parent, path):
        try:
            folder.parent.mkdir(parents=True, exist_ok=True)
            folder.mkdir(mode=0o700, exist_ok=True)
            owner = os.lstat(folder)
            if not stat.S_ISDIR(owner.st_mode) or (hasattr(os, "geteuid") and owner.st_uid != os.geteuid()):
                return False
            if owner.st_mode & 0o022 and folder == path and any(path.iterdir()):
                return False  # the existing path may belong to another user
            if owner.st_mode & 0o077:
                folder.chmod(0o700)
        except OSError:
            return False
    return os.access(path, os.W_OK)


@contextmanager
def allowed_root(folder: str | os.PathLike[str] | None) -> Iterator[None]:
    """Also allow files under a folder while the context is open; None allows no further files.

    ModelError if the folder is a symbolic link that leads back to itself.
    """
    try:
        roots = _ROOTS.get() if folder is None else (*_ROOTS.get(), _resolved(Path(folder)))
    except Refused as error:
        raise ModelError(Problem(f"root {os.fspath(folder or '')}", "", error.rule, error.remedy)) from None
    token = _ROOTS.set(roots)
    try:
        yield
    finally:
        _ROOTS.reset(token)


def allowed_roots() -> tuple[Path, ...]:
    """Return the folders of ``allowed_root``, to pass them to another process, where the context does not apply."""
    return _ROOTS.get()


def reachable(path: str | os.PathLike[str], folder: str | os.PathLike[str]) -> Path:
    """Return the path of a file that an input file names, all symbolic links resolved.

    Parameters
    ----------
    path
        as written in the input file; relative to ``folder``.
    folder
        the folder of the input file. Files may be read under this folder, under the folders of ``allowed_root`` and, if
        the working directory contains this folder, under the working directory.

    Raises
    ------
    Refused
        the file is in another folder. It is not opened.
    """
    home = _resolved(Path(folder))
    working = Path.cwd()
    target = _resolved(home / path)
    allowed = [home, *([working] if home.is_relative_to(working) else []), *_ROOTS.get()]
    if not any(target.is_relative_to(one) for one in allowed):
        rule = f"lies outside of {allowed[-1] if len(allowed) > 1 else home}, the folder whose files may be read"
        raise Refused(rule, f'copy the file there, or allow its folder: --root "{target.parent}", root= in Python')
    return target
