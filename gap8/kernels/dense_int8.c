#include "dense_int8.h"

#include "dot_int8.h"
#include "requantise.h"

void denseInt8(const jobInt8_t *job) {
  const layerInt8_t *layer = job->layer;
  const outputRange_t range = outputRange(layer);
  const int32_t inputs = layer->inRows * layer->inColumns * layer->inChannels;
  const int32_t pairs = (layer->outChannels + 1) / 2;
  const int32_t end = shareBegin(pairs, job->core + 1, job->cores);

  for (int32_t pair = shareBegin(pairs, job->core, job->cores); pair < end; pair++) {
    const int32_t one = 2 * pair;
    const int32_t two = one + 1 < layer->outChannels ? one + 1 : one;
    const int8_t *x = job->input;
    const int8_t *a = layer->weights + one * inputs;
    const int8_t *b = layer->weights + two * inputs;
    int32_t first = layer->bias[one], second = layer->bias[two], left = inputs;
    for (; left >= 4; left -= 4, x += 4, a += 4, b += 4) {
      for (int32_t i = 0; i < 4; i += UNIT) {
        const int32_t value = loadUnit(x + i);
        first = multiplyAdd(value, loadUnit(a + i), first);
        second = multiplyAdd(value, loadUnit(b + i), second);
      }
    }
    for (; left > 0; left--) {
      first += *x * *a++;
      second += *x++ * *b++;
    }
    job->output[one] = requantise(requantiser(layer, one, range), first);
    job->output[two] = requantise(requantiser(layer, two, range), second);
  }
}
