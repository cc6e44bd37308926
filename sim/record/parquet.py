"""Reads Parquet files in the calling thread alone."""

from __future__ import annotations

import pyarrow as pa
import pyarrow.parquet as pq


def read_parquet(content: bytes) -> pa.Table:
    """Read a Parquet file that has been read into memory, and verify the checksums of its pages.

    `pyarrow.parquet.read_table` gives the bytes to threads of a pool, even with `use_threads=False`. Such a thread may
    let go of them when the interpreter is gone already, and aborts the process then: exit code 134.

    Args:
        content: of the file.

    Raises:
        OSError, pa.ArrowException: if it is damaged or not Parquet.
    """
    return pq.ParquetFile(pa.BufferReader(content), page_checksum_verification=True).read(use_threads=False)
