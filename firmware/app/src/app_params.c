#include <math.h>

#include "app_core.h"
#include "sample_guard.h"

void appParamsDefaults(appParams_t *params) {
  *params = (appParams_t){
      .enable = 1,
      .detector = APP_BEST_GAP8,
      .filter = APP_FILTER_AS_TRAINED,
      .bandLow = AIRTOUCH_BAND_LOW_HZ,
      .bandHigh = AIRTOUCH_BAND_HIGH_HZ,
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
  const float right = isfinite(*value) ? clampFloat(*value, low, high) : usual;
  const uint16_t changed = right != *value;
  *value = right;
  return changed;
}

/** Two settings of which the first must be the smaller one. */
static uint16_t order(float *low, float *high, bool fit, float usualLow, float usualHigh) {
  if (fit) {
    return 0;
  }
  const uint16_t changed = (uint16_t)((*low != usualLow) + (*high != usualHigh));
  *low = usualLow;
  *high = usualHigh;
  return changed;
}

static bool bandFits(float low, float high) {
  const uint16_t bins = bandPowerBins(AIRTOUCH_SAMPLE_RATE_HZ, AIRTOUCH_BAND_WINDOW, low, high, NULL);
  return bins > 0 && bins <= EDGE_PIPELINE_MAX_BINS;
}

uint16_t appParamsClamp(appParams_t *params) {
  appParams_t usual;
  appParamsDefaults(&usual);
  uint16_t changed = clampByte(&params->enable, 1);
  changed = (uint16_t)(changed + clampByte(&params->detector, APP_PAPER_GAP8));
  changed = (uint16_t)(changed + clampByte(&params->filter, APP_FILTER_AS_TRAINED));
  changed = (uint16_t)(changed + clampSetting(&params->bandLow, 1.0f, 48.0f, usual.bandLow));
  changed = (uint16_t)(changed + clampSetting(&params->bandHigh, 1.0f, 48.0f, usual.bandHigh));
  changed = (uint16_t)(changed + clampSetting(&params->pFa, 1e-12f, 0.5f, usual.pFa));
  changed = (uint16_t)(changed + clampSetting(&params->probabilityIn, 0.01f, 0.99f, usual.probabilityIn));
  changed = (uint16_t)(changed + clampSetting(&params->probabilityOut, 0.01f, 0.99f, usual.probabilityOut));
  changed = (uint16_t)(changed + clampSetting(&params->scoreIn, -8.0f, 12.0f, usual.scoreIn));
  changed = (uint16_t)(changed + clampSetting(&params->scoreOut, -8.0f, 12.0f, usual.scoreOut));
  changed = (uint16_t)(changed + order(&params->bandLow, &params->bandHigh, bandFits(params->bandLow, params->bandHigh),
                                       usual.bandLow, usual.bandHigh));
  changed = (uint16_t)(changed + order(&params->probabilityOut, &params->probabilityIn,
                                       params->probabilityOut < params->probabilityIn, usual.probabilityOut,
                                       usual.probabilityIn));
  return changed;
}
