/**
 * @file made_layer.h
 * Layers of any small shape with any weights, in memory of exactly their size, and what each must give: its definition
 * one output at a time, with the rounding of gemmlowp as its source has it.
 */
#pragma once

#include "conv_int8.h"
#include "fuzz.h"
#include "layer_int8.h"

#define MADE_OUTPUTS 12   ///< channels of a layer, at most
#define MADE_VALUES 1200  ///< of an input or output, at most

/** A layer and the memory that it points to. */
typedef struct {
  layerInt8_t layer;
  int8_t *dense;   ///< weights one by one, [output][input], also of a sparse layer
  int32_t inputs;  ///< of one output
} made_t;

static inline int32_t sizeIn(const layerInt8_t *layer) { return layer->inRows * layer->inColumns * layer->inChannels; }

static inline int32_t sizeOut(const layerInt8_t *layer) {
  return layer->outRows * layer->outColumns * layer->outChannels;
}

static inline bool isConvLayer(const layerInt8_t *layer) {
  return layer->kind == LAYER_CONV || layer->kind == LAYER_SPARSE_CONV;
}

static inline bool isSparse(const layerInt8_t *layer) {
  return layer->kind == LAYER_SPARSE_DENSE || layer->kind == LAYER_SPARSE_CONV;
}

/** gemmlowp's SaturatingRoundingDoublingHighMul(), then RoundingDivideByPOT(). */
static inline int32_t gemmlowp(int32_t x, int32_t multiplier, int32_t shift) {
  const int32_t shifted = shift > 0 ? (int32_t)((uint32_t)x << shift) : x;
  const int64_t product = (int64_t)shifted * multiplier;
  const int64_t nudge = product >= 0 ? 1 << 30 : 1 - (1 << 30);
  const int32_t high = (int32_t)((product + nudge) / (INT64_C(1) << 31));
  const int32_t right = shift < 0 ? -shift : 0;
  const int32_t mask = (int32_t)((INT64_C(1) << right) - 1), rest = high & mask;
  return (high >> right) + (rest > (mask >> 1) + (high < 0) ? 1 : 0);
}

/** Takes constants: an output range, and for each output a bias and a scale below 2. */
static inline void takeConstants(bytes_t *bytes, layerInt8_t *layer) {
  const int32_t a = (int8_t)takeByte(bytes), b = (int8_t)takeByte(bytes);
  layer->outputMin = a < b ? a : b;
  layer->outputMax = a < b ? b : a;
  layer->outputZeroPoint = (int8_t)takeByte(bytes);
  const size_t outputs = (size_t)layer->outChannels;
  int32_t *bias = rubbish(outputs * sizeof *bias, 0), *multiplier = rubbish(outputs * sizeof *multiplier, 0);
  int8_t *shift = rubbish(outputs, 0);
  for (size_t o = 0; o < outputs; o++) {
    const int32_t wide = (int32_t)takeWord(bytes) >> 8;
    bias[o] = takeByte(bytes) & 1 ? wide : wide >> 12;
    multiplier[o] = (int32_t)(0x40000000u | takeWord(bytes) >> 2);  // as training makes them: from a half up to one
    shift[o] = (int8_t)takeBetween(bytes, -20, 1);
  }
  layer->bias = bias;
  layer->multiplier = multiplier;
  layer->shift = shift;
}

static inline int8_t takeWeight(bytes_t *bytes, uint32_t *seed) {
  const uint8_t byte = bytes->left > 0 ? takeByte(bytes) : (uint8_t)(int8_t)(127.0f * noise(seed));
  return (int8_t)byte == -128 ? -127 : (int8_t)byte;
}

/** Blocks of four for each output, with gaps; the weights between them are zero. */
static inline void takeBlocks(bytes_t *bytes, made_t *made, uint32_t *seed) {
  layerInt8_t *layer = &made->layer;
  const int32_t most = made->inputs / 4;
  const size_t room = (size_t)(layer->outChannels * most);
  uint16_t *counts = rubbish((size_t)layer->outChannels * sizeof *counts, 0);
  int8_t *weights = malloc(4 * room > 0 ? 4 * room : 1);
  uint8_t *skips = malloc(room > 0 ? room : 1);
  size_t blocks = 0;
  for (int32_t o = 0; o < layer->outChannels; o++) {
    for (int32_t at = takeByte(bytes) % 4, last = -1; at < most; last = at, at += 1 + takeByte(bytes) % 4) {
      skips[blocks] = (uint8_t)(at - last - 1);
      for (int32_t i = 0; i < 4; i++) {
        made->dense[o * made->inputs + 4 * at + i] = weights[4 * blocks + (size_t)i] = takeWeight(bytes, seed);
      }
      blocks++;
      counts[o]++;
    }
  }
  layer->blockCounts = counts;
  layer->blockSkips = exactCopy(skips, blocks);
  layer->weights = exactCopy(weights, 4 * blocks);
  free(skips);
  free(weights);
}

