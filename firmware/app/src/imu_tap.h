/**
 * @file imu_tap.h
 * The 1 kHz tap, built in with CONFIG_CONTROLLER_OOT: an out-of-tree controller that is the
 * firmware's PID controller and notes the IMU's values on the way, so that the 100 Hz task has the
 * mean of ten instead of one of ten. It changes nothing that the drone does.
 */
#pragma once

#include <stdbool.h>

/** Means since the last read; g and degrees/s, body axes. */
typedef struct {
  float acc[3];
  float gyro[3];
} imuMean_t;

/** @return false where the controller was not called since the last read (another one is chosen, or none runs) */
bool imuTapRead(imuMean_t *mean);
