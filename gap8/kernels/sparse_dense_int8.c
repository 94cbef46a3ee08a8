#include "sparse_dense_int8.h"

#include "requantise.h"

void sparseDenseInt8(const layerInt8_t *layer, const int8_t *input, int8_t *output) {
  const int8_t *weights = layer->weights;
  const uint8_t *skip = layer->blockSkips;

  for (int32_t channel = 0; channel < layer->outChannels; channel++) {
    const int8_t *x = input;
    int32_t sum = layer->bias[channel];
    for (int32_t block = layer->blockCounts[channel]; block > 0; block--) {
      x += 4 * (int32_t)*skip++;
      sum += x[0] * weights[0] + x[1] * weights[1] + x[2] * weights[2] + x[3] * weights[3];
      x += 4;
      weights += 4;
    }
    output[channel] = requantise(sum, layer->multiplier[channel], layer->shift[channel],
                                 layer->outputZeroPoint, layer->outputMin, layer->outputMax);
  }
}
