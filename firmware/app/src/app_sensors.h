/**
 * @file app_sensors.h
 * One sample out of the firmware's log variables, or of the 1 kHz tap where it is built in.
 */
#pragma once

#include <stdbool.h>

#include "app_types.h"

/** Looks the log variables up. @return false where one that the app needs is missing: it reads as NaN. */
bool appSensorsInit(void);

/** The sensors' values of now. Never waits. */
void appSensorsRead(appSample_t *sample);
