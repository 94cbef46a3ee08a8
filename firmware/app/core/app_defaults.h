/**
 * @file app_defaults.h
 * The settings as shipped, as an initialiser. A variable that begins with them lies in .data, so that the firmware
 * finds the defaults of the PARAM group in the image (paramGetDefault() in param_logic.c).
 */
#pragma once

#include "airtouch_model.h"
#include "airtouch_parameters.h"
#include "airtouch_stream.h"
#include "app_core.h"

/** Of an appParams_t. */
#define APP_PARAMS_DEFAULTS                                             \
  {                                                                     \
      .enable = 1,                                                      \
      .detector = APP_BEST,                                             \
      .filter = APP_FILTER_AS_TRAINED,                                  \
      .bandMid = 0.5f * (AIRTOUCH_BAND_LOW_HZ + AIRTOUCH_BAND_HIGH_HZ), \
      .bandWidth = AIRTOUCH_BAND_HIGH_HZ - AIRTOUCH_BAND_LOW_HZ,        \
      .pFa = AIRTOUCH_P_FA,                                             \
      .probabilityIn = AIRTOUCH_MODEL_PROBABILITY_ENTRY,                \
      .probabilityOut = AIRTOUCH_MODEL_PROBABILITY_EXIT,                \
      .scoreIn = AIRTOUCH_STREAM_ENTRY_SCORE,                           \
      .scoreOut = AIRTOUCH_STREAM_EXIT_SCORE,                           \
      .probabilityDwell = AIRTOUCH_MODEL_DWELL_SAMPLES,                 \
      .alertHold = AIRTOUCH_MODEL_ALERT_HOLD,                           \
  }
