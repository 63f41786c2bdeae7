"""Put the helpers of the tests (``oracle``, ``decks``) on the import path."""

from __future__ import annotations

import signal
import sys
from pathlib import Path

import pytest

TESTS = Path(__file__).parent
#: folders whose tests judge points and certificates themselves; in others a failed one raises
OWN_JUDGEMENT = {
    "convergence",
    "property",
    "regression/analyses",
    "regression/converters",
    "regression/floating",
    "regression/impulses",
    "regression/junctions",
    "regression/switching",
    "regression/thresholds",
    "regression/transformers",
}
sys.path.insert(0, str(TESTS))

# what a shell without job control starts in the background ignores Ctrl-C, and so do its children;
# the tests that press it mean a process that does not
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(autouse=True)
def _runs_return(request: pytest.FixtureRequest) -> None:
    if request.path.parent.relative_to(TESTS).as_posix() in OWN_JUDGEMENT:
        request.getfixturevalue("runs_return")


@pytest.fixture
def runs_return(monkeypatch: pytest.MonkeyPatch) -> None:
    """Runs return whatever their certificate says: a test judges points or certificate itself."""
    from nsspice.analyses.static import statics
    from nsspice.analyses.steady import steady_state
    from nsspice.analyses.studies import batch
    from nsspice.analyses.transient import transient

    for module in (batch, statics, steady_state, transient):
        monkeypatch.setattr(module, "judge", lambda solutions, on_failure: None)
