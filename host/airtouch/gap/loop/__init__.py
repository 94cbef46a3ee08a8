"""The closed loop: what the controller makes of noise and of torques, and what nominal flights show of it.

**What is modelled** (`loop_model`). Each of the axes thrust, roll and pitch (`controller.AXES`) is one loop. For roll
and pitch u is the command, N per motor, w the rate, rad/s; for thrust w is the climb, m/s:

    w = P u,  P = a D H M / s                        plant (`axis_plant`): acceleration a per N, actuator delay D,
                                                     hold H of the controller's period, lag M of the motors
    u = -K w,  K = R + A + V                         controller (`controller`): paths of rate, angle and velocity
    S = 1 / (1 + P K)                                sensitivity

The log holds one command in five. Set-points and attitudes come to the inner loop as steps, whose derivative, the
*kick*, is in one command of five, so that of A and V the log shows a multiple k: K_log = R + k (A + V) (`kick_of`).

**Noise** (`noise_spectra`). A source that adds n_i to the command by a path d_i turns the vehicle by P d_i S n_i, and
the log has the command

    u_i = (d_i,log - K_log P d_i S) n_i              power of the commands S_uu = sum of strength_i |u_i / n_i|^2

To it comes what noise of the gyro above 50 Hz folds into the log (`aliases_of`).

**Which loop** (`identify`). Strengths and, where the firmware's gains do not explain nominal flights, gains are those
of the highest Whittle likelihood of the measured S_uu (`command_spectra`). `closed_loop` has the result.

**What is compared.** Two views of a flight ask for what effects change, over what is without:

- its commands: S_uu, `ClosedLoop.ratio` (compared in `signals.command_view`);
- its torque: the share of a logged command's torque that turns the vehicle, S_yu / S_uu over s P, y = s w
  (`command_response`, with `set_point_steps` beside the noise; with and without effects `torque_share`), and what a
  torque from outside leaves: S in the gyro, and the command that answers it (`disturbed`); both are compared in
  `signals.response`.

**The echo of noise** (`noise_echo`). In which row of the log, and how strong, the commands hold what the gyro shows
above 20 Hz. It needs no model of the controller, so it holds for any.

Sources: loops and sensitivity, Astrom and Murray, Feedback Systems, 2nd ed. 2021, chapter 12; sampling and hold,
Franklin, Powell, Workman, Digital Control of Dynamic Systems, 3rd ed. 1998; cross spectra, Bendat and Piersol, Random
Data, 4th ed. 2010, chapter 6; the controller, crazyflie-firmware (`simulation.firmware`).
"""
