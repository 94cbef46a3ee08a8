#include "fr_cfar_batch.h"

#include <math.h>
#include <stdbool.h>

#include "fr_cfar.h"

static bool start(frCfar_t *cfar, int32_t leadingWindow, int32_t guardCells, float pFa, float *ring) {
  return leadingWindow > 0 && leadingWindow <= UINT16_MAX && guardCells >= 0 && guardCells <= UINT16_MAX &&
         frCfarInit(cfar, (uint16_t)leadingWindow, (uint16_t)guardCells, pFa, ring,
                    (size_t)leadingWindow + (size_t)guardCells);
}

int32_t frCfarBatch(const float *power, int64_t samples, int32_t leadingWindow, int32_t guardCells, float pFa,
                    float *ring, float *threshold, uint8_t *alert) {
  frCfar_t cfar;
  if (!start(&cfar, leadingWindow, guardCells, pFa, ring)) {
    return -1;
  }
  for (int64_t i = 0; i < samples; i++) {
    alert[i] = frCfarStep(&cfar, power[i], &threshold[i]);
  }
  return 0;
}

float frCfarFactor(int32_t leadingWindow, int32_t guardCells, float pFa, float *ring) {
  frCfar_t cfar;
  return start(&cfar, leadingWindow, guardCells, pFa, ring) ? cfar.factor * (float)leadingWindow : NAN;
}
