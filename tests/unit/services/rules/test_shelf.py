"""Packs that change while a service runs."""

import shutil
from collections.abc import Callable, Mapping
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from proto.rules import Situation
from services.rules.book import load_beside, load_book
from services.rules.limits.limit_answer import applicable_limit
from services.rules.packs.loading import Pack
from services.rules.packs.signature import Trust
from services.rules.shelf import Change, Shelf
from tests.unit.services.rules.editing import adopted, edit, rehash, set_limit

TOWN = Situation(jurisdiction="ZZZ", road_type="urban", wet=False, snow=False, visibility_m=300.0, time_of_day_h=12.0)


@pytest.fixture
def pack(tmp_path: Path) -> Path:
    adopted(tmp_path / "A-v1")
    return tmp_path / "A-v1"


def limit(shelf: Shelf) -> float:
    answer = applicable_limit(shelf.edition.book, TOWN)
    assert answer.limit is not None
    return answer.limit.value


def looked(shelf: Shelf) -> Change | None:
    """A change is taken up at the second look, when the writer has paused."""
    assert shelf.look() is None
    return shelf.look()


def test_a_sound_change_is_taken_into_use_as_a_whole(pack: Path) -> None:
    shelf = Shelf((pack,))
    before = shelf.edition
    set_limit(pack, "zzz-speed-town", 40)
    change = looked(shelf)
    assert change is not None
    ((old, new),) = change.versions
    assert (old, new) == (before.book.packs["A-v1"].version, shelf.edition.book.packs["A-v1"].version)
    assert limit(shelf) == 40
    kept = applicable_limit(before.book, TOWN).limit
    assert kept is not None
    assert kept.value == 50  # an answer in flight keeps its book
    assert shelf.look() is None


def test_nothing_is_read_where_nothing_changed(pack: Path) -> None:
    read = list[Path]()

    def load(folder: Path, others: Mapping[Path, Pack], trust: Trust | None) -> Pack:
        read.append(folder)
        return load_beside(folder, others, trust)

    shelf = Shelf((pack,), load=load)
    assert [shelf.look() for _ in range(3)] == [None, None, None]
    assert read == [pack]


def test_caches_are_of_one_edition(pack: Path) -> None:
    shelf = Shelf((pack,))
    shelf.edition.answers.put(TOWN, applicable_limit(shelf.edition.book, TOWN))
    set_limit(pack, "zzz-speed-town", 40)
    looked(shelf)
    assert shelf.edition.answers.get(TOWN) is None


@pytest.mark.parametrize(
    "breaking",
    [
        lambda folder: set_limit(folder, "zzz-speed-town", 90, sealed=False),
        lambda folder: (folder / "signs.json").write_text("{nonsense", encoding="utf-8"),
        lambda folder: (folder / "manifest.json").unlink(),
        shutil.rmtree,
    ],
)
def test_a_broken_version_is_refused_and_the_old_one_stays(breaking: Callable[[Path], object], pack: Path) -> None:
    shelf = Shelf((pack,))
    breaking(pack)
    change = looked(shelf)
    assert change is not None
    assert change.versions == ()
    assert len(change.refused) == 1
    assert str(pack) in change.refused[0]
    assert limit(shelf) == 50
    assert shelf.refused == change.refused
    assert shelf.look() is None  # told once


def test_a_mended_version_is_taken_up(pack: Path) -> None:
    shelf = Shelf((pack,))
    set_limit(pack, "zzz-speed-town", 40, sealed=False)
    looked(shelf)
    rehash(pack)
    change = looked(shelf)
    assert change is not None
    assert change.refused == shelf.refused == ()
    assert limit(shelf) == 40


def test_a_pack_that_was_not_there_at_the_start_is_taken_up_when_it_comes(tmp_path: Path) -> None:
    shelf = Shelf((tmp_path / "A-v1",))
    assert len(shelf.refused) == 1
    adopted(tmp_path / "A-v1")
    change = looked(shelf)
    assert change is not None
    assert change.versions[0][0] == ""
    assert limit(shelf) == 50


def test_a_changed_parent_changes_the_pack_that_extends_it(pack: Path, tmp_path: Path) -> None:
    adopted(tmp_path / "B-v1", extends="A-v1")
    shelf = Shelf((tmp_path / "B-v1",))
    set_limit(pack, "zzz-speed-town", 40)
    assert looked(shelf) is not None
    assert limit(shelf) == 40


def test_a_file_that_is_still_being_written_is_waited_for(pack: Path) -> None:
    shelf = Shelf((pack,))
    path = pack / "sources" / "law.en.md"
    for turn in range(3):
        path.write_text(path.read_text(encoding="utf-8") + "\n" * (turn + 1), encoding="utf-8")
        assert shelf.look() is None


@settings(max_examples=25, deadline=None)
@given(st.lists(st.tuples(st.sampled_from([30, 40, 60]), st.booleans()), min_size=1, max_size=4))
def test_whatever_is_written_only_what_was_sealed_is_ever_answered(steps: list[tuple[int, bool]]) -> None:
    from tempfile import TemporaryDirectory

    with TemporaryDirectory() as name:
        folder = Path(name) / "A-v1"
        adopted(folder)
        shelf, expected = Shelf((folder,)), 50.0
        for value, sealed in steps:
            set_limit(folder, "zzz-speed-town", value, sealed=sealed)
            shelf.look()
            shelf.look()
            if sealed:
                expected = value
            assert limit(shelf) == expected or (not sealed and value == expected)


def test_the_manifest_may_name_another_parent_later(pack: Path, tmp_path: Path) -> None:
    adopted(tmp_path / "B-v1", extends="A-v1")
    adopted(tmp_path / "C-v1")
    shelf = Shelf((tmp_path / "B-v1",))
    edit(tmp_path / "B-v1" / "manifest.json", lambda m: m["extends"].update(id="C-v1"))
    rehash(tmp_path / "B-v1")
    assert looked(shelf) is not None
    set_limit(tmp_path / "C-v1", "zzz-speed-town", 35)
    assert looked(shelf) is not None
    assert limit(shelf) == 35


def test_a_second_pack_of_the_same_id_is_refused_by_name_and_the_first_answers(pack: Path, tmp_path: Path) -> None:
    other = Path(shutil.copytree(pack, tmp_path / "copy"))
    set_limit(other, "zzz-speed-town", 120)
    shelf = Shelf((pack, other))
    (why,) = shelf.refused
    assert (str(other) in why, str(pack) in why, "A-v1" in why) == (True, True, True)
    assert limit(shelf) == 50
    book, refused = load_book((pack, other))
    assert refused == shelf.refused
    assert book.packs == shelf.edition.book.packs


def test_a_pack_that_takes_the_id_of_another_is_refused_and_both_stay_as_they_were(pack: Path, tmp_path: Path) -> None:
    adopted(tmp_path / "B-v1", "YYY")
    shelf = Shelf((pack, tmp_path / "B-v1"))
    before = shelf.edition
    edit(tmp_path / "B-v1" / "manifest.json", lambda m: m.update(id="A-v1"))
    rehash(tmp_path / "B-v1")
    change = looked(shelf)
    assert change is not None
    assert change.versions == ()
    assert "A-v1" in change.refused[0]
    assert shelf.edition is before


def test_the_same_folder_named_twice_is_one_pack(pack: Path) -> None:
    assert Shelf((pack, pack)).refused == ()
