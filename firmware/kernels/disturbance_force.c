#include "disturbance_force.h"

#include <math.h>

#include "sample_guard.h"

// Of thrust, over that at the nominal voltage: half and twice that voltage. A battery beyond is a fault of the sensor.
#define THRUST_FACTOR_MIN 0.25f
#define THRUST_FACTOR_MAX 4.0f

bool voltageKnown(float vbat) { return vbat >= 0.1f && vbat <= 1000.0f; }

float voltageFactor(const airtouchVehicle_t *vehicle, float vbat) {
  if (!(vehicle->nominalVoltage > 0.0f) || !voltageKnown(vbat)) {
    return 1.0f;
  }
  const float ratio = vbat / vehicle->nominalVoltage;
  return clampFloat(ratio * ratio, THRUST_FACTOR_MIN, THRUST_FACTOR_MAX);
}

float totalThrust(const airtouchVehicle_t *vehicle, const float pwm[4]) {
  float thrust = 0.0f;
  for (int i = 0; i < 4; i++) {
    const float p = clampFloat(pwm[i], 0.0f, PWM_LIMIT);
    if (p > 0.0f) {
      thrust += vehicle->thrust[0] + p * (vehicle->thrust[1] + p * vehicle->thrust[2]);
    }
  }
  return thrust;
}

void disturbanceForce(const airtouchVehicle_t *vehicle, const float acc[3], float thrust, const float thrustAxis[3],
                      float force[3]) {
  for (int i = 0; i < 3; i++) {
    force[i] = vehicle->mass * acc[i] - thrust * thrustAxis[i];
  }
}

float forceNorm(const float force[3]) { return sqrtf(force[0] * force[0] + force[1] * force[1] + force[2] * force[2]); }
