#include "max_pool_int8.h"

#include "xpulp.h"

static void largest(const layerInt8_t *layer, const int8_t *block, int8_t *output) {
  const int32_t channels = layer->inChannels;
  const int32_t rowStride = layer->inColumns * channels;
  int32_t channel = 0;
#if AIRTOUCH_XPULP
  for (; channels % 4 == 0 && channel < channels; channel += 4) {
    int32_t most = xpulpLoad4(block + channel);
    for (int32_t i = 0; i < layer->kernelRows; i++) {
      for (int32_t j = 0; j < layer->kernelColumns; j++) {
        most = xpulpMax4(most, xpulpLoad4(block + i * rowStride + j * channels + channel));
      }
    }
    xpulpStore4(output + channel, most);
  }
#endif
  for (; channel < channels; channel++) {
    int8_t most = block[channel];
    for (int32_t i = 0; i < layer->kernelRows; i++) {
      for (int32_t j = 0; j < layer->kernelColumns; j++) {
        const int8_t value = block[i * rowStride + j * channels + channel];
        most = (int8_t)(value > most ? value : most);
      }
    }
    output[channel] = most;
  }
}

void maxPoolInt8(const jobInt8_t *job) {
  const layerInt8_t *layer = job->layer;
  const int32_t channels = layer->inChannels;
  const int32_t places = layer->outRows * layer->outColumns;
  const int32_t end = shareBegin(places, job->core + 1, job->cores);
  for (int32_t place = shareBegin(places, job->core, job->cores); place < end; place++) {
    const int32_t row = place / layer->outColumns * layer->kernelRows;
    const int32_t column = place % layer->outColumns * layer->kernelColumns;
    largest(layer, job->input + (row * layer->inColumns + column) * channels, job->output + place * channels);
  }
}
