"""One flight as one compiled loop: controller, motors, effects, rigid body, sensors, log.

Order within a step of 2 ms: the IMU measures, the estimator and the controller run on
what they are given, the log takes its row (100 Hz), the delayed command reaches the motors,
every effect adds its force and torque at the middle of the step, the body moves (RK4).
"""

import math

import numpy as np
from numba import float64, from_dtype, int64, types, uint64

from airtouch.simulation import (
    battery,
    contact,
    controller,
    estimator,
    kept,
    motors,
    rigid_body,
    sensors,
    surroundings,
    world,
)
from airtouch.simulation import signals as at
from airtouch.simulation.compiled import jit
from airtouch.simulation.effects.effect import MEMORY, WrenchFunction
from airtouch.simulation.kept import SLOTS
from airtouch.simulation.plant import DTYPE
from airtouch.simulation.random_stream import normals
from airtouch.simulation.rotation import euler, sine_and_cosine
from airtouch.simulation.sensors import RING

LOG_STEPS = 5  #: physics steps a logged row
OK, NOT_FINITE, UPSET, STRUCK, LOST = range(5)  #: how a flight ended
ENDINGS = ("ok", "a value is not finite", "it turned over", "it struck a surface", "it flew away")
TURN = 2.0 * math.pi
LATER = math.cos(0.7), math.sin(0.7)  #: vibration along z is 0.7 rad ahead
FOCUS_M = 0.08  #: the flow sensor's least distance; closer, its picture scales no further
FLOOR_DEPTH_M = 0.015  #: legs this far inside a surface: it struck it
(T, ACC, GYRO, PWM, DOWN, RANGES, VBAT, PLACE, SPEED, ANGLES, RPM, ACC_WORLD, COLUMNS) = (
    0, 1, 4, 7, 11, 12, 16, 17, 20, 23, 26, 30, 33)

_LOOP = types.Tuple((int64, int64))(
    from_dtype(DTYPE)[::1], float64[:, ::1], int64[::1], float64[:, ::1], float64[:, ::1], float64[::1],
    float64[:, ::1], types.UniTuple(WrenchFunction, SLOTS), int64, float64[:, ::1],
    uint64[:, ::1], uint64[:, ::1], float64[::1], float64[:, ::1])


