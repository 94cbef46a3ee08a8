#include <math.h>
#include <string.h>

#include "app_core.h"
#include "app_defaults.h"
#include "sample_guard.h"

void appParamsDefaults(appParams_t *params) { *params = (appParams_t)APP_PARAMS_DEFAULTS; }

static uint16_t clampByte(uint8_t *value, uint8_t high) {
  if (*value <= high) {
    return 0;
  }
  *value = high;
  return 1;
}

static uint16_t clampSteps(uint16_t *value, uint16_t low, uint16_t high) {
  const uint16_t right = *value < low ? low : (*value > high ? high : *value);
  const uint16_t changed = right != *value;
  *value = right;
  return changed;
}

static uint16_t clampSetting(float *value, float low, float high, float shipped) {
  const float right = clampFloat(isfinite(*value) ? *value : shipped, low, high);
  const uint16_t changed = right != *value;
  *value = right;
  return changed;
}

uint16_t appParamsClamp(appParams_t *params) {
  appParams_t shipped;
  appParamsDefaults(&shipped);
  uint32_t changed = clampByte(&params->enable, 1);
  changed += clampByte(&params->detector, APP_PAPER_STREAM_GAP8);
  changed += clampByte(&params->filter, APP_FILTER_AS_TRAINED);
  // Hz: 5 bins of 0.5 Hz are all that the band's storage has room for, at least one must lie within.
  changed += clampSetting(&params->bandWidth, 0.6f, 2.0f, shipped.bandWidth);
  // Hz: a band of any width then lies between 1 and 49 Hz, above the mean's bin and below Nyquist's.
  changed += clampSetting(&params->bandMid, 2.0f, 48.0f, shipped.bandMid);
  // No source, round numbers: far within FLT_MIN to 1, all that FR-CFAR takes.
  changed += clampSetting(&params->pFa, 1e-12f, 0.5f, shipped.pFa);
  // Neither 0 nor 1, which a probability always or never reaches. appPaperDecoding keeps the exit below the entry.
  changed += clampSetting(&params->probabilityIn, 0.02f, 0.99f, shipped.probabilityIn);
  changed += clampSetting(&params->probabilityOut, 0.01f, 0.98f, shipped.probabilityOut);
  // Logits: what is compared with a score is at most 8 + 0.3 * 8 (edge_decoder.c, overShare), so 12 never fires. No
  // source for -8.
  changed += clampSetting(&params->scoreIn, -8.0f, 12.0f, shipped.scoreIn);
  changed += clampSetting(&params->scoreOut, -8.0f, 12.0f, shipped.scoreOut);
  // Steps of 10 ms, at most 10 s: no source, round numbers.
  changed += clampSteps(&params->probabilityDwell, 10, 1000);
  changed += clampSteps(&params->alertHold, 1, 1000);
  return (uint16_t)changed;
}

/** The same bits: NaN is then the same as itself. */
static bool sameFloat(float one, float other) {
  uint32_t bits[2];
  memcpy(&bits[0], &one, sizeof bits[0]);
  memcpy(&bits[1], &other, sizeof bits[1]);
  return bits[0] == bits[1];
}

bool appParamsSame(const appParams_t *one, const appParams_t *other) {
  return one->enable == other->enable && one->detector == other->detector && one->filter == other->filter &&
         sameFloat(one->bandMid, other->bandMid) && sameFloat(one->bandWidth, other->bandWidth) &&
         sameFloat(one->pFa, other->pFa) && sameFloat(one->probabilityIn, other->probabilityIn) &&
         sameFloat(one->probabilityOut, other->probabilityOut) && sameFloat(one->scoreIn, other->scoreIn) &&
         sameFloat(one->scoreOut, other->scoreOut) && one->probabilityDwell == other->probabilityDwell &&
         one->alertHold == other->alertHold;
}
