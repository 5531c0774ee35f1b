"""A sweep's folder from outside: killed at every step, on a full disk, with any byte changed, read by others."""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from artde_gym.errors import StoreError
from artde_gym.studies import read_sweep
from artde_gym.studies.sweep import parquet as sweep_part
from artde_gym.studies.sweep import store as sweep_store
from artde_gym.studies.sweep.store import SweepStore

pytest.importorskip("pyarrow", reason="pyarrow is not installed (extra sweep)")


def row(number: int, cell: str = "c0ffee", /, **columns: Any) -> dict[str, Any]:
    labels = {"cell": cell, "controller": "tde", "env": "E-v0", "scenario": "S", "seed": 7 + number, "episode": number}
    return {**labels, "fell": number % 2 == 0, "rmse_m": 0.1 / (1 + number), "fall_reason": "", **columns}


FIRST = [row(0), row(1, time_to_fall_s=float("nan"))]
SECOND = [row(0, "beef", **{"gains.k_p": 3, "recovery_time_s": float("inf")}), row(2)]


def stored(folder: Path, *parts: list[dict[str, Any]]) -> pd.DataFrame:
    """What is in a folder after it has been given each part that it does not have."""
    with SweepStore(folder) as store:
        store.begin("{}", {})
        for part in parts:
            store.add([row for row in part if (row["cell"], row["episode"]) not in store.done])
            store.flush()
        store.finish()
    return read_sweep(folder)


def parts_of(folder: Path) -> list[Path]:
    return sorted((folder / "episodes").iterdir())


@pytest.fixture
def whole(tmp_path: Path) -> pd.DataFrame:
    return stored(tmp_path / "whole", FIRST, SECOND)


# ---------------------------------------------------------------- content


def test_what_comes_back_is_what_went_in(whole):
    assert list(whole) == [*sweep_part.LABELS, *sorted(set(whole) - set(sweep_part.LABELS))]
    assert whole["cell"].tolist() == ["beef", "c0ffee", "c0ffee", "c0ffee"]
    assert whole["episode"].tolist() == [0, 0, 1, 2]
    assert whole["seed"].dtype == np.uint64
    assert whole["episode"].dtype == np.int64
    assert whole["fell"].tolist() == [True, True, False, True]
    assert whole["rmse_m"].tolist() == [0.1, 0.1, 0.1 / 2, 0.1 / 3]
    assert whole["gains.k_p"].tolist()[0] == 3.0
    assert np.isinf(whole["recovery_time_s"][0])
    assert whole["time_to_fall_s"].isna().all()


def test_all_parts_have_one_versioned_schema_whatever_comes_later(tmp_path, whole):
    import pyarrow.parquet as pq

    schemas = [pq.read_schema(path) for path in parts_of(tmp_path / "whole")]
    assert len(schemas) == 2
    assert schemas[0].equals(schemas[1])
    assert {schema.metadata[b"artde_gym.schema"] for schema in schemas} == {b"2"}


def test_pandas_duckdb_and_polars_read_it_as_it_is(tmp_path, whole):
    folder = tmp_path / "whole" / "episodes"
    frame = pd.read_parquet(folder)
    pd.testing.assert_frame_equal(frame.sort_values(["cell", "episode"], ignore_index=True), whole, check_exact=True)
    duckdb = pytest.importorskip("duckdb", reason="DuckDB is not installed")
    query = f"select cell, count(*), avg(rmse_m), count(time_to_fall_s) from '{folder}/*.parquet' group by 1 order by 1"
    assert duckdb.sql(query).fetchall() == [("beef", 1, 0.1, 0), ("c0ffee", 3, pytest.approx(0.55 / 9), 0)]
    polars = pytest.importorskip("polars", reason="Polars is not installed")
    lazy = polars.scan_parquet(folder / "*.parquet").group_by("cell").agg(polars.col("rmse_m").mean()).sort("cell")
    assert lazy.collect().to_dict(as_series=False)["rmse_m"] == [0.1, pytest.approx(0.55 / 9)]
    assert polars.read_parquet(folder).height == 4


