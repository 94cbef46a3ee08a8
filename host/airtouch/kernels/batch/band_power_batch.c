#include "band_power_batch.h"

#include <stddef.h>

#include "band_power.h"

static int inRange(int32_t window, int32_t hop, int32_t channels) {
  return window > 0 && window <= UINT16_MAX && hop > 0 && hop <= UINT16_MAX && channels > 0 && channels <= UINT16_MAX;
}

int64_t bandPowerStateSize(void) { return (int64_t)sizeof(bandPower_t); }

int64_t bandPowerWork(float sampleRateHz, int32_t window, float lowHz, float highHz, int32_t channels) {
  if (!inRange(window, 1, channels)) {
    return 0;
  }
  const int64_t bins = bandPowerBins(sampleRateHz, (uint16_t)window, lowHz, highHz, NULL);
  return bins == 0 ? 0 : BAND_POWER_FLOATS((int64_t)window, (int64_t)channels, bins);
}

int64_t bandPowerBatch(const float *x, int64_t samples, int32_t channels, float sampleRateHz, int32_t window,
                       float lowHz, float highHz, int32_t hop, void *state, float *work, int64_t floats, int32_t reset,
                       float *power) {
  bandPower_t *bank = state;
  if (reset &&
      (!inRange(window, hop, channels) || !bandPowerInit(bank, sampleRateHz, (uint16_t)window, lowHz, highHz,
                                                         (uint16_t)hop, (uint16_t)channels, work, (size_t)floats))) {
    return -1;
  }
  int64_t rows = 0;
  for (int64_t i = 0; i < samples; i++) {
    rows += bandPowerStep(bank, x + i * channels, power + rows * channels);
  }
  return rows;
}
