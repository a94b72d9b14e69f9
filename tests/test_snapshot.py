"""Snapshots: what is loaded is what was saved, and nothing else is loaded."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings

import flintknap as fk
import strategies


def survives(engine: fk.Engine, path: Path) -> fk.Engine:
    """Save, load, compare; return the loaded one."""
    engine.save(path)
    loaded = fk.load(path)
    loaded.check()
    assert loaded.digest() == engine.digest()
    assert loaded.revision == engine.revision
    np.testing.assert_array_equal(loaded.ids(), engine.ids())
    np.testing.assert_array_equal(loaded.points(), engine.points())
    np.testing.assert_array_equal(
        loaded.multiplicity(loaded.ids()), engine.multiplicity(engine.ids())
    )
    np.testing.assert_array_equal(loaded.boundary().ids, engine.boundary().ids)
    np.testing.assert_array_equal(loaded.boundary().inside, engine.boundary().inside)
    return loaded


@settings(deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(strategies.point_sets(30), strategies.generators)
def test_a_loaded_engine_goes_on_as_the_saved_one(tmp_path, xy, rng):
    engine = fk.Engine()
    ids = engine.insert(xy)
    engine.remove(rng.permutation(ids)[: len(ids) // 3])
    loaded = survives(engine, tmp_path / "engine")
    again, going = rng.permutation(xy), rng.permutation(engine.ids())[:3]
    for each in (engine, loaded):
        each.insert(again[:5])
        each.remove(going)
        each.insert(again[5:])
        each.check()
    np.testing.assert_array_equal(loaded.ids(), engine.ids())
    assert loaded.digest() == engine.digest()
    assert loaded.revision == engine.revision


@pytest.mark.parametrize("count", [0, 1, 2, 3, 4])
def test_small_and_flat_engines_survive(tmp_path, count):
    engine = fk.Engine()
    for i in range(count):
        engine.insert(float(i), 2.0 * i)
    loaded = survives(engine, tmp_path / "engine")
    assert loaded.insert(9.0, 9.0) == count
    loaded.insert(0.0, 5.0)
    loaded.check()


def test_ids_and_multiplicities_go_on_after_removals(tmp_path):
    engine = fk.Engine()
    ids = engine.insert(np.random.default_rng(0).random((2000, 2)))
    engine.insert(engine.points()[:10])
    engine.remove(ids[500:])
    loaded = survives(engine, tmp_path / "engine")
    assert loaded.insert(2.0, 2.0) == engine.insert(2.0, 2.0) == 2000
    with pytest.raises(KeyError, match="500"):
        loaded.remove(500)
    loaded.remove(ids[:10])
    assert len(loaded) == 501
    loaded.clear()
    assert survives(loaded, tmp_path / "engine").insert(0.0, 0.0) == 2001


def test_the_file_is_replaced_whole(tmp_path):
    path = tmp_path / "engine"
    engine = fk.Engine()
    engine.insert([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)])
    engine.save(path)
    engine.insert(1.0, 1.0)
    survives(engine, path)
    assert list(tmp_path.iterdir()) == [path]
    with pytest.raises(OSError, match="nowhere"):
        engine.save(tmp_path / "nowhere" / "engine")
    with pytest.raises(FileNotFoundError):
        fk.load(tmp_path / "nothing")


def test_what_is_cut_short_or_altered_is_refused(tmp_path):
    path = tmp_path / "engine"
    engine = fk.Engine()
    engine.insert(np.random.default_rng(1).random((20, 2)))
    engine.save(path)
    whole = path.read_bytes()
    for length in [0, 1, 20, 21, 25, 29, 40, len(whole) // 2, len(whole) - 1]:
        path.write_bytes(whole[:length])
        with pytest.raises(fk.InputError, match=r"engine: got .*, expected"):
            fk.load(path)
    path.write_bytes(whole + b"\0")
    with pytest.raises(fk.InputError, match=r"got \d+ bytes, expected \d+"):
        fk.load(path)
    rng = np.random.default_rng(2)
    for at in [0, 10, 25, 29, *rng.integers(30, len(whole), 200)]:
        altered = bytearray(whole)
        altered[at] ^= 1 << int(rng.integers(8))
        path.write_bytes(altered)
        with pytest.raises(fk.InputError, match=r"engine: got .*, expected"):
            fk.load(path)
    path.write_bytes(whole)
    assert fk.load(path).digest() == engine.digest()


def test_bytes_that_end_too_early_are_refused():
    engine = fk.Engine()
    engine.insert(np.random.default_rng(1).random((20, 2)))
    dumped = engine.dump()
    for length in (0, 7, 8, 100, len(dumped) - 1):
        with pytest.raises(ValueError, match="end too early"):
            fk.Engine.restored(dumped[:length])
    with pytest.raises(ValueError, match="more bytes"):
        fk.Engine.restored(np.append(dumped, np.uint8(0)))
    with pytest.raises(ValueError, match="another build"):
        fk.Engine.restored(np.append(~dumped[:1], dumped[1:]))
