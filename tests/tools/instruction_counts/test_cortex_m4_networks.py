"""The int8 kernels with a Cortex-M4's own instructions give the golden vectors' bits, windowed network included."""

import numpy as np
import pytest

pytest.importorskip("unicorn", reason="pip install unicorn")
pytest.importorskip("ziglang", reason="pip install ziglang")

from tools.instruction_counts.build import build, compilers
from tools.instruction_counts.flight_code import FIRMWARE, GAP8, MODEL
from tools.instruction_counts.machine import Machine

KERNELS = [GAP8 / f"{name}.c" for name in ("network_int8", "conv_int8", "dense_int8", "max_pool_int8",
                                           "sparse_dense_int8")]


@pytest.mark.parametrize("compiler, optimise", [("zig", "-O2"), ("gcc", "-Os")])
def test_golden_windows_have_their_golden_outputs(compiler, optimise):
    if compiler not in compilers("cortex-m4"):
        pytest.skip(f"no {compiler} for cortex-m4 on this machine")
    program = build([*KERNELS, MODEL / "airtouch_model.c", MODEL / "airtouch_golden.c"], "cortex-m4",
                    include=[GAP8, MODEL, FIRMWARE], optimise=optimise, compiler=compiler)
    machine = Machine(program.elf)
    sizes = {name: machine.elf.symbols[name].size for name in ("airtouchGoldenInputs", "airtouchGoldenOutputs")}
    expected = np.frombuffer(machine.read("airtouchGoldenOutputs", sizes["airtouchGoldenOutputs"]), np.int8)
    network, inputs = machine.address("airtouchNetwork"), machine.address("airtouchGoldenInputs")
    arena = machine.allocate(machine.call("networkInt8ArenaBytes", network).value)
    source = machine.allocate(300)
    outputs, counts = [], []
    for start in range(inputs, inputs + sizes["airtouchGoldenInputs"], 300):
        machine.write(source, machine.read(start, 300))
        inference = machine.call("networkInt8Run", network, source, arena)
        outputs.append(np.frombuffer(machine.read(inference.value, 2), np.int8))
        counts.append(inference.instructions)
    np.testing.assert_array_equal(np.concatenate(outputs), expected)
    print(f"\nthe paper's network on a Cortex-M4, {compiler} {optimise}: {max(counts):,} instructions a window")
