#include "sparse_dense_int8.h"

#include "dot_int8.h"
#include "requantise.h"

enum { OUTPUT_COST = 6 };  // what an output costs beside its blocks, in blocks

void sparseDenseInt8(const jobInt8_t *job) {
  const layerInt8_t *layer = job->layer;
  const outputRange_t range = outputRange(layer);
  int32_t cost = 0;
  for (int32_t channel = 0; channel < layer->outChannels; channel++) {
    cost += layer->blockCounts[channel] + OUTPUT_COST;
  }
  // An output is done by the core in whose share of the cost its middle lies.
  const int32_t begin = shareBegin(cost, job->core, job->cores);
  const int32_t end = shareBegin(cost, job->core + 1, job->cores);
  const int8_t *weights = layer->weights;
  const uint8_t *skip = layer->blockSkips;
  int32_t before = 0;

  for (int32_t channel = 0; channel < layer->outChannels; channel++) {
    const int32_t blocks = layer->blockCounts[channel];
    const int32_t middle = before + (blocks + OUTPUT_COST) / 2;
    before += blocks + OUTPUT_COST;
    if (middle < begin || middle >= end) {
      weights += 4 * blocks;
      skip += blocks;
      continue;
    }
    const int8_t *x = job->input;
    int32_t sum = layer->bias[channel];
    for (int32_t block = blocks; block > 0; block--, x += 4, weights += 4) {
      x += 4 * (int32_t)*skip++;
      for (int32_t i = 0; i < 4; i += UNIT) {
        sum = multiplyAdd(loadUnit(x + i), loadUnit(weights + i), sum);
      }
    }
    job->output[channel] = requantise(requantiser(layer, channel, range), sum);
  }
}