/** Gives a layer whose shape is set weights and constants. */
static inline void takeWeights(bytes_t *bytes, made_t *made, uint32_t *seed) {
  layerInt8_t *layer = &made->layer;
  if (layer->kind == LAYER_MAX_POOL) {
    return;
  }
  const bool conv = isConvLayer(layer);
  made->inputs = conv ? layer->kernelRows * layer->kernelColumns * layer->inChannels : sizeIn(layer);
  made->dense = rubbish((size_t)(layer->outChannels * made->inputs), 0);
  takeConstants(bytes, layer);
  if (isSparse(layer)) {
    takeBlocks(bytes, made, seed);
    return;
  }
  const int32_t row = conv ? (made->inputs + 3) & ~3 : made->inputs;
  int8_t *weights = rubbish((size_t)(layer->outChannels * row), 0);
  for (int32_t o = 0; o < layer->outChannels; o++) {
    for (int32_t i = 0; i < made->inputs; i++) {
      weights[o * row + i] = made->dense[o * made->inputs + i] = takeWeight(bytes, seed);
    }
  }
  layer->weights = weights;
}

static inline void freeLayer(made_t *made) {
  free(made->dense);
  free((void *)made->layer.weights);
  free((void *)made->layer.bias);
  free((void *)made->layer.multiplier);
  free((void *)made->layer.shift);
  free((void *)made->layer.blockCounts);
  free((void *)made->layer.blockSkips);
  *made = (made_t){.inputs = 0};
}

/** The output of one dot product: `made->inputs` values from `at`, which says where value i lies. */
static inline int8_t defineOutput(const made_t *made, int32_t channel, const int8_t *values) {
  const layerInt8_t *layer = &made->layer;
  int64_t sum = layer->bias[channel];
  for (int32_t i = 0; i < made->inputs; i++) {
    sum += (int64_t)values[i] * made->dense[channel * made->inputs + i];
  }
  const int32_t value =
      gemmlowp((int32_t)sum, layer->multiplier[channel], layer->shift[channel]) + layer->outputZeroPoint;
  return (int8_t)(value < layer->outputMin ? layer->outputMin : (value > layer->outputMax ? layer->outputMax : value));
}

/** What the layer must make of an input. */
static inline void defineLayer(const made_t *made, const int8_t *input, int8_t *output) {
  const layerInt8_t *layer = &made->layer;
  const bool dense = !isConvLayer(layer) && layer->kind != LAYER_MAX_POOL;
  for (int32_t i = 0; i < sizeOut(layer); i++) {
    const int32_t channel = i % layer->outChannels, place = i / layer->outChannels;
    const int32_t row = place / layer->outColumns, column = place % layer->outColumns;
    const int32_t step = layer->kind == LAYER_MAX_POOL ? layer->kernelRows : 1;
    const int32_t across = layer->kind == LAYER_MAX_POOL ? layer->kernelColumns : 1;
    int8_t patch[MADE_VALUES], most = -128;
    int32_t count = 0;
    for (int32_t r = 0; r < layer->kernelRows && !dense; r++) {
      for (int32_t c = 0; c < layer->kernelColumns; c++) {
        for (int32_t k = 0; k < layer->inChannels; k++) {
          patch[count] = input[((row * step + r) * layer->inColumns + column * across + c) * layer->inChannels + k];
          most = k == channel && patch[count] > most ? patch[count] : most;
          count++;
        }
      }
    }
    output[i] = layer->kind == LAYER_MAX_POOL ? most : defineOutput(made, channel, dense ? input : patch);
  }
}

/** A convolution, pool or dense layer over the given input; false where none of the wanted kind fits. */
static inline bool takeLayer(bytes_t *bytes, made_t *made, int32_t rows, int32_t columns, int32_t channels,
                             uint32_t *seed) {
  layerInt8_t *layer = &made->layer;
  const int32_t kind = takeByte(bytes) % 5;
  *made = (made_t){.layer = {.kind = kind,
                             .inRows = rows,
                             .inColumns = columns,
                             .inChannels = channels,
                             .kernelRows = 1,
                             .kernelColumns = 1,
                             .outRows = 1,
                             .outColumns = 1,
                             .outChannels = 1 + takeByte(bytes) % MADE_OUTPUTS}};
  if (isConvLayer(layer) || kind == LAYER_MAX_POOL) {
    layer->kernelRows = 1 + takeByte(bytes) % (rows < 6 ? rows : 6);
    layer->kernelColumns = 1 + takeByte(bytes) % (columns < 3 ? columns : 3);
    const bool pool = kind == LAYER_MAX_POOL;
    layer->outRows = pool ? rows / layer->kernelRows : rows - layer->kernelRows + 1;
    layer->outColumns = pool ? columns / layer->kernelColumns : columns - layer->kernelColumns + 1;
    layer->outChannels = pool ? channels : layer->outChannels;
  }
  const int32_t filter = layer->kernelRows * layer->kernelColumns * channels;
  if ((isConvLayer(layer) && filter > CONV_MAX_FILTER) || (kind == LAYER_SPARSE_CONV && filter % 4 != 0) ||
      (kind == LAYER_SPARSE_DENSE && sizeIn(layer) % 4 != 0) || sizeOut(layer) > MADE_VALUES) {
    return false;
  }
  takeWeights(bytes, made, seed);
  return true;
}
