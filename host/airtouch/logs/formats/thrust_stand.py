"""Thrust-stand runs (IMRCLab's and Bitcraze's CSVs): thrust, PWM, voltage, rpm."""

from pathlib import Path

import numpy as np

from airtouch.errors import AirTouchError
from airtouch.logs.files import load_text
from airtouch.logs.table import named_table, names_of, sheet

#: header -> column of the table; the weight is in grams in every known file
STAND_COLUMNS = {
    "weight[g]": "weight_g", "weight": "weight_g", "pwm": "pwm", "vbat[V]": "vbat_V",
    "rpm1": "rpm_1", "rpm2": "rpm_2", "rpm3": "rpm_3", "rpm4": "rpm_4",
    "v[V]": "voltage_V", "i[A]": "current_A", "p[W]": "power_W",
}


def read_thrust_stand(path: str | Path) -> dict[str, np.ndarray]:
    """The columns of a thrust-stand run, (n,) each: `weight_g`, `pwm`, `vbat_V`, `rpm_1` to `rpm_4`, ...

    Columns that the file lacks are absent. Of a truncated file the complete rows are read, without a warning. Raises
    AirTouchError for an unknown header and for rows that are not numbers.
    """
    source = str(path)
    text = sheet(load_text(path, []))
    if not {"pwm", "vbat[V]", "rpm1"} <= set(names_of(text.first)):
        raise AirTouchError(f"{source}:{text.line}: not the header of a thrust-stand run; "
                            "name the columns pwm, vbat[V], rpm1, ...")
    table = named_table(text, source, [])
    return {STAND_COLUMNS[name]: values for name, values in table.items() if name in STAND_COLUMNS}
