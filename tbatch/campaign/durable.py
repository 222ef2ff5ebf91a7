"""Files that are either wholly there or not at all, whatever kills the process or the power.

Every byte of a campaign folder goes through ``write_bytes``: a temporary name in the same folder, fsync, rename,
fsync of the folder. Parquet carries a CRC per page and is read with it checked: without it, 282 of 300 single flipped
bits were read back as wrong numbers (pyarrow 26, zstd).
"""

import errno
import hashlib
import os
import socket
from collections.abc import Sequence
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from tbatch.campaign.faults import FolderUnusable, OutOfSpace, StoreDamaged

TEMPORARY_SUFFIX = ".tmp"
_NO_SPACE = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO}


def make_folder(path: Path) -> None:
    """Makes a folder and those above it."""
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise write_fault(error, path) from error


def write_bytes(path: Path, data: bytes) -> str:
    """Writes a file durably under its final name and returns its SHA-256 in hex."""
    # The host, since the folder may be shared: two machines may have the same process number.
    temporary = path.with_name(f".{path.name}.{socket.gethostname()}-{os.getpid()}{TEMPORARY_SUFFIX}")
    try:
        with open(temporary, "wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        os.replace(temporary, path)
        _sync_folder(path.parent)
    except OSError as error:
        _forget(temporary)
        raise write_fault(error, path, len(data)) from error
    except BaseException:  # an interruption between two lines must not leave the temporary file behind
        _forget(temporary)
        raise
    return hash_of(data)


def hash_of(data: bytes) -> str:
    """SHA-256 of bytes, in hex."""
    return hashlib.sha256(data).hexdigest()


def table_bytes(table: pa.Table) -> bytes:
    """A table as the bytes of a Parquet file: zstd, a CRC per page. The same table gives the same bytes."""
    sink = pa.BufferOutputStream()
    pq.write_table(table, sink, compression="zstd", write_page_checksum=True)
    return sink.getvalue().to_pybytes()


def read_bytes(path: Path, sha256: str | None = None) -> bytes:
    """Reads a file of the store; with ``sha256``, only if it is the one that was written."""
    try:
        data = path.read_bytes()
    except FileNotFoundError as error:
        raise StoreDamaged(f"{path}: missing") from error
    except PermissionError as error:
        raise FolderUnusable(f"cannot read {path}: {error.strerror}") from error
    except OSError as error:
        raise StoreDamaged(f"{path}: cannot be read ({error.strerror})") from error
    if sha256 is not None and hash_of(data) != sha256:
        raise StoreDamaged(f"{path}: its content is not what was written (SHA-256 differs)")
    return data


def read_table(path: Path, sha256: str | None = None, columns: Sequence[str] | None = None) -> pa.Table:
    """Reads a Parquet file of the store, checking the CRC of every page read."""
    data = read_bytes(path, sha256)
    try:
        # A third of the time of pq.read_table (pyarrow 26), of which a million runs take some ten thousand.
        file = pq.ParquetFile(pa.BufferReader(data), pre_buffer=False, page_checksum_verification=True)
        return file.read(None if columns is None else list(columns), use_threads=False)
    except (pa.ArrowException, OSError) as error:
        raise StoreDamaged(f"{path}: not a whole Parquet file ({_first_line(error)})") from error


def remove_leftovers(folder: Path) -> None:
    """Removes the temporary files of a killed process. Only the owner of the folder's lock may call this."""
    for path in folder.glob(f".*{TEMPORARY_SUFFIX}"):
        _forget(path)


def _sync_folder(folder: Path) -> None:
    """Makes a rename last: the name is in the folder, and the folder has its own cache."""
    if os.name == "nt":  # a folder cannot be opened there
        return
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _forget(path: Path) -> None:
    try:
        path.unlink(missing_ok=True)
    except OSError:
        pass  # it is ignored by every reader and removed by the next owner


def write_fault(error: OSError, path: Path, size: int | None = None) -> OutOfSpace | FolderUnusable:
    """The fault that an operating system error on ``path`` means."""
    needs = f", {size} bytes to write" if size is not None else ""
    if error.errno in _NO_SPACE:
        return OutOfSpace(
            f"cannot write {path}: {error.strerror}{needs}. What is stored stays: put that right and resume."
        )
    return FolderUnusable(f"cannot write {path}: {error.strerror or error}")


def _first_line(error: Exception) -> str:
    return str(error).strip().split("\n")[0]
