#include "network_batch.h"

#include <math.h>

#include "feature_window.h"
#include "network_float.h"
#include "network_int8.h"
#include "network_unpack.h"

enum { SHAPE_COLUMNS = 12 };

static int32_t inputs(const int32_t *shape) { return shape[1] * shape[2] * shape[3]; }

// Weights of a float layer; 0 for a pool.
static int32_t floatWeights(const int32_t *shape) {
  if (shape[0] == LAYER_CONV) {
    return shape[6] * shape[7] * shape[8] * shape[3];
  }
  return shape[0] == LAYER_DENSE ? shape[6] * inputs(shape) : 0;
}

// How far the layers before one have used the flat arrays.
typedef struct {
  int32_t weight;
  int32_t channel;
  int32_t sparseChannel;
  int32_t block;
} place_t;

static int sparse(const int32_t *shape) { return shape[0] == LAYER_SPARSE_DENSE || shape[0] == LAYER_SPARSE_CONV; }

// One layer, with pointers to where its arrays begin.
static layerInt8_t layerAt(const flatNetworkInt8_t *flat, const int32_t *shape, const place_t *at) {
  return (layerInt8_t){.kind = shape[0],
                       .inRows = shape[1],
                       .inColumns = shape[2],
                       .inChannels = shape[3],
                       .outRows = shape[4],
                       .outColumns = shape[5],
                       .outChannels = shape[6],
                       .kernelRows = shape[7],
                       .kernelColumns = shape[8],
                       .outputZeroPoint = shape[9],
                       .outputMin = shape[10],
                       .outputMax = shape[11],
                       .weights = flat->weights + at->weight,
                       .bias = flat->bias + at->channel,
                       .multiplier = flat->multiplier + at->channel,
                       .shift = flat->shift + at->channel,
                       .blockCounts = flat->blockCounts + at->sparseChannel,
                       .blockSkips = flat->blockSkips + at->block};
}

// Moves past the blocks of a sparse layer; 0 where one lies outside the arrays or the layer's input.
static int passBlocks(const flatNetworkInt8_t *flat, const int32_t *shape, place_t *at) {
  const int32_t filter = shape[0] == LAYER_SPARSE_CONV ? shape[7] * shape[8] * shape[3] : inputs(shape);
  for (int32_t output = 0; output < shape[6]; output++) {
    int32_t reached = 0;  // blocks of input passed over or used
    for (int32_t blocks = flat->blockCounts[at->sparseChannel++]; blocks > 0; blocks--) {
      if (at->block >= flat->blockCount) {
        return 0;
      }
      reached += flat->blockSkips[at->block++] + 1;
      at->weight += 4;
    }
    if (4 * reached > filter) {
      return 0;
    }
  }
  return 1;
}

int32_t unpackLayersInt8(const flatNetworkInt8_t *flat, layerInt8_t *layers) {
  place_t at = {0, 0, 0, 0};
  if (flat->layerCount < 1 || flat->layerCount > MAX_LAYERS) {
    return 0;
  }
  for (int32_t i = 0; i < flat->layerCount; i++) {
    const int32_t *shape = flat->shapes + i * SHAPE_COLUMNS;
    layers[i] = layerAt(flat, shape, &at);
    at.channel += shape[0] == LAYER_MAX_POOL ? 0 : shape[6];
    if (at.channel > flat->channelCount || (sparse(shape) && !passBlocks(flat, shape, &at))) {
      return i;
    }
    at.weight = (at.weight + layerWeights(&layers[i]) + 3) & ~3;  // each layer's weights are aligned to 4
    if (at.weight > flat->weightCount) {
      return i;
    }
  }
  return -1;
}

// The network with pointers into the flat arrays; -1, or the first layer that does not fit.
static int32_t unpackInt8(const flatNetworkInt8_t *flat, layerInt8_t *layers, networkInt8_t *network) {
  const int32_t wrong = unpackLayersInt8(flat, layers);
  *network = (networkInt8_t){.layers = layers,
                             .layerCount = flat->layerCount,
                             .inputScale = flat->inputScale,
                             .inputZeroPoint = flat->inputZeroPoint};
  return wrong >= 0 ? wrong : networkInt8Check(network);
}

static void unpackFloat(const flatNetworkFloat_t *flat, layerFloat_t *layers, networkFloat_t *network) {
  const float *weight = flat->weights;
  const float *bias = flat->bias;
  for (int32_t i = 0; i < flat->layerCount; i++) {
    const int32_t *s = flat->shapes + i * SHAPE_COLUMNS;
    layers[i] = (layerFloat_t){.kind = s[0],
                               .inRows = s[1],
                               .inColumns = s[2],
                               .inChannels = s[3],
                               .outRows = s[4],
                               .outColumns = s[5],
                               .outChannels = s[6],
                               .kernelRows = s[7],
                               .kernelColumns = s[8],
                               .relu = s[9],
                               .weights = weight,
                               .bias = bias};
    weight += floatWeights(s);
    bias += s[0] == LAYER_MAX_POOL ? 0 : s[6];
  }
  *network = (networkFloat_t){.layers = layers, .layerCount = flat->layerCount};
}

