"""Errors of nsspice between processes: exceptions are pickled by their texts alone otherwise."""

import copy
import multiprocessing
import pickle

import pytest

import nsspice

DECKS = {
    "NS1001": "a card that does not exist\nR1 a 0 1k\n.trann\n",
    "NS2021": "two sources in parallel\nV1 a 0 5\nV2 a 0 6\n.op\n",
    "NS3001": "a diode across a source\nV1 a 0 5\nD1 a 0\n.op\n",
}


def simulate(deck: str) -> None:
    nsspice.read(deck).run()


@pytest.mark.parametrize(("code", "deck"), DECKS.items(), ids=DECKS)
def test_an_error_is_the_same_behind_a_pipe(code: str, deck: str) -> None:
    with pytest.raises(nsspice.NsspiceError) as caught:
        simulate(deck)
    error = caught.value
    for other in (pickle.loads(pickle.dumps(error)), copy.copy(error)):
        assert type(other) is type(error)
        assert (other.code, str(other), other.exit_code) == (code, str(error), error.exit_code)
        assert other.diagnostics == error.diagnostics
        assert getattr(other, "elements", None) == getattr(error, "elements", None)


def test_a_pool_tells_what_failed_in_it() -> None:
    """It hung, or said that a text has no findings."""
    with (
        multiprocessing.get_context("spawn").Pool(1) as pool,
        pytest.raises(nsspice.InfeasibleError) as caught,
    ):
        pool.apply_async(simulate, (DECKS["NS3001"],)).get(timeout=60)
    assert caught.value.elements == ["v1", "d1"]
