"""Work that is handed out to threads."""

import multiprocessing
import threading

import pytest

from meshwright.audit.parallel import in_parallel, limited_to, workers


def test_results_come_in_the_order_of_the_items():
    with limited_to(3):
        assert list(in_parallel(lambda i: i * i, range(50))) == [i * i for i in range(50)]


def test_work_inside_of_work_ends():
    """Threads that wait for work of their own kind would wait for ever."""
    with limited_to(2):
        outer = in_parallel(lambda i: sum(in_parallel(lambda j: i * j, range(10))), range(20))
        assert sum(outer) == sum(range(20)) * sum(range(10))


def test_the_first_error_is_raised_and_nothing_goes_on_behind_it():
    running, done = threading.Event(), []

    def work(i):
        if i == 0:
            running.wait(10)
            raise ValueError("first")
        running.set()
        done.append(i)
        return i

    with limited_to(2), pytest.raises(ValueError, match="first"):
        list(in_parallel(work, range(100)))
    before = len(done)
    assert before < 100
    with limited_to(2):
        assert list(in_parallel(abs, range(4))) == [0, 1, 2, 3]
    assert len(done) == before


def test_the_limit_holds_in_the_threads():
    with limited_to(2):
        assert set(in_parallel(lambda _: workers(), range(8))) == {2}


def _sum_of_squares(queue):
    with limited_to(2):
        queue.put(sum(in_parallel(lambda i: i * i, range(10))))


@pytest.mark.skipif("fork" not in multiprocessing.get_all_start_methods(), reason="no fork on this system")
def test_a_forked_process_has_threads_of_its_own():
    with limited_to(2):
        list(in_parallel(abs, range(4)))
    context = multiprocessing.get_context("fork")
    queue = context.Queue()
    child = context.Process(target=_sum_of_squares, args=(queue,))
    child.start()
    assert queue.get(timeout=30) == 285
    child.join(30)
