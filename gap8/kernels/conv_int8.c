#include "conv_int8.h"

#include <string.h>

#include "dot_int8.h"
#include "requantise.h"

enum { LANES = 4 };  // positions at a time

/** What does not change from block to block. */
typedef struct {
  const layerInt8_t *layer;
  const int8_t *input;
  int8_t *output;
  outputRange_t range;
  int32_t filter;     // values of one filter, rounded up to a multiple of four
  int32_t span;       // of them in one row
  int32_t rowStride;  // from a row of the input to the next
  int32_t area;       // positions that become one output: 1 or 2
  int32_t next;       // from the first of two such positions to the second, in the input
  int32_t poolRows;   // the same positions as rows x columns
  int32_t poolColumns;
  int32_t outputs;  // places in the output, all channels of one counting once
  int32_t outColumns;
} convPlan_t;

/** A place in the output, and where its positions begin. */
typedef struct {
  int32_t place;
  int32_t row;
  int32_t column;
} convPlace_t;

bool convCanPool(const layerInt8_t *pool) {
  return pool->kind == LAYER_MAX_POOL && pool->kernelRows * pool->kernelColumns == 2;
}

static convPlan_t plan(const jobInt8_t *job) {
  const layerInt8_t *layer = job->layer;
  const layerInt8_t *last = job->pool ? job->pool : layer;
  const int32_t poolRows = job->pool ? job->pool->kernelRows : 1;
  const int32_t poolColumns = job->pool ? job->pool->kernelColumns : 1;
  const int32_t rowStride = layer->inColumns * layer->inChannels;
  return (convPlan_t){.layer = layer,
                      .input = job->input,
                      .output = job->output,
                      .range = outputRange(layer),
                      .filter = (layer->kernelRows * layer->kernelColumns * layer->inChannels + 3) & ~3,
                      .span = layer->kernelColumns * layer->inChannels,
                      .rowStride = rowStride,
                      .next = poolRows > 1 ? rowStride : layer->inChannels,
                      .area = poolRows * poolColumns,
                      .poolRows = poolRows,
                      .poolColumns = poolColumns,
                      .outputs = last->outRows * last->outColumns,
                      .outColumns = last->outColumns};
}

enum { PIECE = 16 };  // bytes that are copied at once

/** One patch: pieces of rows of the input, one after the other, each a multiple of four bytes. */
static void copyWords(const int8_t *from, int8_t *to, int32_t rows, int32_t span, int32_t rowStride) {
  for (; rows > 0; rows--, from += rowStride - span) {
    int32_t left = span;
    for (; left >= PIECE; left -= PIECE, from += PIECE, to += PIECE) {
      memcpy(ALIGNED_4(to), ALIGNED_4(from), PIECE);
    }
    for (; left > 0; left -= 4, from += 4, to += 4) {
      memcpy(ALIGNED_4(to), ALIGNED_4(from), 4);
    }
  }
}

/** The same for pieces of one byte. */
static void copySingles(const int8_t *from, int8_t *to, int32_t rows, int32_t rowStride) {
  do {
    *to++ = *from;
    from += rowStride;
  } while (--rows > 0);
}

/** The same for pieces of any length. */
static void copyBytes(const int8_t *from, int8_t *to, int32_t rows, int32_t span, int32_t rowStride) {
  for (; rows > 0; rows--, from += rowStride) {
    for (int32_t i = 0; i < span; i++) {
      *to++ = from[i];
    }
  }
}

/** The patches of `count` outputs from `at` on, `area` for each; `at` then stands behind them. */
static void gather(const convPlan_t *p, convPlace_t *at, int32_t count, int8_t *patches) {
  const layerInt8_t *layer = p->layer;
  const bool words = layer->inChannels % 4 == 0;
  const int32_t rows = layer->kernelRows;
  for (; count > 0; count--, at->place++) {
    const int8_t *from = p->input + at->row * p->rowStride + at->column * layer->inChannels;
    for (int32_t i = p->area; i > 0; i--, from += p->next, patches += CONV_MAX_FILTER) {
      if (words) {
        copyWords(from, patches, rows, p->span, p->rowStride);
      } else if (p->span == 1) {
        copySingles(from, patches, rows, p->rowStride);
      } else {
        copyBytes(from, patches, rows, p->span, p->rowStride);
      }
    }
    at->column += p->poolColumns;
    if (at->column == p->outColumns * p->poolColumns) {
      at->column = 0;
      at->row += p->poolRows;
    }
  }
}

