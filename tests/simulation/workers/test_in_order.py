"""Work sent out ahead comes back in order, no more than was asked is out, and what waits is cancelled."""

from concurrent.futures import Future, ThreadPoolExecutor

import pytest

from airtouch.simulation.workers.in_order import in_order


def test_results_come_in_the_order_of_the_items():
    with ThreadPoolExecutor(4) as pool:
        assert list(in_order(lambda i: pool.submit(pow, i, 2), range(50), 7)) == [i * i for i in range(50)]
        assert list(in_order(lambda i: pool.submit(pow, i, 2), [], 3)) == []


def test_no_more_is_out_than_asked():
    out, most, results = [], [], []

    def submit(item):
        future = Future()
        future.set_result(item)
        out.append(item)
        most.append(len(out) - len(results))
        return future

    for result in in_order(submit, iter(range(20)), 4):
        results.append(result)
    assert results == list(range(20)) and max(most) <= 5 and out[:4] == [0, 1, 2, 3]


def test_what_waits_is_cancelled_when_one_fails_or_the_caller_stops():
    futures = [Future() for _ in range(6)]
    futures[0].set_result("first")
    futures[1].set_exception(ValueError("second"))
    results = in_order(lambda i: futures[i], range(6), 3)
    assert next(results) == "first"
    with pytest.raises(ValueError, match="second"):
        next(results)
    assert [f.cancelled() for f in futures] == [False, False, True, True, False, False]
    futures = [Future() for _ in range(3)]
    futures[0].set_result(1)
    unfinished = in_order(lambda i: futures[i], range(3), 3)
    next(unfinished)
    unfinished.close()
    assert futures[1].cancelled() and futures[2].cancelled()