int32_t networkInt8BatchArena(const flatNetworkInt8_t *flat) {
  layerInt8_t layers[MAX_LAYERS];
  networkInt8_t network;
  const int32_t wrong = unpackInt8(flat, layers, &network);
  return wrong < 0 ? networkInt8ArenaBytes(&network) : -1 - wrong;
}

int32_t networkFloatBatchArena(const flatNetworkFloat_t *flat) {
  layerFloat_t layers[MAX_LAYERS];
  networkFloat_t network;
  int32_t weight = 0, channel = 0;
  if (flat->layerCount < 1 || flat->layerCount > MAX_LAYERS) {
    return -1;
  }
  for (int32_t i = 0; i < flat->layerCount; i++) {
    const int32_t *s = flat->shapes + i * SHAPE_COLUMNS;
    weight += floatWeights(s);
    channel += s[0] == LAYER_MAX_POOL ? 0 : s[6];
    if (s[0] > LAYER_DENSE || weight > flat->weightCount || channel > flat->channelCount) {
      return -1 - i;
    }
  }
  unpackFloat(flat, layers, &network);
  return networkFloatArenaSize(&network);
}

void networkInt8Batch(const flatNetworkInt8_t *flat, const int8_t *rows, int32_t count, int8_t *arena,
                      int8_t *outputs) {
  layerInt8_t layers[MAX_LAYERS];
  networkInt8_t network;
  if (unpackInt8(flat, layers, &network) >= 0) {
    return;
  }
  const int32_t inputCount = inputs(flat->shapes);
  const layerInt8_t *last = &layers[flat->layerCount - 1];
  const int32_t outputCount = last->outRows * last->outColumns * last->outChannels;
  for (int32_t i = 0; i < count; i++) {
    const int8_t *result = networkInt8Run(&network, rows + (int64_t)i * inputCount, arena);
    for (int32_t j = 0; j < outputCount; j++) {
      *outputs++ = result[j];
    }
  }
}

void networkFloatBatch(const flatNetworkFloat_t *flat, const float *rows, int32_t count, float *arena, float *outputs) {
  layerFloat_t layers[MAX_LAYERS];
  networkFloat_t network;
  unpackFloat(flat, layers, &network);
  const int32_t inputCount = inputs(flat->shapes);
  const layerFloat_t *last = &layers[flat->layerCount - 1];
  const int32_t outputCount = last->outRows * last->outColumns * last->outChannels;
  for (int32_t i = 0; i < count; i++) {
    const float *result = networkFloatRun(&network, rows + (int64_t)i * inputCount, arena);
    for (int32_t j = 0; j < outputCount; j++) {
      *outputs++ = result[j];
    }
  }
}

void networkInt8BatchQuantise(const flatNetworkInt8_t *flat, const float *x, int32_t count, int8_t *q) {
  const networkInt8_t network = {.inputScale = flat->inputScale, .inputZeroPoint = flat->inputZeroPoint};
  networkInt8Quantise(&network, x, count, q);
}

void networkInt8Flight(const flatNetworkInt8_t *flat, const float *features, int32_t samples, int32_t columns,
                       int32_t rows, float *window, int8_t *quantised, int8_t *arena, int8_t *outputs, uint8_t *valid) {
  layerInt8_t layers[MAX_LAYERS];
  networkInt8_t network;
  if (unpackInt8(flat, layers, &network) >= 0) {
    return;
  }
  const layerInt8_t *last = &layers[flat->layerCount - 1];
  const int32_t outputCount = last->outRows * last->outColumns * last->outChannels;
  int32_t finite = 0;  // finite rows in a row, up to this one
  for (int32_t i = 0; i < samples; i++) {
    int32_t usable = 1;
    for (int32_t c = 0; c < columns; c++) {
      usable = usable && isfinite(features[i * columns + c]);
    }
    finite = usable ? finite + 1 : 0;
    valid[i] = finite >= rows;
    if (valid[i]) {
      zScoreWindow(features + (i - rows + 1) * columns, (uint16_t)rows, (uint16_t)columns, window);
      networkInt8Quantise(&network, window, rows * columns, quantised);
      const int8_t *result = networkInt8Run(&network, quantised, arena);
      for (int32_t j = 0; j < outputCount; j++) {
        outputs[i * outputCount + j] = result[j];
      }
    }
  }
}
