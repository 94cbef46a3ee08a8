"""Everything that one flight's equations need, as one record that compiled code reads by name.

A vehicle gives the nominal values, effects change them. `firmware` holds the settings of the release that flies
(simulation.firmware.settings).
"""

import functools

import numpy as np
from numba import from_dtype

from airtouch.simulation.firmware import settings
from airtouch.vehicle import Vehicle

_F = np.float64
#: name, elements, value where the vehicle says nothing, meaning
FIELDS: tuple[tuple[str, int, float, str], ...] = (
    ("mass", 1, 0.0, "kg"),
    ("gravity", 1, 9.81, "m/s^2"),
    ("inertia", 3, 0.0, "kg m^2, principal"),
    ("com", 3, 0.0, "m, centre of mass from the geometric centre, body axes"),
    ("rotor_x", 4, 0.0, "m"),
    ("rotor_y", 4, 0.0, "m"),
    ("rotor_radius", 1, 0.0, "m"),
    ("rotor_spacing", 1, 0.0, "m, between neighbouring rotors"),
    ("thrust_per_speed2", 1, 0.0, "N per (rad/s)^2"),
    ("yaw_torque_over_thrust", 1, 0.0, "m"),
    ("rotor_inertia", 1, 0.0, "kg m^2, of rotor and propeller"),
    ("motor_rise", 1, 0.06, "s, first-order lag of a rotor speeding up"),
    ("motor_fall", 1, 0.06, "s, first-order lag of a rotor slowing down"),
    ("gain", 4, 1.0, "thrust of each rotor over nominal"),
    ("thrust_curve", 3, 0.0, "N, N/PWM, N/PWM^2 at the nominal voltage"),
    ("nominal_voltage", 1, 3.8, "V"),
    ("voltage_exponent", 1, 2.0,
     "thrust at a PWM over that at the nominal voltage, power of the voltage ratio"),
    ("motor_noise", 1, 0.0, "rms of thrust over its mean, each rotor on its own"),
    ("motor_noise_time", 1, 0.02, "s, correlation time of `motor_noise`"),
    ("motor_hiss", 1, 0.0, "rms over mean of a second, faster thrust noise, each rotor on its own"),
    ("motor_hiss_time", 1, 0.01, "s, correlation time of `motor_hiss`"),
    ("actuator_delay", 1, 0.0, "s, from command to motor"),
    ("motor_slowness", 4, 0.0, "s, lag of a rotor's command before it reaches the motor"),
    ("motor_dead_zone", 4, 0.0, "PWM; a motor keeps its command until the new one differs by more"),
    ("battery_strength", 1, 0.0, "0: always the nominal voltage, 1: the battery's own"),
    ("battery_charge", 1, 1.0, "fraction of the capacity at take-off"),
    ("battery_capacity", 1, 900.0, "C"),
    ("battery_resistance", 1, 0.12, "ohm"),
    ("battery_cells", 1, 1.0, "in series"),
    ("power_per_thrust15", 1, 85.0, "W per N^1.5 of each rotor"),
    ("acc_noise", 3, 0.06, "m/s^2 rms, as logged"),
    ("gyro_noise", 3, 0.006, "rad/s rms, as logged"),
    ("acc_bias", 3, 0.0, "m/s^2"),
    ("gyro_bias", 3, 0.0, "rad/s"),
    ("gyro_scale", 3, 1.0, "angular rate that the gyro shows over the true one"),
    ("acc_range", 1, 235.0, "m/s^2, saturation: 24 g"),
    ("gyro_range", 1, 34.9, "rad/s, saturation: 2000 deg/s"),
    ("acc_lowpass", 1, 30.0, "Hz, of what the log gets; 0: none"),
    ("gyro_bandwidth", 1, 116.0, "Hz, of the gyro chip's samples; 0: all"),
    ("gyro_lowpass", 1, 80.0, "Hz, of what the firmware makes of them; 0: none"),
    ("vibration", 1, 0.0, "m/s^2, amplitude of the rotors' 1/rev line on the accelerometer"),
    ("vibration_gyro", 1, 0.05, "rad/s per m/s^2"),
    ("range_noise", 1, 0.002, "m rms"),
    ("range_below_rotors", 1, 0.025, "m, down range sensor below the rotor discs"),
    ("range_reach", 1, 0.0, "m, a higher surface this far beside the beam is seen"),
    ("range_delay", 1, 0.0, "s, from a down range measurement to log and estimator, whole ms"),
    ("range_bias", 1, 0.0, "m, error of a down range reading at no distance"),
    ("range_bias_fade", 1, 0.05, "m, distance over which `range_bias` dies out"),
    ("range_drift", 1, 0.0, "1, rms over the distance, error of the down range that comes and goes"),
    ("range_drift_time", 1, 0.5, "s, correlation time of `range_drift`"),
    ("range_dip", 1, 0.0, "m, error of the down range just after a higher surface came below"),
    ("range_dip_fade", 1, 0.0, "m, distance over which `range_dip` dies out; 0: it does not"),
    ("range_dip_time", 1, 0.2, "s, time constant with which `range_dip` dies out"),
    ("leg_below_range", 1, 0.006, "m, end of the legs below the down range sensor"),
    ("flow_noise", 2, 0.02, "m/s rms at 1 m, error of the velocity that optical flow shows, forward and left"),
    ("flow_noise_time", 1, 0.05, "s, correlation time of `flow_noise`"),
    ("flow_focus", 1, 0.08, "m, least distance of optical flow; closer, its picture scales no further"),
    ("flow_delay", 1, 0.0, "s, of optical flow"),
    ("flow_share", 1, 0.0, "0: optical flow counts as at the height that the firmware has, 1: as at the true distance"),
    ("flow_transient", 1, 0.0, "added to `flow_share` when what is below has just changed"),
    ("flow_transient_time", 1, 0.2, "s, time constant with which `flow_transient` dies out"),
    ("flow_transient_wait", 1, 0.0, "s, from the change of what is below to the beginning of `flow_transient`"),
    ("flow_transient_above", 1, 0.0, "m, least distance at which `flow_transient` acts"),
    ("range_residual", 1, 0.0, "m, range module's error over a platform"),
    ("range_kick", 1, 0.0, "m, error of the one reading on which an edge is noticed"),
    ("range_mixed", 1, 0.0, "fraction of edges with one reading between the two surfaces, or beyond"),
    ("sensor_delay", 1, 0.0, "s, from IMU to controller"),
    ("time_jitter", 1, 0.0, "s rms, on logged time"),
    ("controller_ahead", 1, 0.004, "s, from the run of position controller and prediction to a logged row, whole 2 ms"),
    ("packet_loss", 1, 0.0, "fraction of logged samples lost"),
    ("loss_burst", 1, 1.0, "samples lost in a row, mean"),
    ("thrust_base", 1, 36000.0, "command in hover, of 65535"),
    ("thrust_min", 1, 20000.0, "least command in flight, of 65535"),
    ("thrust_scale", 1, 1000.0, "command per unit of the climb loop's output"),
    ("rate_scale", 1, 1.0, "of the rate gains, to another vehicle's authority"),
    ("rate_gain", 1, 1.0, "times the rate loop's gains"),
    ("attitude_gain", 1, 1.0, "times the attitude loop's gains"),
    ("position_gain", 1, 1.0, "times the horizontal position and velocity gains"),
    ("height_gain", 1, 1.0, "times the vertical position and velocity gains"),
    ("step", 1, 0.002, "s, of physics and attitude controller; the firmware's estimator runs every millisecond"),
)
DTYPE = np.dtype([*((name, _F) if n == 1 else (name, _F, (n,)) for name, n, _, _ in FIELDS),
                  ("firmware", settings.DTYPE)])
