"""Reading a Parquet file leaves no thread behind that could outlive the interpreter and abort it."""

from __future__ import annotations

import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

HOUSE = Path(__file__).resolve().parents[3]
# Wide and of many row groups, so that a pool has something to share out; it ends as a refusal does, soon after reading.
COLUMNS, ROWS, GROUP = 60, 400, 20
READ = """
import os, sys
from pathlib import Path
from sim.record.parquet import read_parquet
before = set(os.listdir("/proc/self/task"))
table = read_parquet(Path(sys.argv[1]).read_bytes())
print(table.num_rows, len(set(os.listdir("/proc/self/task")) - before))
sys.exit(2)
"""


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("parquet") / "table.parquet"
    table = pa.table({f"c{i}": [str(i * j) for j in range(ROWS)] for i in range(COLUMNS)})
    pq.write_table(table, path, row_group_size=GROUP, write_page_checksum=True)
    return path


def test_twenty_readers_that_end_at_once_end_in_peace(file: Path) -> None:
    def read(_: int) -> tuple[int, str, str]:
        done = subprocess.run([sys.executable, "-c", READ, file], cwd=HOUSE, capture_output=True, text=True)
        return done.returncode, done.stdout, done.stderr

    # Four at a time: on a busy machine the threads of a pool are late, which is when they did abort.
    with ThreadPoolExecutor(4) as pool:
        assert set(pool.map(read, range(20))) == {(2, f"{ROWS} 0\n", "")}


def test_product_reads_parquet_in_no_other_way() -> None:
    sources = {path.name: path.read_text() for path in (HOUSE / "sim").rglob("*.py")}
    del sources["parquet.py"]
    ways = ("pq.read_", "pq.ParquetFile", "pq.ParquetDataset", "pyarrow.dataset", "pd.read_parquet", "pl.read_parquet")
    assert not [(name, way) for name, text in sources.items() for way in ways if way in text]
