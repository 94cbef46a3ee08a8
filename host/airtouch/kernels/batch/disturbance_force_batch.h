// Whole arrays through disturbance_force.h. Row-major; rows are samples.
#include <stdint.h>

#include "kernel_types.h"

/** f_w (samples, 3) of acc (samples, 3), PWM (samples, 4), voltage (samples) and R e_z (samples, 3);
 *  values that are not finite, and voltages that are not positive, hold the last usable one. */
void disturbanceForceBatch(const float *acc, const float *pwm, const float *vbat, const float *thrustAxis,
                           int64_t samples, const airtouchVehicle_t *vehicle, float *force);
/** Psi (samples) in newtons of PWM (samples, 4) and voltage (samples). */
void totalThrustBatch(const float *pwm, const float *vbat, int64_t samples, const airtouchVehicle_t *vehicle,
                      float *thrust);
/** ||f|| (samples) of forces (samples, 3). */
void forceNormBatch(const float *force, int64_t samples, float *norm);
