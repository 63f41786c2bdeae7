"""The notebook of the tutorial runs from its first cell to its last."""

from __future__ import annotations

from pathlib import Path

import pytest

NOTEBOOK = Path(__file__).parents[2] / "docs" / "tutorial" / "buck.ipynb"


@pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::ResourceWarning")
def test_the_notebook_runs() -> None:
    """Executed by a kernel of its own, as a user's notebook is; no output is stored in the file."""
    import nbformat
    from nbconvert.preprocessors import ExecutePreprocessor

    notebook = nbformat.read(NOTEBOOK, as_version=4)
    assert not any(cell.get("outputs") for cell in notebook.cells)
    ExecutePreprocessor(timeout=120).preprocess(
        notebook, {"metadata": {"path": str(NOTEBOOK.parent)}}
    )
    texts = [o.get("text", "") for c in notebook.cells for o in c.get("outputs", [])]
    assert any("certificate holds" in text for text in texts)
    shown = [o["data"] for c in notebook.cells for o in c.get("outputs", []) if "data" in o]
    assert any("certificate holds" in data.get("text/html", "") for data in shown)
    assert any("image/png" in data for data in shown)
    # (1 - D) Vfwd = 0.35 V between the ideal diode and that with a drop of 0.7 V
    ideal, real = (float(line.split()[-1]) for line in texts[-1].splitlines())
    assert ideal - real == pytest.approx(0.35, abs=0.01)
