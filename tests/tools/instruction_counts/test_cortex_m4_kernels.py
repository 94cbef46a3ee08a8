"""The kernels as the STM32 runs them: equal to the desktop build to the last bit, and within their budget."""

import numpy as np
import pytest

import airtouch.kernels as kernels
from airtouch.detector import best
from airtouch.kernels.arrays import pointer
from airtouch.kernels.edge_pipeline import config_struct, pipeline_ram_bytes
from airtouch.kernels.library import ffi, lib
from airtouch.reference import EdgePipelineConfig
from airtouch.vehicle import load

pytest.importorskip("unicorn", reason="pip install unicorn")
pytest.importorskip("ziglang", reason="pip install ziglang")

from tools.instruction_counts import budget
from tools.instruction_counts.build import compilers
from tools.instruction_counts.count import WHOLE, clean_flights, flight_samples, kernel_inputs, measure
from tools.instruction_counts.flight_code import EVENT, KERNELS, FlightCode, compile_flight_code, made_flight

VEHICLE = load("crazyflie-2.1-flow")
GOAL_MEAN, GOAL_WORST = 6000, 8000  #: of the nine-channel step: 0.5 % of the STM32F405 at 100 Hz
STEP_LIMIT = budget.load("cortex-m4")


@pytest.fixture(scope="module")
def code():
    return FlightCode(compile_flight_code("cortex-m4", compiler="zig"), VEHICLE)


@pytest.fixture(scope="module", params=[("zig", "-Os"), ("gcc", "-O2"), ("gcc", "-Os")], ids=" ".join)
def other_code(request):
    """The other builds that fly: as the Crazyflie's firmware is compiled, and by its compiler where that is here."""
    compiler, optimise = request.param
    if compiler not in compilers("cortex-m4"):
        pytest.skip(f"no {compiler} for cortex-m4 on this machine")
    return FlightCode(compile_flight_code("cortex-m4", optimise=optimise, compiler=compiler), VEHICLE)


@pytest.fixture(scope="module")
def recorded(flights):
    """Seven of the clean flights, from the first to the last."""
    return [flight_samples(path) for path in clean_flights(flights / "airtouch")[::14]]


def desktop_pipeline(flight):
    """(n,) of edgeEvent_t by the desktop's build of the same sources."""
    events = np.zeros(len(flight), dtype=EVENT)
    state = ffi.new("double[]", pipeline_ram_bytes() // 8 + 1)
    assert lib.edgePipelineBatch(config_struct(EdgePipelineConfig(), VEHICLE), pointer(flight, "edgeSample_t *"),
                                 len(flight), state, pointer(events, "edgeEvent_t *")) == 0
    return events


def assert_same_bits(ours, truth):
    """Equal to the last bit; a NaN is a NaN."""
    for name in truth.dtype.names:
        a, b = ours[name], truth[name]
        if a.dtype.kind == "f":
            number = ~(np.isnan(a) & np.isnan(b))
            a, b = a.view(np.uint32)[number], b.view(np.uint32)[number]
        np.testing.assert_array_equal(a, b, err_msg=name)


def assert_same_stream(steps, flight):
    model = best.load(None)
    truth = kernels.stream_detector(flight["acc"], flight["gyro"], flight["pwm"], model.int8, model.recipe.motion,
                                    model.decoder)
    for name in ("logits", "ready", "edge", "airborne"):
        np.testing.assert_array_equal(steps.output[name], getattr(truth, name), err_msg=name)


def test_pipeline_equals_the_desktop(code):
    for seed in range(3):
        flight = made_flight(900, seed)
        assert_same_bits(code.fly("edge_pipeline", flight).output, desktop_pipeline(flight))


def test_stream_detector_equals_the_desktop(code):
    flight = made_flight(700)
    assert_same_stream(code.fly("stream_detector", flight), flight)


def test_other_builds_equal_the_desktop(other_code):
    flight = made_flight(500, 7)
    steps = other_code.fly("edge_pipeline", flight)
    assert_same_bits(steps.output, desktop_pipeline(flight))
    assert steps.instructions[steps.ready].mean() <= GOAL_MEAN and steps.instructions.max() <= GOAL_WORST
    flight = flight[:200]
    assert_same_stream(other_code.fly("stream_detector", flight), flight)


def test_recorded_flights_equal_the_desktop_and_keep_the_budget(code, recorded):
    """Both detectors over whole flights; printed with -s."""
    counts = {name: [] for name in WHOLE}
    edges = 0
    for flight in recorded:
        steps = code.fly("edge_pipeline", flight)
        assert_same_bits(steps.output, desktop_pipeline(flight))
        counts["edge_pipeline"].append(steps)
    for flight in recorded[::3]:
        steps = code.fly("stream_detector", flight)
        assert_same_stream(steps, flight)
        counts["stream_detector"].append(steps)
        edges += np.count_nonzero(steps.output["edge"])
    assert edges > 0
    for name, flights in counts.items():
        mean = np.concatenate([s.instructions[s.ready] for s in flights]).mean()
        worst = max(s.instructions.max() for s in flights)
        print(f"\n{name}, {len(flights)} flights: mean {mean:,.0f} instructions a step with an output, worst {worst:,}")
        assert mean <= STEP_LIMIT[name].instructions_mean and worst <= STEP_LIMIT[name].instructions_worst


def test_every_kernel_keeps_its_budget(code):
    over = [line for name, cost in measure(code).items() for line in budget.excess(name, cost, STEP_LIMIT[name])]
    assert not over, "\n".join(over)
    assert set(STEP_LIMIT) == set(KERNELS)


def test_the_budget_is_within_the_goals():
    step = STEP_LIMIT["edge_pipeline"]
    assert step.instructions_mean <= GOAL_MEAN and step.instructions_worst <= GOAL_WORST
    assert step.ram_bytes < 12_000


def test_a_budget_that_is_exceeded_is_named(code):
    cost = code.cost("fr_cfar", code.fly("fr_cfar", kernel_inputs(code, made_flight(300))["fr_cfar"]))
    limit = budget.Cost(cost.instructions_mean, cost.instructions_worst - 1, cost.flash_bytes, cost.ram_bytes, 0)
    lines = budget.excess("fr_cfar", cost, limit)
    assert [line.split(":")[1].split(" is ")[0].strip() for line in lines] == ["instructions_worst", "stack_bytes"]