PLANT = from_dtype(DTYPE)[::1]  #: an array (1,) of it, in compiled code
ROTOR_SIGN_X = np.array([1.0, -1.0, -1.0, 1.0])
ROTOR_SIGN_Y = np.array([-1.0, -1.0, 1.0, 1.0])
OWN_PLATFORM = "cf2"  #: whose gains and battery compensation stand in the firmwares' files
DEFAULT_THRUST_PER_SPEED2 = 2.1e-8  #: N/(rad/s)^2, Crazyflie: 0.089 N at 19,700 rpm


def from_vehicle(vehicle: Vehicle) -> np.ndarray:
    """The nominal plant of a vehicle: an array (1,) of DTYPE.

    Its fields may be changed in place; lengths and units are in FIELDS.
    """
    # as bytes: see `settings.load`
    return np.frombuffer(bytearray(_nominal(vehicle, settings.load(vehicle.firmware).tobytes()).tobytes()), DTYPE)


@functools.lru_cache(64)
def _nominal(vehicle: Vehicle, release: bytes) -> np.ndarray:
    """The plant of a vehicle that flies a release, the bytes of its settings: a file may have changed meanwhile."""
    plant = np.zeros(1, DTYPE)
    for name, _, default, _ in FIELDS:
        plant[name] = default
    row = plant[0]
    row["mass"], row["gravity"], row["inertia"] = vehicle.mass_kg, vehicle.gravity_mps2, vehicle.inertia_kg_m2
    half = vehicle.arm_m / np.sqrt(2.0)
    row["rotor_x"], row["rotor_y"] = ROTOR_SIGN_X * half, ROTOR_SIGN_Y * half
    row["rotor_radius"], row["rotor_spacing"] = vehicle.rotor_radius_m, 2.0 * half
    row["thrust_curve"] = vehicle.thrust_of_pwm_n
    row["thrust_per_speed2"] = vehicle.thrust_per_speed2 or DEFAULT_THRUST_PER_SPEED2
    row["yaw_torque_over_thrust"] = vehicle.yaw_torque_over_thrust_m
    row["rotor_inertia"] = vehicle.rotor_inertia_kg_m2
    row["motor_rise"] = vehicle.motor_time_constant_s
    row["motor_fall"] = vehicle.motor_fall_time_constant_s or vehicle.motor_time_constant_s
    row["nominal_voltage"] = vehicle.nominal_voltage_v or 3.8 * vehicle.battery_cells
    row["voltage_exponent"] = vehicle.voltage_exponent
    row["battery_capacity"] = 3600.0 * vehicle.battery_capacity_ah
    row["battery_resistance"] = vehicle.battery_resistance_ohm
    row["battery_cells"] = vehicle.battery_cells
    row["power_per_thrust15"] = vehicle.power_per_thrust15
    row["acc_noise"] = vehicle.acc_noise_rms_mps2 * np.array(vehicle.acc_noise_ratio)
    row["gyro_noise"] = vehicle.gyro_noise_rms_radps * np.array(vehicle.gyro_noise_ratio)
    row["flow_noise"], row["flow_noise_time"] = vehicle.flow_noise_mps, vehicle.flow_noise_time_s
    row["gyro_bandwidth"] = vehicle.gyro_bandwidth_hz
    row["range_noise"], row["range_drift"] = vehicle.range_noise_rms_m, vehicle.range_drift_rms
    row["range_drift_time"] = vehicle.range_drift_time_s
    row["acc_lowpass"] = vehicle.acc_lowpass_hz
    _firmware(row, vehicle, np.frombuffer(release, settings.DTYPE)[0])
    return plant


