"""The notebooks of host/docs/notebooks run from first cell to last, and print what their text promises.

One runs in a kernel of its own, as a reader's do; cells of the others are run here, as another kernel has all to import
again.
"""

import contextlib
import io
import re
from pathlib import Path

import pytest

from airtouch.simulation import effects

nbformat = pytest.importorskip("nbformat", reason="could not import nbformat: pip install 'airtouch[test]'")
nbclient = pytest.importorskip("nbclient", reason="could not import nbclient: pip install 'airtouch[test]'")
pytest.importorskip("ipykernel", reason="could not import ipykernel: pip install 'airtouch[test]'")

FOLDER = Path(__file__).resolve().parents[1] / "host" / "docs" / "notebooks"
NAMES = ("first-flight", "own-detector", "diagnose-a-gap", "add-an-effect")


def book_of(name):
    """A notebook of that name, which is a valid one."""
    book = nbformat.read(FOLDER / f"{name}.ipynb", as_version=4)
    nbformat.validate(book)
    return book


def printed(name):
    """What the cells of a notebook print, run one after another in one namespace."""
    output, names = io.StringIO(), {"__name__": "__main__"}
    with contextlib.redirect_stdout(output):
        for cell in book_of(name).cells:
            if cell.cell_type == "code":
                exec(cell.source, names)
    return output.getvalue()


def printed_in_a_kernel(name, tmp_path):
    """What the cells of a notebook print, executed in a kernel of this Python."""
    book = book_of(name)
    resources = {"metadata": {"path": str(tmp_path)}}
    nbclient.NotebookClient(book, timeout=600, kernel_name="python3", resources=resources).execute()
    return "".join(out.get("text", "") for cell in book.cells if cell.cell_type == "code" for out in cell.outputs)


def test_every_notebook_is_run_and_stored_without_outputs():
    assert {path.stem for path in FOLDER.glob("*.ipynb")} == set(NAMES)
    for name in NAMES:
        cells = nbformat.read(FOLDER / f"{name}.ipynb", as_version=4).cells
        assert all(not cell.outputs and cell.execution_count is None for cell in cells if cell.cell_type == "code")


def test_the_first_flight_is_felt(tmp_path):
    output = printed_in_a_kernel("first-flight", tmp_path)
    assert "entry declared" in output and "exit  declared" in output
    missed, edges = map(int, re.search(r"missed (\d+) of (\d+)", output).groups())
    assert edges == 6 and missed <= 1


def test_a_detector_of_ones_own_is_scored_beside_the_others():
    rows = dict(re.findall(r"^(.+?) *: missed (\d+) of 12", printed("own-detector"), re.M))
    assert set(rows) == {"roll power", "best", "baseline"}
    assert int(rows["best"]) <= 3 and int(rows["roll power"]) <= 9


def test_the_gap_is_diagnosed():
    from airtouch.gap import example

    output = printed("diagnose-a-gap")
    assert "times the floor" in output
    assert f"\neffect\n{next(iter(example.answer()))} " in output


def test_an_effect_is_added_and_its_typo_told():
    try:
        output = printed("add-an-effect")
    finally:
        effects.unregister("gyro_scale_error")
    without_effect, with_effect = map(float, re.search(r"([\d.]+) without, ([\d.]+) with", output).groups())
    assert without_effect == pytest.approx(1.0, abs=0.12) and with_effect == pytest.approx(1.4, abs=0.15)
    assert "no plant field 'giro_scale'; did you mean gyro_scale" in output
