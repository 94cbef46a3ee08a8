#include "network_int8.h"

#include <stddef.h>

#include "conv_int8.h"
#include "dense_int8.h"
#include "max_pool_int8.h"
#include "requantise.h"
#include "sparse_dense_int8.h"

static int32_t inputSize(const layerInt8_t *layer) { return layer->inRows * layer->inColumns * layer->inChannels; }

static int32_t outputSize(const layerInt8_t *layer) { return layer->outRows * layer->outColumns * layer->outChannels; }

/** Layers that step i takes: two where a pool is done with the convolution before it. */
static int32_t layersOfStep(const networkInt8_t *network, int32_t i) {
  const int32_t kind = network->layers[i].kind;
  const bool conv = kind == LAYER_CONV || kind == LAYER_SPARSE_CONV;
  return conv && i + 1 < network->layerCount && convCanPool(&network->layers[i + 1]) ? 2 : 1;
}

int32_t networkInt8ArenaBytes(const networkInt8_t *network) {
  int32_t largest = 0;
  for (int32_t i = 0; i < network->layerCount; i += layersOfStep(network, i)) {
    const layerInt8_t *last = &network->layers[i + layersOfStep(network, i) - 1];
    const int32_t bytes = (i > 0 ? alignedBytes(inputSize(&network->layers[i])) : 0) + alignedBytes(outputSize(last));
    largest = bytes > largest ? bytes : largest;
  }
  return largest;
}

static bool layerFits(const layerInt8_t *layer) {
  if (!shapeFits(layer->inRows, layer->inColumns, layer->inChannels) ||
      !shapeFits(layer->outRows, layer->outColumns, layer->outChannels) ||
      !shapeFits(layer->kernelRows, layer->kernelColumns, layer->inChannels)) {
    return false;
  }
  switch (layer->kind) {
    case LAYER_CONV:
    case LAYER_SPARSE_CONV: {
      const int32_t filter = layer->kernelRows * layer->kernelColumns * layer->inChannels;
      return filter <= CONV_MAX_FILTER && (layer->kind == LAYER_CONV || filter % 4 == 0) && layer->outRows >= 1 &&
             layer->outRows == layer->inRows - layer->kernelRows + 1 && layer->outColumns >= 1 &&
             layer->outColumns == layer->inColumns - layer->kernelColumns + 1;
    }
    case LAYER_MAX_POOL:
      return layer->outRows >= 1 && layer->outRows == layer->inRows / layer->kernelRows && layer->outColumns >= 1 &&
             layer->outColumns == layer->inColumns / layer->kernelColumns && layer->outChannels == layer->inChannels;
    case LAYER_DENSE: return layer->outRows == 1 && layer->outColumns == 1;
    case LAYER_SPARSE_DENSE: return layer->outRows == 1 && layer->outColumns == 1 && inputSize(layer) % 4 == 0;
    default: return false;
  }
}

int32_t networkInt8Check(const networkInt8_t *network) {
  for (int32_t i = 0; i < network->layerCount; i++) {
    const layerInt8_t *layer = &network->layers[i];
    if (!layerFits(layer) || (i > 0 && inputSize(layer) != outputSize(layer - 1))) {
      return i;
    }
  }
  return -1;
}

void networkInt8Quantise(const networkInt8_t *network, const float *x, int32_t count, int8_t *q) {
  for (int32_t i = 0; i < count; i++) {
    q[i] = quantiseInput(x[i], network->inputScale, network->inputZeroPoint);
  }
}

void layerInt8Run(const jobInt8_t *job) {
  switch (job->layer->kind) {
    case LAYER_CONV:
    case LAYER_SPARSE_CONV: convInt8(job); break;
    case LAYER_MAX_POOL: maxPoolInt8(job); break;
    case LAYER_DENSE: denseInt8(job); break;
    default: sparseDenseInt8(job); break;
  }
}

const int8_t *networkInt8RunTeam(const networkInt8_t *network, const int8_t *input, int8_t *arena,
                                 const teamInt8_t *team) {
  // Outputs alternate between the start and the end of the arena, so that a step
  // never writes over its own input.
  const int32_t bytes = networkInt8ArenaBytes(network);
  const int8_t *x = input;
  bool atEnd = false;
  for (int32_t i = 0; i < network->layerCount; i += layersOfStep(network, i)) {
    const bool pooled = layersOfStep(network, i) > 1;
    const layerInt8_t *last = &network->layers[pooled ? i + 1 : i];
    int8_t *y = atEnd ? arena + bytes - alignedBytes(outputSize(last)) : arena;
    layerInt8Run(&(jobInt8_t){.layer = &network->layers[i],
                              .pool = pooled ? last : NULL,
                              .input = x,
                              .output = y,
                              .core = team->core,
                              .cores = team->cores});
    if (team->barrier != NULL) {
      team->barrier(team->context);
    }
    x = y;
    atEnd = !atEnd;
  }
  return x;
}

const int8_t *networkInt8Run(const networkInt8_t *network, const int8_t *input, int8_t *arena) {
  return networkInt8RunTeam(network, input, arena, &(teamInt8_t){.core = 0, .cores = 1});
}
