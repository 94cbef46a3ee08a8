#include "motion_channels.h"

#include <string.h>

#include "disturbance_force.h"
#include "sample_guard.h"

/** Where each group of channels begins; level acceleration and rates stand as in HELD_ACC and HELD_GYRO. */
enum { CHANNEL_UP = HELD_ACC + 2, CHANNEL_MOTORS = 6, CHANNEL_UNEXPLAINED = 10, CHANNEL_FILL = MOTION_CHANNELS - 1 };

void motionChannelsInit(motionChannels_t *motion, const motionConfig_t *config) {
  memset(motion, 0, sizeof *motion);
  motion->config = *config;
}

static void hold(motionChannels_t *motion, const float acc[3], const float gyro[3], const float pwm[4]) {
  for (int i = 0; i < 3; i++) {
    guardWithin(acc[i], ACC_LIMIT, &motion->held[HELD_ACC + i]);
    guardWithin(gyro[i], RATE_LIMIT, &motion->held[HELD_GYRO + i]);
  }
  for (int i = 0; i < 4; i++) {
    float *held = &motion->held[HELD_PWM + i];
    guardWithin(pwm[i], PWM_LIMIT, held);
    *held = *held > 0.0f ? *held : 0.0f;
  }
}

static void start(motionChannels_t *motion, const float motors[4], float thrust) {
  memcpy(motion->slow, motors, sizeof motion->slow);
  for (int i = 0; i < MOTION_THRUST_DELAY; i++) {
    motion->delayed[i] = thrust;
  }
  motion->lagged = thrust;
  motion->slowThrust = thrust;
  motion->started = true;
}

/** The thrust of now joins the queue; what leaves it moves the lagged thrust. */
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
  const float *a = motion->held + HELD_ACC;
  const float *m = motion->held + HELD_PWM;
  const float motors[4] = {m[2] + m[3] - m[0] - m[1], m[0] + m[3] - m[1] - m[2], m[0] + m[2] - m[1] - m[3],
                           0.25f * (m[0] + m[1] + m[2] + m[3])};
  const float thrust = totalThrust(&config->vehicle, m);
  if (!motion->started) {
    start(motion, motors, thrust);
  }
  motion->airborneSteps = motors[3] > config->armPwm ? motion->airborneSteps + 1 : 0;
  lagThrust(motion, thrust);
  // While the drone takes off the means follow at once, so that they start from hover.
  const float gain = motion->airborneSteps > config->settleSamples ? config->slowGain : 1.0f;
  for (int i = 0; i < 4; i++) {
    motion->slow[i] += gain * (motors[i] - motion->slow[i]);
    channels[CHANNEL_MOTORS + i] = motors[i] - motion->slow[i];
  }
  motion->slowThrust += gain * (motion->lagged - motion->slowThrust);
  const float meanThrust = motion->slowThrust > config->leastThrust ? motion->slowThrust : config->leastThrust;
  const float gravity = config->vehicle.gravity;
  for (int i = 0; i < HELD_PWM; i++) {
    channels[i] = motion->held[i];
  }
  channels[CHANNEL_UP] -= gravity;
  channels[CHANNEL_UNEXPLAINED] = a[2] - gravity * motion->lagged / meanThrust;
  channels[CHANNEL_FILL] = 0.0f;
  for (int i = 0; i < CHANNEL_FILL; i++) {
    channels[i] = clampFloat(channels[i] * config->inverseScale[i], -config->limit, config->limit);
  }
}
