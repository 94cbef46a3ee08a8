#include "rolling_batch.h"

#include <stddef.h>

#include "fixed_scale.h"
#include "network_unpack.h"
#include "rolling_int8.h"

// 1, or 0 where the arrays do not make a network.
static int32_t unpack(const flatNetworkInt8_t *flat, layerInt8_t *layers, networkInt8_t *network) {
  if (unpackLayersInt8(flat, layers) >= 0) {
    return 0;
  }
  *network = (networkInt8_t){.layers = layers, .layerCount = flat->layerCount};
  return networkInt8Check(network) < 0;
}

int32_t rollingInt8BatchArena(const flatNetworkInt8_t *flat, int32_t stride, int32_t *ahead, int32_t *receptive) {
  layerInt8_t layers[MAX_LAYERS];
  networkInt8_t network;
  rollingInt8_t rolling;
  if (!unpack(flat, layers, &network) || !rollingInt8Plan(&rolling, &network, stride)) {
    return 0;
  }
  *ahead = rolling.ahead;
  *receptive = rolling.receptiveSamples;
  return rollingInt8ArenaBytes(&network, stride);
}

void rollingInt8Flight(const flatNetworkInt8_t *flat, const int8_t *inputs, const uint8_t *usable, int32_t samples,
                       int32_t stride, int8_t *arena, int8_t *outputs, uint8_t *valid) {
  layerInt8_t layers[MAX_LAYERS];
  networkInt8_t network;
  rollingInt8_t rolling;
  if (!unpack(flat, layers, &network) || !rollingInt8Init(&rolling, &network, stride, arena)) {
    return;
  }
  const int32_t width = layers[0].inColumns * layers[0].inChannels;
  const int32_t outputCount = layers[flat->layerCount - 1].outChannels;
  for (int32_t i = 0; i < samples; i++) {
    const int8_t *row = NULL;
    if (usable[i]) {
      row = rollingInt8Step(&rolling, inputs + (int64_t)i * width);
    } else {
      rollingInt8Reset(&rolling);
    }
    valid[i] = row != NULL;
    for (int32_t o = 0; row != NULL && o < outputCount; o++) {
      outputs[(int64_t)i * outputCount + o] = row[o];
    }
  }
}

void fixedScaleBatch(const float *mean, const float *inverseDeviation, const float *features, int32_t samples,
                     int32_t columns, float *x) {
  fixedScale_t scale = {.columns = columns};
  for (int32_t c = 0; c < columns && c < FIXED_SCALE_MAX_COLUMNS; c++) {
    scale.mean[c] = mean[c];
    scale.inverseDeviation[c] = inverseDeviation[c];
  }
  for (int32_t i = 0; i < samples; i++) {
    fixedScaleApply(&scale, features + (int64_t)i * columns, x + (int64_t)i * columns);
  }
}
