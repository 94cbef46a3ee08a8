"""Signs of the motors in the twin's channels."""

import numpy as np
import pytest

from airtouch.simulation.firmware import mixer
from airtouch.twin.recorded.channels import ROTOR_SIGNS


@pytest.mark.parametrize("name", ROTOR_SIGNS)
def test_the_signs_are_those_of_the_firmwares_mixer(name):
    command = {"roll": 0.0, "pitch": 0.0, "yaw": 0.0, name: 100.0}
    motors = np.zeros(4)
    mixer.mix(0.0, command["roll"], command["pitch"], command["yaw"], motors)
    np.testing.assert_array_equal(np.sign(motors), ROTOR_SIGNS[name])
