/**
 * @file app_level.h
 * From the axes that the firmware logs to those that the detectors were trained in: level,
 * x where the nose points.
 */
#pragma once

#include "app_types.h"
#include "kernel_types.h"

/**
 * Fills @p level with @p sample: acceleration and thrust axis turned level, the rest as it is.
 * Without an attitude the acceleration stays as it is and the thrust axis is not known.
 */
void appLevel(const appSample_t *sample, edgeSample_t *level);