def test_a_column_has_one_type(tmp_path):
    stored(tmp_path / "run", [row(0, **{"gains.preset": "thesis"})])
    with pytest.raises(StoreError, match=r"gains\.preset.*text and number"):
        stored(tmp_path / "run", [row(1, **{"gains.preset": 3})])


# ---------------------------------------------------------------- killed

CRASHES = """
import os, signal, sys
from pathlib import Path
sys.path.insert(0, sys.argv[1])
import test_sweep_store as tests

out, kind = Path(sys.argv[2]), sys.argv[3]
NAMES = ("replace", "fsync", "unlink", "mkdir", "chmod", "open")

def die():
    os.kill(os.getpid(), signal.SIGKILL)

def doomed(number):
    calls = 0
    for name in NAMES:
        real = getattr(os, name)
        def call(*args, real=real, name=name, **kwargs):
            nonlocal calls
            calls += 1
            if calls == number:
                if kind == "half" and name == "fsync":
                    os.ftruncate(args[0], os.fstat(args[0]).st_size // 2)
                if kind != "after":
                    die()
                try:
                    real(*args, **kwargs)
                finally:  # a call that fails, as one for a folder that is there, is a place to die, too
                    die()
            return real(*args, **kwargs)
        setattr(os, name, call)

number = 0
while True:
    number += 1
    pid = os.fork()
    if pid == 0:
        doomed(number)
        tests.stored(out / str(number), tests.FIRST, tests.SECOND)
        os._exit(0)
    if os.waitpid(pid, 0)[1] == 0:
        break
print(number - 1)
"""


@pytest.mark.parametrize(
    "kind", ["before", *(pytest.param(kind, marks=pytest.mark.once) for kind in ("after", "half"))]
)
def test_killed_at_any_step_it_is_whole_and_goes_on(tmp_path, whole, kind):
    """SIGKILL before, after or in the middle of each call that changes the file system, one after the other."""
    arguments = [sys.executable, "-c", CRASHES, str(Path(__file__).parent), str(tmp_path), kind]
    outcome = subprocess.run(arguments, capture_output=True, text=True, timeout=120, check=True)
    kills = int(outcome.stdout)
    assert kills > 20
    for number in range(1, kills + 1):
        folder = tmp_path / str(number)
        if (folder / "sweep.json").exists():
            found = read_sweep(folder)
            assert not found.duplicated(["cell", "episode"]).any()
            known = found[["cell", "episode"]].merge(whole, on=["cell", "episode"], how="left", validate="one_to_one")
            columns = [name for name in found if name in known]
            pd.testing.assert_frame_equal(
                found.loc[:, columns], known.loc[:, columns], check_exact=True, check_dtype=False
            )
        again = stored(folder, FIRST, SECOND)
        pd.testing.assert_frame_equal(again, whole, check_exact=True)
        assert sorted(path.name for path in folder.iterdir()) == ["episodes", "sweep.json"]


@pytest.mark.parametrize("after", [False, True])
def test_an_interrupt_while_it_writes_stores_everything_once(tmp_path, monkeypatch, after):
    replace = os.replace

    def interrupted(*paths: Any) -> None:
        monkeypatch.setattr(os, "replace", replace)
        if after:
            replace(*paths)
        raise KeyboardInterrupt

    monkeypatch.setattr(sweep_store, "SHORTEST", 1e9)
    monkeypatch.setattr(sweep_store, "LONGEST", 1e9)
    with SweepStore(tmp_path) as store:
        store.begin("{}", {})
        store.add(FIRST)
        monkeypatch.setattr(os, "replace", interrupted)
        with pytest.raises(KeyboardInterrupt):
            store.flush()
    assert read_sweep(tmp_path)["episode"].tolist() == [0, 1]


# ---------------------------------------------------------------- corrupt


