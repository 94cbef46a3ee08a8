// disturbance_force.h: finite samples of any size and vehicles, held against the equations in double.
#include "disturbance_force.h"

#include "fuzz.h"

static airtouchVehicle_t takeVehicle(bytes_t *bytes) {
  airtouchVehicle_t vehicle = {.mass = fabsf(takeFinite(bytes, 0.03f, 100.0f)), .gravity = 9.81f};
  vehicle.thrust[0] = takeFinite(bytes, 5e-4f, 1e3f);
  vehicle.thrust[1] = takeFinite(bytes, 1e-6f, 1e3f);
  vehicle.thrust[2] = takeFinite(bytes, 2e-11f, 1e3f);
  vehicle.nominalVoltage = takeFloat(bytes, 4.0f);
  return vehicle;
}

static void checkVoltage(const airtouchVehicle_t *vehicle, float vbat) {
  const bool known = vbat >= 0.1f && vbat <= 1000.0f;
  const float factor = voltageFactor(vehicle, vbat);
  CHECK(voltageKnown(vbat) == known, "a battery has from 0.1 to 1000 V");
  if (!known || !(vehicle->nominalVoltage > 0.0f)) {
    CHECK(factor == 1.0f, "an unknown voltage changes nothing");
  } else if (vehicle->nominalVoltage >= 0.1f) {
    const double ratio = (double)vbat / vehicle->nominalVoltage;
    const double right = fmax(0.25, fmin(ratio * ratio, 4.0));
    CHECK(fabs(factor - right) <= 4.0 * FLT_EPSILON * right, "the factor is the voltage's square, clamped");
  }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
  bytes_t bytes = {data, size};
  const airtouchVehicle_t vehicle = takeVehicle(&bytes);
  for (int round = 0; round == 0 || (round < 8 && bytes.left > 0); round++) {
    float pwm[4], acc[3], axis[3], force[3];
    double thrust = 0.0, slip = 0.0, square = 0.0;
    checkVoltage(&vehicle, takeFloat(&bytes, 4.0f));
    for (int i = 0; i < 4; i++) {
      pwm[i] = takeFinite(&bytes, 3e4f, FLT_MAX);
      const double p = fmin(fmax(pwm[i], 0.0), 65535.0);
      const double parts[3] = {vehicle.thrust[0], p * vehicle.thrust[1], p * p * vehicle.thrust[2]};
      for (int k = 0; k < 3 && p > 0.0; k++) {
        thrust += parts[k];
        slip += 16.0 * FLT_EPSILON * fabs(parts[k]);
      }
    }
    const float psi = totalThrust(&vehicle, pwm);
    CHECK(fabs(psi - thrust) <= slip + 1e-34, "thrust is the sum of the motors' curves");
    for (int i = 0; i < 3; i++) {
      acc[i] = takeFinite(&bytes, 10.0f, 1e15f);
      axis[i] = takeFinite(&bytes, 0.5f, 1.0f);
    }
    disturbanceForce(&vehicle, acc, psi, axis, force);
    for (int i = 0; i < 3; i++) {
      const double pushed = (double)vehicle.mass * acc[i], lifted = (double)psi * axis[i];
      CHECK(fabs(force[i] - (pushed - lifted)) <= 2.0 * FLT_EPSILON * (fabs(pushed) + fabs(lifted)) + 1e-44,
            "the force is what neither gravity nor thrust explains");
      square += (double)force[i] * force[i];
    }
    CHECK(fabs(forceNorm(force) - sqrt(square)) <= 4.0 * FLT_EPSILON * sqrt(square) + 1e-22, "the norm is its length");
  }
  return 0;
}