/** The outputs of one channel from the sums of its lanes: one each, or one for two. */
ALWAYS_INLINE void writeLanes(int8_t *to, int32_t channels, requantiser_t r, int32_t lanes, int32_t area, int32_t s0,
                              int32_t s1, int32_t s2, int32_t s3) {
  if (area == 2) {
    to[0] = requantise(r, s0 > s1 ? s0 : s1);
    if (lanes > 2) {
      to[channels] = requantise(r, s2 > s3 ? s2 : s3);
    }
    return;
  }
  to[0] = requantise(r, s0);
  if (lanes > 1) {
    to[channels] = requantise(r, s1);
  }
  if (lanes > 2) {
    to[2 * channels] = requantise(r, s2);
  }
  if (lanes > 3) {
    to[3 * channels] = requantise(r, s3);
  }
}

/**
 * Pairs of channels of all lanes, sums in registers: lanes and area are constants at each call.
 * A last channel without a partner is done twice.
 */
ALWAYS_INLINE void densePairs(const convPlan_t *p, const int8_t *patches, int8_t *to, int32_t pair, int32_t end,
                              int32_t lanes, int32_t area) {
  const layerInt8_t layer = *p->layer;  // a copy: the bytes written here might alias it
  const outputRange_t range = p->range;
  const int32_t channels = layer.outChannels, filter = p->filter;
  for (; pair < end; pair++) {
    const int32_t one = 2 * pair;
    const int32_t two = one + 1 < channels ? one + 1 : one;
    const int8_t *x = patches;
    const int8_t *a = layer.weights + one * filter;
    const int8_t *b = layer.weights + two * filter;
    int32_t a0 = layer.bias[one], a1 = a0, a2 = a0, a3 = a0;
    int32_t b0 = layer.bias[two], b1 = b0, b2 = b0, b3 = b0;
    int32_t units = filter / UNIT;
    do {
      const int32_t wa = loadUnit(a), wb = loadUnit(b);
      const int32_t x0 = loadUnit(x);
      a0 = multiplyAdd(x0, wa, a0);
      b0 = multiplyAdd(x0, wb, b0);
      if (lanes > 1) {
        const int32_t x1 = loadUnit(x + CONV_MAX_FILTER);
        a1 = multiplyAdd(x1, wa, a1);
        b1 = multiplyAdd(x1, wb, b1);
      }
      if (lanes > 2) {
        const int32_t x2 = loadUnit(x + 2 * CONV_MAX_FILTER);
        a2 = multiplyAdd(x2, wa, a2);
        b2 = multiplyAdd(x2, wb, b2);
      }
      if (lanes > 3) {
        const int32_t x3 = loadUnit(x + 3 * CONV_MAX_FILTER);
        a3 = multiplyAdd(x3, wa, a3);
        b3 = multiplyAdd(x3, wb, b3);
      }
      x += UNIT;
      a += UNIT;
      b += UNIT;
    } while (--units > 0);
    writeLanes(to + one, channels, requantiser(&layer, one, range), lanes, area, a0, a1, a2, a3);
    writeLanes(to + two, channels, requantiser(&layer, two, range), lanes, area, b0, b1, b2, b3);
  }
}

