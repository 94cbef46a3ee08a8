#include "disturbance_force_batch.h"

#include "disturbance_force.h"
#include "sample_guard.h"

/** What is held from sample to sample. */
typedef struct {
  float pwm[4];
  float factor;
} motors_t;

static float heldThrust(motors_t *motors, const float *pwm, float vbat, const airtouchVehicle_t *vehicle) {
  for (int k = 0; k < 4; k++) {
    guardSample(pwm[k], &motors->pwm[k]);
  }
  if (voltageKnown(vbat)) {
    motors->factor = voltageFactor(vehicle, vbat);
  }
  return totalThrust(vehicle, motors->pwm) * motors->factor;
}

void disturbanceForceBatch(const float *acc, const float *pwm, const float *vbat, const float *thrustAxis,
                           int64_t samples, const airtouchVehicle_t *vehicle, float *force) {
  float held[3] = {0.0f, 0.0f, 0.0f};
  float axis[3] = {0.0f, 0.0f, 1.0f};
  motors_t motors = {{0.0f, 0.0f, 0.0f, 0.0f}, 1.0f};
  for (int64_t i = 0; i < samples; i++) {
    for (int k = 0; k < 3; k++) {
      guardWithin(acc[3 * i + k], ACC_LIMIT, &held[k]);
      guardWithin(thrustAxis[3 * i + k], AXIS_LIMIT, &axis[k]);
    }
    disturbanceForce(vehicle, held, heldThrust(&motors, pwm + 4 * i, vbat[i], vehicle), axis, force + 3 * i);
  }
}

void totalThrustBatch(const float *pwm, const float *vbat, int64_t samples, const airtouchVehicle_t *vehicle,
                      float *thrust) {
  motors_t motors = {{0.0f, 0.0f, 0.0f, 0.0f}, 1.0f};
  for (int64_t i = 0; i < samples; i++) {
    thrust[i] = heldThrust(&motors, pwm + 4 * i, vbat[i], vehicle);
  }
}

void forceNormBatch(const float *force, int64_t samples, float *norm) {
  for (int64_t i = 0; i < samples; i++) {
    norm[i] = forceNorm(force + 3 * i);
  }
}
