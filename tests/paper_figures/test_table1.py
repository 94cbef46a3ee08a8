"""Power by stage out of a meter's log whose levels are known."""

import pytest

from airtouch.paper_figures.claims import REPRODUCED, UNTESTABLE
from airtouch.paper_figures.figure import Job
from airtouch.paper_figures.figures import table1


def test_a_log_of_a_meter_is_judged_by_its_total(tmp_path):
    path = tmp_path / "run.csv"
    levels = {"baseline": 78.0, "FC-FE": 80.0, "CCS-FF": 81.0, "filter": 82.0, "network": 90.0}
    lines, t = ["time_ms,bus_V,current_mA,stage"], 0.0
    for stage, mw in levels.items():
        for _ in range(400):
            lines.append(f"{t:.1f},3.8,{mw / 3.8:.4f},{stage}")
            t += 10.0
    path.write_text("\n".join(lines) + "\n")
    table = table1.power(Job(None, tmp_path, power_log=path))
    assert [r["mw"] for r in table.rows] == pytest.approx([78.0, 2.0, 1.0, 1.0, 8.0], abs=0.05)
    assert table.verdicts["power"].verdict == REPRODUCED and "90.0 mW" in table.verdicts["power"].evidence
    assert table1.power(Job(None, tmp_path)).verdicts["power"].verdict == UNTESTABLE
