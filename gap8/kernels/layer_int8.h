/**
 * @file layer_int8.h
 * One layer of an int8 network, and the shapes that every kernel here shares.
 *
 * Activations lie as rows, columns, channels (HWC), channels innermost.
 * r = scale * (q - zero point); weights are symmetric (zero point 0), one scale
 * per output channel, in [-127, 127]. The zero point of the input is folded into
 * the bias by whoever makes the layer:
 *   bias'[o] = bias[o] - inputZeroPoint * sum(weights of o)
 * so that the inner loops are plain dot products of int8.
 *
 * A sparse layer keeps its weights as blocks of four neighbouring inputs and uses them
 * where they lie. For each output channel, blockCounts says how many blocks it has; for
 * each block, blockSkips says how many blocks of four inputs to pass over before it (a gap
 * of more than 255 is bridged by blocks of zero weights), and weights holds its four
 * values. Five bytes a block, nothing to unpack.
 *
 * Target: C11, any processor.
 * Threads: constants: any number of readers.
 * Memory: the arrays are the caller's, usually in flash.
 * Cost: none.
 */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef enum {
  LAYER_CONV = 0,          ///< convInt8: stride 1, no padding
  LAYER_MAX_POOL = 1,      ///< maxPoolInt8: stride = kernel, no padding, remainder dropped
  LAYER_DENSE = 2,         ///< denseInt8: input taken as one vector
  LAYER_SPARSE_DENSE = 3,  ///< sparseDenseInt8: the same with sparse weights
  LAYER_SPARSE_CONV = 4,   ///< convInt8 with sparse weights, blocks within a filter's row, column, channel order
} layerKind_t;

typedef struct {
  int32_t kind;  ///< a layerKind_t
  int32_t inRows;
  int32_t inColumns;
  int32_t inChannels;
  int32_t outRows;
  int32_t outColumns;
  int32_t outChannels;
  int32_t kernelRows;     ///< conv, pool; else 1
  int32_t kernelColumns;  ///< conv, pool; else 1
  int32_t outputZeroPoint;
  int32_t outputMin;  ///< clamp of the output; a ReLU is outputMin = outputZeroPoint
  int32_t outputMax;
  const int8_t *weights;        ///< aligned to 4; dense: [out][in]; sparse: [block][4]; conv: [out][row][column][in],
                                ///< the values of each output followed by zeros up to a multiple of four
  const int32_t *bias;          ///< [out], input zero point folded in
  const int32_t *multiplier;    ///< [out], Q31 mantissa of inputScale * weightScale / outputScale
  const int8_t *shift;          ///< [out], its exponent: positive is a shift to the left
  const uint16_t *blockCounts;  ///< sparse: blocks of each output channel
  const uint8_t *blockSkips;    ///< sparse: blocks of four inputs to skip before each block
} layerInt8_t;

// Initialisers of the tables that `airtouch export` writes.
#define LAYER_IN(rows, columns, channels) .inRows = (rows), .inColumns = (columns), .inChannels = (channels)
#define LAYER_OUT(rows, columns, channels) .outRows = (rows), .outColumns = (columns), .outChannels = (channels)
#define LAYER_KERNEL(rows, columns) .kernelRows = (rows), .kernelColumns = (columns)
#define LAYER_RANGE(zeroPoint, least, most) .outputZeroPoint = (zeroPoint), .outputMin = (least), .outputMax = (most)
#define LAYER_DENSE_ARRAYS(name) \
  .weights = name##Weights, .bias = name##Bias, .multiplier = name##Multiplier, .shift = name##Shift
#define LAYER_SPARSE_ARRAYS(name) \
  LAYER_DENSE_ARRAYS(name), .blockCounts = name##BlockCounts, .blockSkips = name##BlockSkips

enum { LAYER_MAX_VALUES = 1 << 16 };  // of a layer's input or output: all that the cluster's L1 holds

/** Whether a shape has values, and no more than there can be: its size may be computed then. */
static inline bool shapeFits(int32_t rows, int32_t columns, int32_t channels) {
  return rows >= 1 && columns >= 1 && channels >= 1 && rows <= LAYER_MAX_VALUES && columns <= LAYER_MAX_VALUES / rows &&
         channels <= LAYER_MAX_VALUES / (rows * columns);
}

/** Room of so many bytes in an arena, where each tensor is aligned to 4. */
static inline int32_t alignedBytes(int32_t bytes) { return (bytes + 3) & ~3; }

/** Weights of a layer that keeps all of them; 0 for the other kinds. Where shapes are not checked yet, so is this. */
static inline int32_t layerWeights(const layerInt8_t *layer) {
  switch (layer->kind) {
    case LAYER_CONV:  // each filter is filled up to a multiple of four
      return layer->outChannels * ((layer->kernelRows * layer->kernelColumns * layer->inChannels + 3) / 4 * 4);
    case LAYER_DENSE: return layer->outChannels * layer->inRows * layer->inColumns * layer->inChannels;
    default: return 0;
  }
}

#ifdef __cplusplus
}
#endif
