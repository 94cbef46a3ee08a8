#include "app_paper.h"

#include <stddef.h>

#include "airtouch_model.h"
#include "airtouch_rolling.h"
#include "app_core.h"

const appPaper_t *appPaperOf(uint8_t detector) {
  static const appPaper_t paper = {
      .sha256 = AIRTOUCH_MODEL_SHA256,
      .outputScale = AIRTOUCH_MODEL_OUTPUT_SCALE,
      .probabilityIn = AIRTOUCH_MODEL_PROBABILITY_ENTRY,
      .probabilityOut = AIRTOUCH_MODEL_PROBABILITY_EXIT,
      .probabilityDwell = AIRTOUCH_MODEL_DWELL_SAMPLES,
      .alertHold = AIRTOUCH_MODEL_ALERT_HOLD,
      .refill = AIRTOUCH_MODEL_ROWS,
      .algorithm = EDGE_LINK_PAPER,
  };
  static const appPaper_t paperStream = {
      .sha256 = AIRTOUCH_ROLLING_SHA256,
      .outputScale = AIRTOUCH_ROLLING_OUTPUT_SCALE,
      .probabilityIn = AIRTOUCH_ROLLING_PROBABILITY_ENTRY,
      .probabilityOut = AIRTOUCH_ROLLING_PROBABILITY_EXIT,
      .probabilityDwell = AIRTOUCH_ROLLING_DWELL_SAMPLES,
      .alertHold = AIRTOUCH_ROLLING_ALERT_HOLD,
      .refill = AIRTOUCH_ROLLING_ROWS + AIRTOUCH_ROLLING_STRIDE - 1,
      .algorithm = EDGE_LINK_PAPER_STREAM,
  };
  switch (detector) {
    case APP_PAPER_GAP8: return &paper;
    case APP_PAPER_STREAM_GAP8: return &paperStream;
    default: return NULL;
  }
}

static float floatOr(float value, float shipped, float tuned) { return value == shipped ? tuned : value; }

static uint16_t stepsOr(uint16_t value, uint16_t shipped, uint16_t tuned) { return value == shipped ? tuned : value; }

void appPaperDecoding(const appPaper_t *paper, const appParams_t *params, edgePipelineConfig_t *config) {
  const appPaper_t *shipped = appPaperOf(APP_PAPER_GAP8);
  const appPaper_t *tuned = paper != NULL ? paper : shipped;
  const float in = floatOr(params->probabilityIn, shipped->probabilityIn, tuned->probabilityIn);
  const float out = floatOr(params->probabilityOut, shipped->probabilityOut, tuned->probabilityOut);
  config->probabilityEntry = in;
  const float below = in - 0.01f;  // one of them may have been set, the other not
  config->probabilityExit = out < below ? out : below;
  config->dwellSamples = stepsOr(params->probabilityDwell, shipped->probabilityDwell, tuned->probabilityDwell);
  config->alertHold = stepsOr(params->alertHold, shipped->alertHold, tuned->alertHold);
}
