#include "max_pool_int8.h"

void maxPoolInt8(const layerInt8_t *layer, const int8_t *input, int8_t *output) {
  const int32_t channels = layer->inChannels;
  const int32_t rowStride = layer->inColumns * channels;

  for (int32_t row = 0; row < layer->outRows; row++) {
    for (int32_t column = 0; column < layer->outColumns; column++) {
      const int8_t *block =
          input + row * layer->kernelRows * rowStride + column * layer->kernelColumns * channels;
      for (int32_t channel = 0; channel < channels; channel++) {
        int8_t largest = INT8_MIN;
        for (int32_t i = 0; i < layer->kernelRows; i++) {
          for (int32_t j = 0; j < layer->kernelColumns; j++) {
            const int8_t value = block[i * rowStride + j * channels + channel];
            largest = value > largest ? value : largest;
          }
        }
        *output++ = largest;
      }
    }
  }
}
