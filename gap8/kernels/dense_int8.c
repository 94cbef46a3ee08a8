#include "dense_int8.h"

#include "dot_int8.h"
#include "requantise.h"

void denseInt8(const layerInt8_t *layer, const int8_t *input, int8_t *output) {
  const int32_t inputs = layer->inRows * layer->inColumns * layer->inChannels;
  const int8_t *weights = layer->weights;

  for (int32_t channel = 0; channel < layer->outChannels; channel++, weights += inputs) {
    const int32_t sum = layer->bias[channel] + dotInt8(input, weights, inputs);
    output[channel] = requantise(sum, layer->multiplier[channel], layer->shift[channel],
                                 layer->outputZeroPoint, layer->outputMin, layer->outputMax);
  }
}