@jit(_LOOP, nogil=True)
def fly(plant_array, corners, first, surface, box, room, setpoints, effects, used, parameters,
        effect_streams, streams, memory, table):
    """Fly as many rows as `table` (rows, 33) has, the columns of the flight log.

    plant_array (1,); corners, first, surface, box: a World; room (4,): walls for the
    Multi-ranger; setpoints (rows, 8): one a logged row; effects: SLOTS wrenches, `used` of
    them on, with parameters (SLOTS, 8) and streams (SLOTS, 1). memory (kept.SIZE,): as
    `kept.begin` leaves it; the next call with it (and the same plant and streams) continues,
    and many short calls give the same numbers as one long one. Returns how it ended (OK or a
    reason) and the number of rows of this call that are filled.
    """
    plant = plant_array[0]
    h = plant.step
    hover = math.sqrt(plant.mass * plant.gravity / 4.0 / plant.thrust_per_speed2)
    leg = plant.range_below_rotors + plant.leg_below_range
    state, speed = memory[kept.STATE:kept.SPEED], memory[kept.SPEED:kept.FORCE]
    force, pwm = memory[kept.FORCE:kept.SLOPE], memory[kept.PWM:kept.FLICKER]
    effect_memory = memory[kept.EFFECTS:kept.PID].reshape((SLOTS, MEMORY))
    pid_memory, est = memory[kept.PID:kept.ESTIMATE], memory[kept.ESTIMATE:kept.PWM]
    flicker, base_gain = memory[kept.FLICKER:kept.GAIN], memory[kept.GAIN:kept.PHASE]
    phase, ring = memory[kept.PHASE:kept.SENSED], memory[kept.SENSED:kept.COMMANDED].reshape((RING, 6))
    command = memory[kept.COMMANDED:kept.ACC_FILTER].reshape((RING, 4))
    acc_filter = memory[kept.ACC_FILTER:kept.GYRO_FILTER]
    gyro_filter = memory[kept.GYRO_FILTER:kept.ACC_MEMORY]
    acc_memory = memory[kept.ACC_MEMORY:kept.GYRO_MEMORY].reshape((3, 2))
    gyro_memory = memory[kept.GYRO_MEMORY:kept.ACC_RMS].reshape((3, 2))
    acc_rms, drift = memory[kept.ACC_RMS:kept.DRIFT], memory[kept.DRIFT:kept.RANGES]
    ranges, scratch = memory[kept.RANGES:kept.SCRATCH], memory[kept.SCRATCH:kept.SIZE]
    target, middle, middle_speed = scratch[0:4], scratch[4:17], scratch[17:21]
    motor_n, imu_n, other_n = scratch[21:25], scratch[25:31], scratch[31:35]
    acc, gyro, seen_acc, seen_gyro = scratch[35:38], scratch[38:41], scratch[41:44], scratch[44:47]
    world_force, seen_velocity, patch = scratch[47:50], scratch[50:53], scratch[53:60]
    s = scratch[60:60 + at.COUNT]
    drift_decay = math.exp(-LOG_STEPS * h / plant.flow_noise_time)
    drift_fresh = math.sqrt(1.0 - drift_decay * drift_decay)
    ground, charge, battery_volts = memory[kept.GROUND], memory[kept.CHARGE], memory[kept.VOLTS]
    down, last_down_top, changed = memory[kept.DOWN], memory[kept.TOP], memory[kept.CHANGED]
    next_range, next_ranges = memory[kept.NEXT_RANGE], memory[kept.NEXT_RANGES]
    flying = memory[kept.FLYING] > 0.5
    power_per_speed3 = plant.power_per_thrust15 * plant.thrust_per_speed2 * math.sqrt(plant.thrust_per_speed2)
    decay = math.exp(-h / plant.motor_noise_time)
    fresh = math.sqrt(1.0 - decay * decay)
    hiss_decay = math.exp(-h / plant.motor_hiss_time)
    hiss_fresh = math.sqrt(1.0 - hiss_decay * hiss_decay)
    attitude, slope = state[6:10], memory[kept.SLOPE:kept.EFFECTS]
    constant = rigid_body.constants(plant, h)
    motor_stream, imu_stream, other_stream = streams[0], streams[1], streams[2]
    rows = table.shape[0]
    begun = int(memory[kept.STEP])

    for n in range(rows * LOG_STEPS):
        k = begun + n
        t = k * h
        row = n // LOG_STEPS
        setpoint = setpoints[row]
        # --- IMU: specific force at the sensor, which sits in the geometric centre
        lift = 0.0
        for i in range(4):
            lift += plant.thrust_per_speed2 * speed[i] * speed[i] * plant.gain[i]
        rx, ry, rz = -plant.com[0], -plant.com[1], -plant.com[2]
        wx, wy, wz = state[10], state[11], state[12]
        dx, dy, dz = slope[10], slope[11], slope[12]
        dot = wx * rx + wy * ry + wz * rz
        square = wx * wx + wy * wy + wz * wz
        acc[0] = force[0] / plant.mass + dy * rz - dz * ry + wx * dot - rx * square
        acc[1] = force[1] / plant.mass + dz * rx - dx * rz + wy * dot - ry * square
        acc[2] = (force[2] + lift) / plant.mass + dx * ry - dy * rx + wz * dot - rz * square
        normals(imu_stream, imu_n)
        shake_x, shake_y, shake_z = 0.0, 0.0, 0.0
        if plant.vibration > 0.0:
            for i in range(4):
                size = 0.5 * plant.vibration * (speed[i] / hover) ** 2
                sine, cosine = sine_and_cosine(phase[i])
                shake_x += size * sine
                shake_y += size * cosine
                shake_z += size * (LATER[0] * sine + LATER[1] * cosine)
        for i in range(3):
            shake = shake_x if i == 0 else (shake_y if i == 1 else shake_z)
            value = acc[i] + plant.acc_bias[i] + acc_rms[i] * imu_n[i]
            value = sensors.lowpass(acc_filter, acc_memory[i], value) + shake
            acc[i] = min(max(value, -plant.acc_range), plant.acc_range)
            value = state[10 + i] + plant.gyro_bias[i] + plant.gyro_noise[i] * imu_n[3 + i]
            value += plant.vibration_gyro * shake
            gyro[i] = min(max(value, -plant.gyro_range), plant.gyro_range)
            ring[k & (RING - 1), i] = acc[i]
            ring[k & (RING - 1), 3 + i] = sensors.lowpass(gyro_filter, gyro_memory[i], gyro[i])
        if k == 0:
            for j in range(RING):
                for i in range(6):
                    ring[j, i] = ring[0, i]
        late = plant.sensor_delay / h
        for i in range(3):
            seen_acc[i] = sensors.delayed(ring, k, late, i)
            seen_gyro[i] = sensors.delayed(ring, k, late, 3 + i)

        # --- other sensors
        if t >= next_range:
            next_range += sensors.RANGE_PERIOD_S
            normals(other_stream, other_n)
            eye = state[2] - plant.range_below_rotors
            spot = max(sensors.CONE_TANGENT * (eye - ground), 0.002)
            world.below(corners, first, surface, box, state[0], state[1], eye, spot, patch)
            near = patch[world.UPPER_TOP] if patch[world.COVER] > 0.0 else patch[world.LOWER_TOP]
            spot = max(sensors.CONE_TANGENT * (eye - near), 0.002)
            world.below(corners, first, surface, box, state[0], state[1], eye, spot, patch)
            covered = patch[world.COVER] >= sensors.CONE_COVER
            top = patch[world.UPPER_TOP] if covered else patch[world.LOWER_TOP]
            roll, pitch, _ = euler(attitude)
            tilt = max(math.cos(roll) * math.cos(pitch), 0.3)
            down = max((eye - top) / tilt + plant.range_noise * other_n[0], 0.0)
            if down > sensors.MAX_RANGE_M:
                down = np.nan
            else:
                height = down * tilt + top
                if top > ground:
                    height -= plant.range_residual
                if top != last_down_top:
                    changed = t
                    height += plant.range_kick if top < last_down_top else -plant.range_kick
                estimator.correct_range(est, height)
            last_down_top = top
        if t >= next_ranges:
            next_ranges += sensors.MULTIRANGER_PERIOD_S
            _, _, yaw = euler(attitude)
            for i in range(4):
                turn = (0.0, math.pi, 0.5 * math.pi, -0.5 * math.pi)[i]
                far = sensors.wall_distance(state[0], state[1], yaw + turn, room)
                ranges[i] = far if far <= sensors.MAX_RANGE_M else np.nan

        # --- estimator and controller
        if flying or setpoint[controller.MOTORS] > 0.5:
            wx, wy, wz = estimator.predict(est, seen_gyro, seen_acc, plant.gravity, h)
        else:
            wx, wy, wz = acc[0], acc[1], acc[2]
        world_force[0], world_force[1], world_force[2] = wx, wy, wz
        if n % LOG_STEPS == 0:
            normals(other_stream, other_n)
            for i in range(3):
                drift[i] = drift_decay * drift[i] + drift_fresh * plant.flow_noise[i] * other_n[i]
            height = max(state[2] - plant.range_below_rotors - last_down_top, FOCUS_M)
            left = math.exp((changed - t) / plant.flow_transient_time)
            share = plant.flow_share + plant.flow_transient * left
            scale = 1.0 + share * (max(est[8], height) / height - 1.0) if flying else 1.0
            c, d = math.cos(est[2]), math.sin(est[2])
            estimator.correct_flow(est, state[3] * scale + c * drift[0] - d * drift[1],
                                   state[4] * scale + d * drift[0] + c * drift[1])
        volts = battery.supply(plant, battery_volts)
        factor = motors.voltage_factor(plant, volts)
        if setpoint[controller.MOTORS] > 0.5:
            flying = True
            if n % controller.POSITION_STEPS == 0:
                seen_velocity[0], seen_velocity[1], seen_velocity[2] = est[3], est[4], est[5] + drift[2]
                controller.position_loop(plant, pid_memory, setpoint, est[6:9], seen_velocity, est[2])
            controller.attitude_loop(plant, pid_memory, est[0], est[1], est[2], seen_gyro, pwm)
            if plant.compensate_battery > 0.5:
                for i in range(4):
                    pwm[i] = motors.compensated(plant, pwm[i], factor)
            controller.cap(pwm)
        else:
            flying = False
            controller.reset(pid_memory, math.degrees(est[2]))
            for i in range(4):
                pwm[i] = 0.0
            est[3], est[4], est[5] = 0.0, 0.0, 0.0

        # --- log
        if n % LOG_STEPS == 0:
            out = table[row]
            out[T] = (begun + row * LOG_STEPS) * h
            roll, pitch, yaw = euler(attitude)
            out[ANGLES], out[ANGLES + 1], out[ANGLES + 2] = roll, pitch, yaw
            for i in range(3):
                out[ACC + i], out[GYRO + i] = acc[i], gyro[i]
                out[PLACE + i], out[SPEED + i], out[ACC_WORLD + i] = state[i], state[3 + i], world_force[i]
            out[PLACE + 2] -= plant.range_below_rotors
            for i in range(4):
                out[PWM + i], out[RANGES + i] = pwm[i], ranges[i]
                out[RPM + i] = speed[i] * 9.549296585513721
            out[DOWN], out[VBAT] = down, volts

        # --- motors
        for i in range(4):
            command[k & (RING - 1), i] = pwm[i]
            if k == 0:
                for j in range(RING):
                    command[j, i] = pwm[i]
        if plant.motor_hiss > 0.0:
            normals(motor_stream, motor_n)
            for i in range(4):
                flicker[4 + i] = hiss_decay * flicker[4 + i] + hiss_fresh * motor_n[i]
        normals(motor_stream, motor_n)
        power = 0.0
        for i in range(4):
            given = sensors.delayed(command, k, plant.actuator_delay / h, i)
            target[i] = motors.target_speed(plant, given, factor)
            flicker[i] = decay * flicker[i] + fresh * motor_n[i]
            random = plant.motor_noise * flicker[i] + plant.motor_hiss * flicker[4 + i]
            plant.gain[i] = base_gain[i] * (1.0 + random)
            power += power_per_speed3 * speed[i] * speed[i] * speed[i]
            if plant.vibration > 0.0:
                turns = (phase[i] + h * speed[i]) / TURN
                phase[i] = TURN * (turns - math.floor(turns))
        charge, battery_volts = battery.drain(plant, charge, power, h)

        # --- effects, at the middle of the step
        for i in range(13):
            middle[i] = state[i] + 0.5 * h * slope[i]
        for i in range(4):
            tau = plant.motor_rise if target[i] > speed[i] else plant.motor_fall
            middle_speed[i] = speed[i] + 0.5 * h / tau * (target[i] - speed[i])
        surroundings.fill(plant, middle, slope, middle_speed, corners, first, surface, box, h, t + 0.5 * h,
                     hover, s, patch)
        for i in range(6):
            force[i] = 0.0
        for i in range(used):
            effects[i](parameters[i], s, effect_memory[i], effect_streams[i], force)
        deepest = contact.legs(plant, middle, s, leg, force)

        rigid_body.advance(plant, constant, state, speed, target, h, force, slope)
        total = 0.0
        for i in range(13):
            total += state[i]
        if not math.isfinite(total):
            return NOT_FINITE, row
        if s[at.ROTATION + 8] < 0.2:
            return UPSET, row + 1
        if deepest > FLOOR_DEPTH_M:
            return STRUCK, row + 1
        if abs(state[0]) > 1000.0 or abs(state[1]) > 1000.0 or abs(state[2]) > 100.0:
            return LOST, row + 1
    memory[kept.STEP], memory[kept.CHARGE], memory[kept.VOLTS] = begun + rows * LOG_STEPS, charge, battery_volts
    memory[kept.DOWN], memory[kept.TOP], memory[kept.CHANGED] = down, last_down_top, changed
    memory[kept.NEXT_RANGE], memory[kept.NEXT_RANGES] = next_range, next_ranges
    memory[kept.FLYING] = 1.0 if flying else 0.0
    return OK, rows
