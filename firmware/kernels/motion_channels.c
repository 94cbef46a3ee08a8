#include "motion_channels.h"

#include <string.h>

#include "disturbance_force.h"
#include "sample_guard.h"

void motionChannelsInit(motionChannels_t *motion, const motionConfig_t *config) {
  memset(motion, 0, sizeof *motion);
  motion->config = *config;
}

static void hold(motionChannels_t *motion, const float acc[3], const float gyro[3], const float pwm[4]) {
  for (int i = 0; i < 3; i++) {
    guardWithin(acc[i], ACC_LIMIT, &motion->held[i]);
    guardWithin(gyro[i], RATE_LIMIT, &motion->held[3 + i]);
  }
  for (int i = 0; i < 4; i++) {
    guardWithin(pwm[i], PWM_LIMIT, &motion->held[6 + i]);
    motion->held[6 + i] = motion->held[6 + i] > 0.0f ? motion->held[6 + i] : 0.0f;
  }
}

static void start(motionChannels_t *motion, const float motors[4], float thrust) {
  memcpy(motion->slow, motors, sizeof motion->slow);
  for (int i = 0; i < MOTION_THRUST_DELAY; i++) {
    motion->delayed[i] = thrust;
  }
  motion->lagged = thrust;
  motion->slowThrust = thrust;
  motion->started = 1;
}

// The thrust of now joins the queue; what leaves it moves the lagged thrust.
static void lagThrust(motionChannels_t *motion, float thrust) {
  motion->lagged += motion->config.lagGain * (motion->delayed[0] - motion->lagged);
  for (int i = 1; i < MOTION_THRUST_DELAY; i++) {
    motion->delayed[i - 1] = motion->delayed[i];
  }
  motion->delayed[MOTION_THRUST_DELAY - 1] = thrust;
}

void motionChannelsStep(motionChannels_t *motion, const float acc[3], const float gyro[3], const float pwm[4],
                        float channels[MOTION_CHANNELS]) {
  const motionConfig_t *config = &motion->config;
  hold(motion, acc, gyro, pwm);
  const float *a = motion->held;
  const float *m = motion->held + 6;
  const float motors[4] = {m[2] + m[3] - m[0] - m[1], m[0] + m[3] - m[1] - m[2], m[0] + m[2] - m[1] - m[3],
                           0.25f * (m[0] + m[1] + m[2] + m[3])};
  const float thrust = totalThrust(&config->vehicle, m);
  if (!motion->started) {
    start(motion, motors, thrust);
  }
  motion->airborne = motors[3] > config->armPwm ? motion->airborne + 1 : 0;
  lagThrust(motion, thrust);
  // While the drone takes off the means follow at once, so that they start from hover.
  const float gain = motion->airborne > config->settleSamples ? config->slowGain : 1.0f;
  for (int i = 0; i < 4; i++) {
    motion->slow[i] += gain * (motors[i] - motion->slow[i]);
    channels[6 + i] = motors[i] - motion->slow[i];
  }
  motion->slowThrust += gain * (motion->lagged - motion->slowThrust);
  const float usual = motion->slowThrust > config->leastThrust ? motion->slowThrust : config->leastThrust;
  const float gravity = config->vehicle.gravity;
  for (int i = 0; i < 6; i++) {
    channels[i] = motion->held[i];
  }
  channels[2] -= gravity;
  channels[10] = a[2] - gravity * motion->lagged / usual;
  channels[MOTION_CHANNELS - 1] = 0.0f;
  for (int i = 0; i < MOTION_CHANNELS - 1; i++) {
    channels[i] = clampFloat(channels[i] * config->inverseScale[i], -config->limit, config->limit);
  }
}
