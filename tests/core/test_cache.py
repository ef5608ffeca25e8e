"""The cache: complete files are read, others are computed again."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbprm_core.cache import Arrays, cache_folder, cached, key_of


class Maker:
    """Computes arrays and counts its calls."""

    def __init__(self) -> None:
        self.calls = 0

    def __call__(self) -> Arrays:
        self.calls += 1
        return {"a": np.arange(500.0), "b": np.array([[True, False]])}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    path = tmp_path / "not" / "there" / "yet"
    monkeypatch.setenv("RBPRM_CACHE_DIR", str(path))
    return path


def same(arrays: Arrays) -> bool:
    wanted = Maker()()
    return arrays.keys() == wanted.keys() and all(
        np.array_equal(arrays[k], wanted[k]) and arrays[k].dtype == wanted[k].dtype for k in wanted
    )


def test_the_folder_is_the_variables_or_the_users(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("RBPRM_CACHE_DIR", "/somewhere")
    assert cache_folder() == Path("/somewhere")
    monkeypatch.setenv("RBPRM_CACHE_DIR", "")
    assert cache_folder().name == "rbprm"


def test_computed_once(folder: Path) -> None:
    make = Maker()
    assert same(cached("x", "1", make))
    assert same(cached("x", "1", make))
    assert make.calls == 1
    assert [path.name for path in folder.iterdir()] == ["x-1.npz"]


def test_another_key_or_name_is_another_result(folder: Path) -> None:
    make = Maker()
    for name, key in (("x", "1"), ("x", "2"), ("y", "1")):
        cached(name, key, make)
    assert make.calls == 3


def half(data: bytes) -> bytes:
    return data[: len(data) // 2]


def flipped(data: bytes) -> bytes:
    middle = len(data) // 3
    return data[:middle] + bytes([data[middle] ^ 255]) + data[middle + 1 :]


@pytest.mark.parametrize(
    "spoil",
    [
        lambda data: b"",
        lambda data: data[:3],
        lambda data: b"no archive at all",
        lambda data: data[:100],
        half,
        lambda data: data[:-1],
        flipped,
    ],
)
def test_a_spoilt_file_is_made_again(folder: Path, spoil: Callable[[bytes], bytes]) -> None:
    make = Maker()
    cached("x", "1", make)
    file = folder / "x-1.npz"
    whole = file.read_bytes()
    file.write_bytes(spoil(whole))
    assert same(cached("x", "1", make))
    assert make.calls == 2
    assert same(cached("x", "1", make))
    assert make.calls == 2


def test_a_folder_that_cannot_be_written_costs_time_only(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    blocked = tmp_path / "file"
    blocked.write_text("in the way")
    monkeypatch.setenv("RBPRM_CACHE_DIR", str(blocked))
    make = Maker()
    assert same(cached("x", "1", make))
    assert same(cached("x", "1", make))
    assert make.calls == 2


def test_an_error_of_the_computation_leaves_nothing(folder: Path) -> None:
    def fail() -> Arrays:
        raise RuntimeError("no")

    with pytest.raises(RuntimeError, match="no"):
        cached("x", "1", fail)
    assert not folder.exists() or os.listdir(folder) == []


def test_many_at_once(folder: Path) -> None:
    with ThreadPoolExecutor(8) as pool:
        found = list(pool.map(lambda _: cached("x", "1", Maker()), range(24)))
    assert all(map(same, found))
    assert [path.name for path in folder.iterdir()] == ["x-1.npz"]


parts = st.lists(st.binary(max_size=6), max_size=5)


@given(parts, parts)
def test_a_key_tells_every_list_of_inputs_apart(first: list[bytes], second: list[bytes]) -> None:
    assert (key_of(first) == key_of(second)) == (first == second)