def test_any_changed_byte_and_any_missing_end_is_found():
    data = sweep_part.encode(sweep_part.table(FIRST, sweep_part.types_of(FIRST)))
    assert sweep_part.decode(data).num_rows == 2
    for place in range(len(data)):
        with pytest.raises(ValueError, match="hash"):
            sweep_part.decode(data[:place] + bytes([data[place] ^ 1]) + data[place + 1 :])
        with pytest.raises(ValueError, match="hash"):
            sweep_part.decode(data[:place])
    with pytest.raises(ValueError, match="hash"):
        sweep_part.decode(data + b"\0")


def test_a_file_of_others_with_a_right_hash_is_no_part():
    import pyarrow as pa

    with pytest.raises(ValueError, match="schema"):
        sweep_part.decode(sweep_part.encode(pa.table({"x": [1]})))


@pytest.mark.parametrize("harm", ["truncated", "empty", "changed", "foreign", "copied"])
def test_a_corrupt_part_is_set_aside_and_its_episodes_run_again(tmp_path, whole, harm):
    folder = tmp_path / "run"
    shutil.copytree(tmp_path / "whole", folder)
    path = folder / "episodes" / "part-000001.parquet"
    data = path.read_bytes()
    if harm == "copied":
        path = path.with_name("part-000009.parquet")
    if harm == "foreign":
        path = path.with_name("mine.parquet")
        data = b"PAR1"
    harmed = {"truncated": data[:-9], "empty": b"", "changed": data.replace(b"tde", b"tdf", 1)}.get(harm, data)
    path.write_bytes(harmed)
    if harm not in ("copied", "foreign"):
        assert harmed != data
        with pytest.raises(StoreError, match="is corrupt"):
            read_sweep(folder)
    with SweepStore(folder) as store:
        assert [one.name for one in store.set_aside] == [path.name]
        assert len(store.done) == (4 if harm in ("copied", "foreign") else 2)
    again = stored(folder, FIRST, SECOND)
    pd.testing.assert_frame_equal(again, whole, check_exact=True)
    assert (folder / "corrupt" / path.name).read_bytes() == harmed
    assert path.name not in {part.name for part in parts_of(folder)}


@pytest.mark.parametrize("record", [None, "", "{", "[]", "null", '{"configuration": 1}', '{"runs": 3}'])
def test_a_lost_record_loses_no_episode(tmp_path, whole, record):
    path = tmp_path / "whole" / "sweep.json"
    path.unlink()
    if record is not None:
        path.write_text(record)
    with pytest.raises(StoreError, match=r"sweep\.json"):
        read_sweep(tmp_path / "whole")
    with SweepStore(tmp_path / "whole") as store:
        assert len(store.done) == 4
    pd.testing.assert_frame_equal(stored(tmp_path / "whole"), whole, check_exact=True)


def test_other_folders_are_left_alone(tmp_path):
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "letter.txt").write_text("dear")
    for record in ("{", '{"configuration": {"format": "another"}, "runs": []}'):
        folder = tmp_path / record[:3]
        folder.mkdir()
        (folder / "sweep.json").write_text(record)
        with pytest.raises(StoreError):
            stored(folder, FIRST)
        assert [path.name for path in folder.iterdir()] == ["sweep.json"]
    with pytest.raises(StoreError, match="other files"):
        stored(tmp_path / "mine", FIRST)
    with pytest.raises(StoreError, match=r"sweep\.json"):
        read_sweep(tmp_path / "mine")


def test_other_software_is_refused(tmp_path, whole, monkeypatch):
    provenance = sweep_store.provenance
    now = provenance()
    now["packages"]["numpy"] = "1.0"
    monkeypatch.setattr(sweep_store, "provenance", lambda *_, **_others: now)
    with pytest.raises(StoreError, match=r"version of numpy '1\.0' differs.*new folder"):
        stored(tmp_path / "whole", [row(9)])
    pd.testing.assert_frame_equal(read_sweep(tmp_path / "whole"), whole, check_exact=True)


