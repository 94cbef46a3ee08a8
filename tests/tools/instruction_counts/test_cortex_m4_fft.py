"""The nine-channel step is at least twenty times cheaper than nine FFTs by CMSIS-DSP, where its sources were
fetched."""

import numpy as np
import pytest

pytest.importorskip("unicorn", reason="pip install unicorn")
pytest.importorskip("ziglang", reason="pip install ziglang")

from tools.instruction_counts.build import CACHE
from tools.instruction_counts.compare_fft import CHANNELS, VERSION, fft_instructions
from tools.instruction_counts.flight_code import FlightCode, compile_flight_code, made_flight

SOURCE = CACHE / f"cmsisdsp-{VERSION}"


@pytest.mark.skipif(not SOURCE.is_dir(),
                    reason="no CMSIS-DSP: python -m tools.instruction_counts.compare_fft fetches it")
def test_twenty_times_cheaper_than_nine_ffts():
    steps = FlightCode(compile_flight_code(compiler="zig")).fly("edge_pipeline", made_flight(400))
    step = np.mean(steps.instructions[steps.ready])
    ratio = CHANNELS * fft_instructions(SOURCE, "zig", "-O2") / step
    print(f"\nnine 256-point FFTs take {ratio:.1f} times the step's {step:,.0f} instructions")
    assert ratio >= 20.0
