/**
 * @file motion_channels.h
 * What the streaming detector sees of a sample: twelve channels without the slow
 * drift of battery and trim, each in units of its own nominal amplitude.
 *
 * 0-2   level acceleration x, y, z without gravity, m/s^2
 * 3-5   angular rate x, y, z, rad/s
 * 6-9   motor roll, pitch, yaw and mean, PWM, without their slow mean
 * 10    vertical acceleration that thrust does not explain, m/s^2
 * 11    0, so that channels come in blocks of four
 *
 * Target: C11 with IEEE single precision, on any processor; a FPU helps. Build with -ffp-contract=off for the
 *   desktop's bits.
 * Threads: no globals: different objects may be used at once; one object by one thread at a time.
 * Memory: motionChannels_t alone, 172 bytes.
 * Cost: 474 instructions of a Cortex-M4 a sample.
 */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#include "kernel_types.h"

#ifdef __cplusplus
extern "C" {
#endif

#define MOTION_THRUST_DELAY 2  ///< samples from a command to its thrust

/** The channels' memory; plain values, no pointers. */
typedef struct {
  motionConfig_t config;
  float held[HELD_VALUES];             ///< last finite acc, gyro, PWM
  float slow[4];                       ///< slow means of the motor channels
  float slowThrust;                    ///< slow mean of the lagged thrust, N
  float lagged;                        ///< thrust behind delay and lag, N
  float delayed[MOTION_THRUST_DELAY];  ///< thrust on its way, oldest first
  uint32_t airborneSteps;              ///< samples in the air without a break
  bool started;                        ///< a first sample was seen
} motionChannels_t;

/** Sets the memory up; the settings are copied. Scales and time constants must be positive. */
void motionChannelsInit(motionChannels_t *motion, const motionConfig_t *config);

/**
 * Takes one sample. Values that are not finite hold the last finite one.
 * @param acc       specific force, level axes, m/s^2 (+g along z at rest)
 * @param gyro      rad/s
 * @param pwm       0..65535
 * @param channels  MOTION_CHANNELS values, each within +-config.limit
 * Costs about 500 instructions of a Cortex-M4. Never fails.
 */
void motionChannelsStep(motionChannels_t *motion, const float acc[3], const float gyro[3], const float pwm[4],
                        float channels[MOTION_CHANNELS]);

#ifdef __cplusplus
}
#endif
