#include "conv_int8.h"

#include "dot_int8.h"
#include "requantise.h"

void convInt8(const layerInt8_t *layer, const int8_t *input, int8_t *output) {
  // A row of the kernel is contiguous in HWC, so each is one dot product.
  const int32_t span = layer->kernelColumns * layer->inChannels;
  const int32_t rowStride = layer->inColumns * layer->inChannels;
  const int32_t filter = layer->kernelRows * span;

  for (int32_t row = 0; row < layer->outRows; row++) {
    for (int32_t column = 0; column < layer->outColumns; column++) {
      const int8_t *patch = input + row * rowStride + column * layer->inChannels;
      const int8_t *weights = layer->weights;
      for (int32_t channel = 0; channel < layer->outChannels; channel++, weights += filter) {
        int32_t sum = layer->bias[channel];
        for (int32_t tap = 0; tap < layer->kernelRows; tap++) {
          sum += dotInt8(patch + tap * rowStride, weights + tap * span, span);
        }
        *output++ = requantise(sum, layer->multiplier[channel], layer->shift[channel],
                               layer->outputZeroPoint, layer->outputMin, layer->outputMax);
      }
    }
  }
}