/** Channels of all lanes, sparse weights. */
ALWAYS_INLINE void sparseChannels(const convPlan_t *p, const int8_t *patches, int8_t *to, int32_t channel, int32_t end,
                                  int32_t lanes, int32_t area) {
  const layerInt8_t *layer = p->layer;
  const outputRange_t range = p->range;
  const int32_t channels = layer->outChannels;
  const uint8_t *skip = layer->blockSkips;
  for (int32_t before = 0; before < channel; before++) {
    skip += layer->blockCounts[before];
  }
  const int8_t *weights = layer->weights + 4 * (skip - layer->blockSkips);
  for (; channel < end; channel++) {
    int32_t s0 = layer->bias[channel], s1 = s0, s2 = s0, s3 = s0;
    const int8_t *x = patches;
    for (int32_t block = layer->blockCounts[channel]; block > 0; block--, x += 4, weights += 4) {
      x += 4 * (int32_t)*skip++;
      for (int32_t i = 0; i < 4; i += UNIT) {
        const int32_t w = loadUnit(weights + i);
        s0 = multiplyAdd(loadUnit(x + i), w, s0);
        if (lanes > 1) {
          s1 = multiplyAdd(loadUnit(x + i + CONV_MAX_FILTER), w, s1);
        }
        if (lanes > 2) {
          s2 = multiplyAdd(loadUnit(x + i + 2 * CONV_MAX_FILTER), w, s2);
        }
        if (lanes > 3) {
          s3 = multiplyAdd(loadUnit(x + i + 3 * CONV_MAX_FILTER), w, s3);
        }
      }
    }
    writeLanes(to + channel, channels, requantiser(layer, channel, range), lanes, area, s0, s1, s2, s3);
  }
}

/** A block of one to four lanes: its channels, or pairs of them, from `unit` to `end`. */
typedef void block_t(const convPlan_t *p, const int8_t *patches, int8_t *to, int32_t unit, int32_t end);

#define BLOCK(name, inner, lanes, area)                                                                 \
  static void name(const convPlan_t *p, const int8_t *patches, int8_t *to, int32_t unit, int32_t end) { \
    inner(p, patches, to, unit, end, lanes, area);                                                      \
  }

BLOCK(dense1, densePairs, 1, 1)
BLOCK(dense2, densePairs, 2, 1)
BLOCK(dense3, densePairs, 3, 1)
BLOCK(dense4, densePairs, 4, 1)
BLOCK(densePooled2, densePairs, 2, 2)
BLOCK(densePooled4, densePairs, 4, 2)
BLOCK(sparse1, sparseChannels, 1, 1)
BLOCK(sparse2, sparseChannels, 2, 1)
BLOCK(sparse3, sparseChannels, 3, 1)
BLOCK(sparse4, sparseChannels, 4, 1)
BLOCK(sparsePooled2, sparseChannels, 2, 2)
BLOCK(sparsePooled4, sparseChannels, 4, 2)

void convInt8(const jobInt8_t *job) {
  static block_t *const blocks[2][2][LANES] = {// by sparseness, area and outputs of the block
                                               {{dense1, dense2, dense3, dense4}, {densePooled2, densePooled4}},
                                               {{sparse1, sparse2, sparse3, sparse4}, {sparsePooled2, sparsePooled4}}};
  _Alignas(4) int8_t patches[LANES * CONV_MAX_FILTER] = {0};  // what a filter is filled up with stays zero
  const convPlan_t p = plan(job);
  const int32_t channels = p.layer->outChannels;
  const bool sparse = p.layer->kind == LAYER_SPARSE_CONV;
  const int32_t units = sparse ? channels : (channels + 1) / 2;
  const int32_t most = LANES / p.area;  // outputs of a block
  const int32_t items = (p.outputs + most - 1) / most * units;
  const int32_t end = shareBegin(items, job->core + 1, job->cores);
  int32_t item = shareBegin(items, job->core, job->cores);
  int32_t unit = item % units;
  convPlace_t at = {.place = item / units * most};
  at.row = at.place / p.outColumns * p.poolRows;
  at.column = at.place % p.outColumns * p.poolColumns;
  while (item < end) {
    const int32_t here = end - item < units - unit ? end - item : units - unit;
    const int32_t count = p.outputs - at.place < most ? p.outputs - at.place : most;
    int8_t *to = p.output + at.place * channels;
    gather(&p, &at, count, patches);
    // count is at most LANES / area: a pooled block has never more than two, and is there.
    // NOLINTNEXTLINE(clang-analyzer-core.CallAndMessage)
    blocks[sparse][p.area - 1][count - 1](&p, patches, to, unit, unit + here);
    item += here;
    unit = 0;
  }
}
