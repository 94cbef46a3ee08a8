#include <math.h>

#include "app_core.h"
#include "sample_guard.h"

void appParamsDefaults(appParams_t *params) {
  *params = (appParams_t){
      .enable = 1,
      .detector = APP_BEST_GAP8,
      .filter = APP_FILTER_AS_TRAINED,
      .bandMid = 0.5f * (AIRTOUCH_BAND_LOW_HZ + AIRTOUCH_BAND_HIGH_HZ),
      .bandWidth = AIRTOUCH_BAND_HIGH_HZ - AIRTOUCH_BAND_LOW_HZ,
      .pFa = AIRTOUCH_P_FA,
      .probabilityIn = APP_PAPER_PROBABILITY_IN,
      .probabilityOut = APP_PAPER_PROBABILITY_OUT,
      .scoreIn = airtouchStreamDecoder.entryScore,
      .scoreOut = airtouchStreamDecoder.exitScore,
  };
}

static uint16_t clampByte(uint8_t *value, uint8_t high) {
  if (*value <= high) {
    return 0;
  }
  *value = high;
  return 1;
}

static uint16_t clampSetting(float *value, float low, float high, float usual) {
  const float right = clampFloat(isfinite(*value) ? *value : usual, low, high);
  const uint16_t changed = right != *value;
  *value = right;
  return changed;
}

uint16_t appParamsClamp(appParams_t *params) {
  appParams_t usual;
  appParamsDefaults(&usual);
  uint16_t changed = clampByte(&params->enable, 1);
  changed = (uint16_t)(changed + clampByte(&params->detector, APP_PAPER_GAP8));
  changed = (uint16_t)(changed + clampByte(&params->filter, APP_FILTER_AS_TRAINED));
  // 5 bins of 0.5 Hz are all that the band's storage has room for, at least one must lie within.
  changed = (uint16_t)(changed + clampSetting(&params->bandWidth, 0.6f, 2.0f, usual.bandWidth));
  changed = (uint16_t)(changed + clampSetting(&params->bandMid, 2.0f, 48.0f, usual.bandMid));
  changed = (uint16_t)(changed + clampSetting(&params->pFa, 1e-12f, 0.5f, usual.pFa));
  changed = (uint16_t)(changed + clampSetting(&params->probabilityIn, 0.02f, 0.99f, usual.probabilityIn));
  const float below = params->probabilityIn - 0.01f;
  changed = (uint16_t)(changed + clampSetting(&params->probabilityOut, 0.01f, below, usual.probabilityOut));
  changed = (uint16_t)(changed + clampSetting(&params->scoreIn, -8.0f, 12.0f, usual.scoreIn));
  return (uint16_t)(changed + clampSetting(&params->scoreOut, -8.0f, 12.0f, usual.scoreOut));
}
