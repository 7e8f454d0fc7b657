"""A bounded memory."""

from services.rules.shelf import Cache


def test_the_least_recently_used_value_is_forgotten() -> None:
    cache: Cache[int] = Cache(2)
    cache.put("a", 1)
    cache.put("b", 2)
    assert cache.get("a") == 1
    cache.put("c", 3)
    assert (cache.get("a"), cache.get("b"), cache.get("c")) == (1, None, 3)
    assert len(cache) == 2
    assert (cache.hits, cache.misses) == (3, 1)
