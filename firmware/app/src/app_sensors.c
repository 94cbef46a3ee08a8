#include "app_sensors.h"

#include <math.h>

#include "autoconf.h"
#include "log.h"

#include "imu_tap.h"

#define GRAVITY 9.81f  // the firmware's own, in stabilizer.c
#define RADIANS_PER_DEGREE 0.01745329252f
#define VARIABLES 15

typedef struct {
  const char *group;
  const char *name;
} variable_t;

// acc 0-2, gyro 3-5, motors 6-9, vbat 10, attitude 11-14
static const variable_t variables[VARIABLES] = {
    {"stateEstimate", "ax"}, {"stateEstimate", "ay"}, {"stateEstimate", "az"}, {"gyro", "x"},
    {"gyro", "y"},           {"gyro", "z"},           {"motor", "m1"},         {"motor", "m2"},
    {"motor", "m3"},         {"motor", "m4"},         {"pm", "vbat"},          {"stateEstimate", "qx"},
    {"stateEstimate", "qy"}, {"stateEstimate", "qz"}, {"stateEstimate", "qw"},
};
static logVarId_t ids[VARIABLES];

bool appSensorsInit(void) {
  bool all = true;
  for (int i = 0; i < VARIABLES; i++) {
    ids[i] = logGetVarId(variables[i].group, variables[i].name);
    all = all && logVarIdIsValid(ids[i]);
  }
  return all;
}

/** logGetFloat() halts the drone on an identifier that is not valid; this does not. */
static float value(int i) { return logVarIdIsValid(ids[i]) ? logGetFloat(ids[i]) : NAN; }

/** The estimator's acceleration is in g, world axes, without gravity. */
static void readLogs(appSample_t *sample) {
  sample->accInBody = 0;
  for (int i = 0; i < 3; i++) {
    sample->acc[i] = GRAVITY * (value(i) + (i == 2 ? 1.0f : 0.0f));
    sample->gyro[i] = RADIANS_PER_DEGREE * value(3 + i);
  }
}

static bool readTap(appSample_t *sample) {
#ifdef CONFIG_CONTROLLER_OOT
  imuMean_t mean;
  if (!imuTapRead(&mean)) {
    return false;
  }
  sample->accInBody = 1;
  for (int i = 0; i < 3; i++) {
    sample->acc[i] = GRAVITY * mean.acc[i];
    sample->gyro[i] = RADIANS_PER_DEGREE * mean.gyro[i];
  }
  return true;
#else
  (void)sample;
  return false;
#endif
}

void appSensorsRead(appSample_t *sample) {
  if (!readTap(sample)) {
    readLogs(sample);
  }
  for (int i = 0; i < 4; i++) {
    sample->pwm[i] = value(6 + i);
    sample->attitude[i] = value(11 + i);
  }
  sample->vbat = value(10);
}