def _firmware(row: np.ndarray, vehicle: Vehicle, release: np.void) -> None:
    """The settings of a firmware release, and what scales its loops to the vehicle.

    On a Crazyflie 2 (platform cf2) they fly as they are. Other vehicles get gains of the same loops without battery
    compensation; their thrust curve stands for the compensation of other platforms of the firmware.
    """
    row["firmware"] = release
    firmware, hover = row["firmware"], hover_pwm(vehicle)
    if vehicle.range_module != settings.OWN_MODULE:
        firmware["range_module"]["kind"] = settings.RANGE_MODULES.index(vehicle.range_module)
    row["gyro_lowpass"] = release["filters"]["gyro_hz"]
    if vehicle.platform == OWN_PLATFORM:
        for name in ("thrust_base", "thrust_min", "thrust_scale"):
            row[name] = release["controller"][name]
    else:
        kind = settings.OF_VEHICLE if vehicle.platform else settings.NO_COMPENSATION
        firmware["battery_compensation"]["kind"] = kind
        row["thrust_base"], row["thrust_min"] = 0.9 * hover, min(20000.0, 0.5 * hover)
        row["rate_scale"] = _authority(REFERENCE) / _authority(vehicle)
        row["thrust_scale"] = release["controller"]["thrust_scale"] * _lift_slope(REFERENCE) / _lift_slope(vehicle)
    if vehicle.thrust_base_pwm:
        row["thrust_base"] = vehicle.thrust_base_pwm


def hover_pwm(vehicle: Vehicle) -> float:
    """PWM at which four rotors carry the weight at the nominal voltage."""
    c0, c1, c2 = vehicle.thrust_of_pwm_n
    each = vehicle.mass_kg * vehicle.gravity_mps2 / 4.0
    if c2 == 0.0:
        return float((each - c0) / c1)
    return float((-c1 + np.sqrt(c1 * c1 - 4.0 * c2 * (c0 - each))) / (2.0 * c2))


def hover_speed(plant: np.ndarray) -> float:
    """Speed of one rotor in hover, rad/s."""
    row = plant[0]
    return float(np.sqrt(row["mass"] * row["gravity"] / 4.0 / row["thrust_per_speed2"]))


def _slope(vehicle: Vehicle) -> float:
    """N per PWM of one motor in hover."""
    return vehicle.thrust_of_pwm_n[1] + 2.0 * vehicle.thrust_of_pwm_n[2] * hover_pwm(vehicle)


def _authority(vehicle: Vehicle) -> float:
    """rad/s^2 per PWM about the roll axis."""
    return vehicle.arm_m * _slope(vehicle) / vehicle.inertia_kg_m2[0]


def _lift_slope(vehicle: Vehicle) -> float:
    """m/s^2 per PWM."""
    return _slope(vehicle) / vehicle.mass_kg


#: Vehicles of another platform get the firmware's gains scaled to the loops of this one.
REFERENCE = Vehicle(
    name="reference", mass_kg=0.0319, arm_m=0.046, inertia_kg_m2=(1.68e-5, 1.68e-5, 2.98e-5),
    thrust_of_pwm_n=(5.485e-4, 1.0326e-6, 2.1303e-11), yaw_torque_over_thrust_m=0.0072,
    motor_time_constant_s=0.06, rotor_radius_m=0.0235)