TOGETHER = """
import os, sys
from pathlib import Path
sys.path.insert(0, sys.argv[1])
import test_sweep_store as tests
from artde_gym.errors import StoreError
from artde_gym.evaluation.lock import locked

for number in range(10):
    (begin, start), (report, answer) = os.pipe(), os.pipe()
    folder = Path(sys.argv[2]) / str(number)
    for child in range(3):
        if os.fork() == 0:
            os.close(start)
            try:
                with locked(folder), tests.SweepStore(folder) as store:
                    os.read(begin, 1)  # until the others have been refused
                    store.begin("{}", {})
                    store.add(tests.FIRST)
            except StoreError as error:
                os.write(answer, f"{error}\\n".encode())
            os._exit(0)
    os.close(begin), os.close(answer)
    refused = ""
    while refused.count("\\n") < 2:
        refused += os.read(report, 10_000).decode()
    os.close(start)
    for child in range(3):
        os.wait()
    print(refused, end="")
    assert len(tests.read_sweep(folder)) == 2
"""


def test_of_sweeps_that_begin_together_one_runs_and_the_others_say_so(tmp_path):
    arguments = [sys.executable, "-c", TOGETHER, str(Path(__file__).parent), str(tmp_path)]
    outcome = subprocess.run(arguments, capture_output=True, text=True, timeout=100, check=False)
    assert outcome.returncode == 0, outcome.stderr
    lines = outcome.stdout.splitlines()
    assert len(lines) == 20
    assert all("is in use by process" in line for line in lines)


def test_every_run_leaves_its_provenance(tmp_path, whole):
    stored(tmp_path / "whole", [row(9)])
    record = json.loads((tmp_path / "whole" / "sweep.json").read_text())
    assert [run["complete"] for run in record["runs"]] == [True, True]
    assert record["runs"][0]["provenance"]["packages"]["mujoco"]


# ---------------------------------------------------------------- full disk

FILL = """
import resource, sys
from pathlib import Path
sys.path.insert(0, sys.argv[1])
import test_sweep_store as tests
from artde_gym.errors import StoreError

folder = Path(sys.argv[2])
tests.stored(folder, tests.FIRST)
resource.setrlimit(resource.RLIMIT_FSIZE, (2000, -1))
try:
    tests.stored(folder, tests.SECOND)
except StoreError as error:
    print(error)
"""


def test_a_file_that_cannot_grow_is_an_error_of_ours_and_the_folder_goes_on(tmp_path, whole):
    folder = tmp_path / "run"
    arguments = [sys.executable, "-c", FILL, str(Path(__file__).parent), str(folder)]
    outcome = subprocess.run(arguments, capture_output=True, text=True, timeout=60, check=True)
    assert "File too large" in outcome.stdout
    assert "re-run the command to resume" in outcome.stdout
    assert len(read_sweep(folder)) == 2
    pd.testing.assert_frame_equal(stored(folder, FIRST, SECOND), whole, check_exact=True)


def fill(path: Path) -> None:
    with contextlib.suppress(OSError), path.open("wb", buffering=0) as file:
        while True:
            file.write(bytes(512))


@pytest.fixture
def small_disk(tmp_path):
    """A disk of 60 kB."""
    place = tmp_path / "disk"
    place.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=60k", "tmpfs", str(place)]
    if os.geteuid() != 0 or subprocess.run(mount, capture_output=True, check=False).returncode != 0:
        pytest.skip("a small disk can be mounted by root alone, and not in every container")
    yield place
    subprocess.run(["umount", str(place)], check=True)


def test_a_full_disk_is_an_error_of_ours_and_the_folder_goes_on(small_disk, whole):
    ballast = small_disk / "ballast"
    stored(small_disk / "run", FIRST)
    fill(ballast)
    with pytest.raises(StoreError, match=r"No space left.*re-run the command to resume"):
        stored(small_disk / "run", FIRST, SECOND)
    assert len(read_sweep(small_disk / "run")) == 2
    ballast.unlink()
    pd.testing.assert_frame_equal(stored(small_disk / "run", FIRST, SECOND), whole, check_exact=True)
    left = sorted(path.name for path in (small_disk / "run").iterdir())
    assert left == ["episodes", "sweep.json"]
