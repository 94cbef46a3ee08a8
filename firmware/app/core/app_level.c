#include "app_level.h"

#include <math.h>
#include <stdbool.h>
#include <string.h>

/** The rotation of a quaternion, row by row; false where it is none. */
static bool rotationOf(const float q[4], float r[3][3]) {
  const float norm = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
  if (!(norm > 0.8f && norm < 1.2f)) {
    return false;
  }
  const float s = 2.0f / norm;
  const float x = q[0], y = q[1], z = q[2], w = q[3];
  r[0][0] = 1.0f - s * (y * y + z * z);
  r[0][1] = s * (x * y - w * z);
  r[0][2] = s * (x * z + w * y);
  r[1][0] = s * (x * y + w * z);
  r[1][1] = 1.0f - s * (x * x + z * z);
  r[1][2] = s * (y * z - w * x);
  r[2][0] = s * (x * z - w * y);
  r[2][1] = s * (y * z + w * x);
  r[2][2] = 1.0f - s * (x * x + y * y);
  return true;
}

/** Turns a vector of world axes about z, so that the nose points along x. */
static void takeYawOff(float cosine, float sine, float v[3]) {
  const float x = cosine * v[0] + sine * v[1];
  v[1] = cosine * v[1] - sine * v[0];
  v[0] = x;
}

void appLevel(const appSample_t *sample, edgeSample_t *level) {
  float r[3][3];
  memcpy(level->acc, sample->acc, sizeof level->acc);
  memcpy(level->gyro, sample->gyro, sizeof level->gyro);
  memcpy(level->pwm, sample->pwm, sizeof level->pwm);
  level->vbat = sample->vbat;
  level->probability = NAN;
  for (int i = 0; i < 3; i++) {
    level->thrustAxis[i] = NAN;
  }
  if (!rotationOf(sample->attitude, r)) {
    return;
  }
  const float *a = sample->acc;
  for (int i = 0; i < 3; i++) {
    level->thrustAxis[i] = r[i][2];
    level->acc[i] = sample->accInBody ? r[i][0] * a[0] + r[i][1] * a[1] + r[i][2] * a[2] : a[i];
  }
  const float nose = sqrtf(r[0][0] * r[0][0] + r[1][0] * r[1][0]);
  if (nose > 1e-3f) {
    takeYawOff(r[0][0] / nose, r[1][0] / nose, level->acc);
    takeYawOff(r[0][0] / nose, r[1][0] / nose, level->thrustAxis);
  }
}
