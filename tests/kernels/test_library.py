"""What a user sees when the shared library is not there, and how the bindings answer wrong shapes."""

import subprocess
import sys

import numpy as np
import pytest

import airtouch.kernels as kernels
import airtouch.reference as reference
from airtouch.errors import AirTouchError
from airtouch.kernels.library import lib
from airtouch.vehicle import load


def test_a_missing_library_is_one_line_with_its_remedy():
    code = ("import importlib.util as u; real = u.find_spec\n"
            "u.find_spec = lambda name, *a: None if name.endswith('_kernels') else real(name, *a)\n"
            "from airtouch.errors import AirTouchError\n"
            "try:\n    import airtouch.kernels\nexcept AirTouchError as error:\n    print(error)\n")
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert "make setup" in out and len(out.splitlines()) == 1


def test_a_function_that_an_older_build_lacks_is_one_line_with_its_remedy():
    with pytest.raises(AirTouchError, match="the built C kernels have no bandPowerTwice: run `make setup`"):
        lib.bandPowerTwice(1)
    assert lib.edgePipelineSize() == lib.edgePipelineSize() > 1000


def test_names_mirror_the_reference():
    names = {"band_power", "cascaded_cross_spectrum", "disturbance_force", "edge_pipeline", "force_norm", "fr_cfar",
             "streaming_z_score", "threshold_factor", "total_thrust", "z_score_window"}
    assert names <= set(kernels.__all__) and names <= set(reference.__all__)


def test_the_threshold_factor_is_the_references():
    for p_fa in (1e-6, 1e-2, 0.9, 0.999999):
        assert kernels.threshold_factor(50, p_fa) == pytest.approx(reference.threshold_factor(50, np.float32(p_fa)),
                                                                   rel=1e-6)


VEHICLE = load("crazyflie-2.1-flow")
WRONG = {
    "band_power": [(np.zeros((2, 2, 2)),)],
    "cascaded_cross_spectrum": [(np.ones((4, 8)),), (np.ones(9),)],
    "disturbance_force": [(np.zeros((4, 3)), np.zeros((3, 4)), VEHICLE)],
    "force_norm": [(np.zeros((4, 2)),)],
    "total_thrust": [(np.zeros((4, 2)), VEHICLE)],
    "fr_cfar": [(np.zeros((4, 2)),)],
    "z_score_window": [(np.zeros(4),), (np.zeros((0, 3)),)],
    "streaming_z_score": [(np.zeros(4), 5.0), (np.zeros((4, 1)), -1.0)],
    "edge_pipeline": [(np.zeros((4, 3)), np.zeros((5, 3)), np.zeros((4, 4)), VEHICLE)],
    "edge_decoder": [(np.zeros((5, 3)), np.ones(4, bool)), (np.zeros((5, 2)), np.ones(5, bool)),
                     (np.zeros(5), np.ones(5, bool))],
}


@pytest.mark.parametrize("module", [kernels, reference], ids=["kernels", "reference"])
@pytest.mark.parametrize("name", WRONG)
def test_wrong_shapes_are_one_line_in_both(module, name):
    for arguments in WRONG[name]:
        with pytest.raises(AirTouchError) as error:
            getattr(module, name)(*arguments)
        assert "\n" not in str(error.value)


@pytest.mark.parametrize("module", [kernels, reference], ids=["kernels", "reference"])
@pytest.mark.parametrize("of_samples", [{"vbat_v": np.full(4, 3.9)}, {"thrust_axis": np.zeros((4, 3))},
                                        {"probability": np.zeros(4)}], ids=str)
def test_a_signal_that_is_not_of_these_samples_is_one_line_in_both(module, of_samples):
    with pytest.raises(AirTouchError, match=r"must be \(5, ?3?\), or one for all samples, not \(4, ?3?\)"):
        module.edge_pipeline(np.zeros((5, 3)), np.zeros((5, 3)), np.zeros((5, 4)), VEHICLE, **of_samples)


@pytest.mark.parametrize("x", [np.zeros((400, 1)), np.zeros(400), np.zeros((400, 10))], ids=lambda x: str(x.shape))
def test_a_bank_takes_its_own_number_of_channels_only(x):
    with pytest.raises(AirTouchError, match=r"samples must be \(n, 9\)"):
        kernels.BandPowerBank(9, 100.0, 200, (6.0, 8.0), 1).push(x)


@pytest.mark.parametrize("cells", [256, 1000, 5000])
def test_a_long_window_leaves_the_memory_of_others_alone(cells):
    code = f"import airtouch.kernels as k; print([k.threshold_factor({cells}, 1e-6) for _ in range(20)][-1])"
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert float(out) == pytest.approx(reference.threshold_factor(cells, np.float32(1e-6)), rel=1e-5)


def test_pieces_of_a_stream_are_the_whole():
    x = np.random.default_rng(0).normal(size=(1000, 2)).astype(np.float32)
    bank = kernels.BandPowerBank(2, 100.0, 200, (6.0, 8.0), 7)
    pieces = np.concatenate([bank.push(part) for part in np.split(x, [1, 150, 199, 200, 777])])
    np.testing.assert_array_equal(pieces, kernels.band_power(x, hop=7))
