/**
 * @file disturbance_force.h
 * The force that neither gravity nor the motors explain:
 * f_w = m a - m g - R f_u, f_u = (0, 0, Psi), Psi the sum of the motors' thrust.
 * Pure functions; inputs must be finite (see sample_guard.h).
 *
 * Target: C11 with IEEE single precision, on any processor; a FPU helps. Build with -ffp-contract=off for the
 *   desktop's bits.
 * Threads: pure functions without state: any number at once.
 * Memory: none; under 100 bytes of stack.
 * Cost: 166 instructions of a Cortex-M4 a sample.
 */
#pragma once

#include <stdbool.h>

#include "kernel_types.h"

#ifdef __cplusplus
extern "C" {
#endif

/** Whether @p vbat can be a battery's voltage: 0.1 to 1000 V, so not NaN. Others are held by the callers. */
bool voltageKnown(float vbat);

/**
 * (vbat / nominal)^2, clamped to 0.25..4.
 * @return 1 when the vehicle's nominal voltage or @p vbat is unknown
 */
float voltageFactor(const airtouchVehicle_t *vehicle, float vbat);

/** Psi in newtons at the nominal voltage; PWM is clamped to 0..65535. */
float totalThrust(const airtouchVehicle_t *vehicle, const float pwm[4]);

/**
 * f_w in newtons, world axes.
 * @param acc         specific force a - g, world axes, m/s^2 (+g along z at rest)
 * @param thrust      Psi, newtons, voltage taken into account
 * @param thrustAxis  R e_z
 */
void disturbanceForce(const airtouchVehicle_t *vehicle, const float acc[3], float thrust, const float thrustAxis[3],
                      float force[3]);

/** ||f_w||, newtons. */
float forceNorm(const float force[3]);

#ifdef __cplusplus
}
#endif
