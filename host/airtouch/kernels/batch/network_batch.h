// Desktop only: whole flights through the network of gap8/kernels in one call.
// Read by cffi, so nothing but declarations here.
#pragma once

#include <stdint.h>

// A network as the arrays of all its layers, one after the other.
// shapes: layerCount rows of 12: kind, inRows, inColumns, inChannels, outRows, outColumns,
// outChannels, kernelRows, kernelColumns, outputZeroPoint, outputMin, outputMax.
typedef struct {
  int32_t layerCount;
  int32_t weightCount;   // length of weights, checked against the shapes; each layer's padded to 4
  int32_t channelCount;  // length of bias, multiplier and shift
  int32_t blockCount;    // length of blockSkips
  const int32_t *shapes;
  const int8_t *weights;
  const int32_t *bias;
  const int32_t *multiplier;
  const int8_t *shift;
  const uint16_t *blockCounts;  // one for each output channel of the sparse layers
  const uint8_t *blockSkips;
  float inputScale;
  int32_t inputZeroPoint;
} flatNetworkInt8_t;

// As above in float; the last three columns of shapes are relu, unused, unused.
typedef struct {
  int32_t layerCount;
  int32_t weightCount;
  int32_t channelCount;
  const int32_t *shapes;
  const float *weights;
  const float *bias;
} flatNetworkFloat_t;

// Bytes (int8) or floats (float) of arena that the calls below need; -1 - i where layer i
// does not fit its neighbours, its weights or this build.
int32_t networkInt8BatchArena(const flatNetworkInt8_t *flat);
int32_t networkFloatBatchArena(const flatNetworkFloat_t *flat);

// inputs: count rows of quantised input; outputs: count rows of the last layer's output.
void networkInt8Batch(const flatNetworkInt8_t *flat, const int8_t *inputs, int32_t count, int8_t *arena,
                      int8_t *outputs);
void networkFloatBatch(const flatNetworkFloat_t *flat, const float *inputs, int32_t count, float *arena,
                       float *outputs);

// Quantise count values of input.
void networkInt8BatchQuantise(const flatNetworkInt8_t *flat, const float *x, int32_t count, int8_t *q);

// A flight: at each sample the window that ends there, normalised and quantised, through the
// network. features: samples x columns. window: rows * columns floats, quantised: as many bytes, both
// scratch. valid[i] is 0 and outputs[i] untouched where the window is not full or not finite.
void networkInt8Flight(const flatNetworkInt8_t *flat, const float *features, int32_t samples, int32_t columns,
                       int32_t rows, float *window, int8_t *quantised, int8_t *arena, int8_t *outputs, uint8_t *valid);
