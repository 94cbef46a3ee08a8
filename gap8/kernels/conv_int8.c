#include "conv_int8.h"

#include <string.h>

#include "dot_int8.h"
#include "requantise.h"

enum { LANES = 4 };  // positions at a time

// What does not change from block to block.
typedef struct {
  const layerInt8_t *layer;
  const int8_t *input;
  int8_t *output;
  int32_t filter;      // values of one filter
  int32_t area;        // positions that become one output: 1, 2 or 4
  int32_t poolRows;    // the same as rows x columns
  int32_t poolColumns;
  int32_t outputs;     // places in the output, all channels of one counting once
  int32_t outColumns;
  outputRange_t range;
} convPlan_t;

int32_t convCanPool(const layerInt8_t *pool) {
  const int32_t area = pool->kernelRows * pool->kernelColumns;
  return pool->kind == LAYER_MAX_POOL && (area == 2 || area == 4);
}

static convPlan_t plan(const jobInt8_t *job) {
  const layerInt8_t *layer = job->layer;
  const layerInt8_t *last = job->pool ? job->pool : layer;
  const int32_t poolRows = job->pool ? job->pool->kernelRows : 1;
  const int32_t poolColumns = job->pool ? job->pool->kernelColumns : 1;
  return (convPlan_t){.layer = layer, .input = job->input, .output = job->output,
                      .filter = layer->kernelRows * layer->kernelColumns * layer->inChannels,
                      .area = poolRows * poolColumns, .poolRows = poolRows, .poolColumns = poolColumns,
                      .outputs = last->outRows * last->outColumns, .outColumns = last->outColumns,
                      .range = outputRange(layer)};
}

// One patch: kernelRows pieces of the input, one after the other, then zeros up to a multiple of four.
static void copyPatch(const convPlan_t *p, const int8_t *from, int8_t *to) {
  const layerInt8_t *layer = p->layer;
  const int32_t span = layer->kernelColumns * layer->inChannels;
  const int32_t rowStride = layer->inColumns * layer->inChannels;
  for (int32_t row = 0; row < layer->kernelRows; row++, from += rowStride, to += span) {
    if (layer->inChannels % 4 == 0) {
      for (int32_t i = 0; i < span; i += 4) {
        memcpy(__builtin_assume_aligned(to + i, 4), __builtin_assume_aligned(from + i, 4), 4);
      }
    } else {
      for (int32_t i = 0; i < span; i++) {
        to[i] = from[i];
      }
    }
  }
  for (int32_t i = p->filter; i % 4 != 0; i++) {
    *to++ = 0;
  }
}

// The patches of the outputs from `first` on, `area` for each; the last output repeated where there are no more.
static void gather(const convPlan_t *p, int32_t first, int32_t lanes, int8_t *patches) {
  const layerInt8_t *layer = p->layer;
  int32_t lane = 0;
  for (int32_t place = first; lane < lanes; place++) {
    const int32_t at = place < p->outputs ? place : p->outputs - 1;
    const int32_t row = at / p->outColumns * p->poolRows;
    const int32_t column = at % p->outColumns * p->poolColumns;
    for (int32_t i = 0; i < p->poolRows; i++) {
      for (int32_t j = 0; j < p->poolColumns && lane < lanes; j++, lane++) {
        const int32_t position = (row + i) * layer->inColumns + column + j;
        copyPatch(p, p->input + position * layer->inChannels, patches + lane * CONV_MAX_FILTER);
      }
    }
  }
}

// The outputs of one channel from the sums of its lanes.
ALWAYS_INLINE void write(const convPlan_t *p, int32_t first, int32_t channel, int32_t lanes, int32_t s0, int32_t s1,
                         int32_t s2, int32_t s3) {
  const int32_t channels = p->layer->outChannels;
  const int32_t multiplier = p->layer->multiplier[channel], shift = p->layer->shift[channel];
  const int32_t left = p->outputs - first;
  const outputRange_t range = p->range;
  int8_t *to = p->output + first * channels + channel;
  if (p->area == 1) {
    to[0] = requantise(s0, multiplier, shift, range);
    if (lanes > 1 && left > 1) {
      to[channels] = requantise(s1, multiplier, shift, range);
    }
    if (lanes > 2 && left > 2) {
      to[2 * channels] = requantise(s2, multiplier, shift, range);
    }
    if (lanes > 3 && left > 3) {
      to[3 * channels] = requantise(s3, multiplier, shift, range);
    }
    return;
  }
  const int32_t one = s0 > s1 ? s0 : s1;
  const int32_t two = s2 > s3 ? s2 : s3;
  if (p->area == 4) {
    to[0] = requantise(one > two ? one : two, multiplier, shift, range);
    return;
  }
  to[0] = requantise(one, multiplier, shift, range);
  if (lanes > 2 && left > 1) {
    to[channels] = requantise(two, multiplier, shift, range);
  }
}

// A unit of each lane's inputs times a unit of two channels' weights.
#define MULTIPLY_LANES(wa, wb)                                \
  do {                                                        \
    const int32_t x0 = loadUnit(x);                           \
    a0 = multiplyAdd(x0, wa, a0);                             \
    b0 = multiplyAdd(x0, wb, b0);                             \
    const int32_t x1 = loadUnit(x + CONV_MAX_FILTER);         \
    a1 = multiplyAdd(x1, wa, a1);                             \
    b1 = multiplyAdd(x1, wb, b1);                             \
    if (lanes > 2) {                                          \
      const int32_t x2 = loadUnit(x + 2 * CONV_MAX_FILTER);   \
      a2 = multiplyAdd(x2, wa, a2);                           \
      b2 = multiplyAdd(x2, wb, b2);                           \
    }                                                         \
    if (lanes > 3) {                                          \
      const int32_t x3 = loadUnit(x + 3 * CONV_MAX_FILTER);   \
      a3 = multiplyAdd(x3, wa, a3);                           \
      b3 = multiplyAdd(x3, wb, b3);                           \
    }                                                         \
  } while (0)

// Two channels of all lanes. `lanes` is a constant at each call, so that the sums live in registers.
ALWAYS_INLINE void twoChannels(const convPlan_t *p, const int8_t *x, int32_t first, int32_t channel, int32_t lanes) {
  const layerInt8_t *layer = p->layer;
  const int32_t other = channel + 1 < layer->outChannels ? channel + 1 : channel;
  const int8_t *a = layer->weights + channel * p->filter;
  const int8_t *b = layer->weights + other * p->filter;
  int32_t a0 = layer->bias[channel], a1 = a0, a2 = a0, a3 = a0;
  int32_t b0 = layer->bias[other], b1 = b0, b2 = b0, b3 = b0;
  for (int32_t units = p->filter / UNIT; units > 0; units--, x += UNIT, a += UNIT, b += UNIT) {
    const int32_t wa = loadUnit(a), wb = loadUnit(b);
    MULTIPLY_LANES(wa, wb);
  }
  if (p->filter % UNIT > 0) {
    const int32_t wa = loadLast(a, p->filter % UNIT), wb = loadLast(b, p->filter % UNIT);
    MULTIPLY_LANES(wa, wb);
  }
  write(p, first, channel, lanes, a0, a1, a2, a3);
  if (other != channel) {
    write(p, first, other, lanes, b0, b1, b2, b3);
  }
}

static void dense4(const convPlan_t *p, const int8_t *patches, int32_t first, int32_t pair, int32_t end) {
  for (; pair < end; pair++) {
    twoChannels(p, patches, first, 2 * pair, 4);
  }
}

static void dense3(const convPlan_t *p, const int8_t *patches, int32_t first, int32_t pair, int32_t end) {
  for (; pair < end; pair++) {
    twoChannels(p, patches, first, 2 * pair, 3);
  }
}

static void dense2(const convPlan_t *p, const int8_t *patches, int32_t first, int32_t pair, int32_t end) {
  for (; pair < end; pair++) {
    twoChannels(p, patches, first, 2 * pair, 2);
  }
}

// Channels of all lanes, sparse weights.
ALWAYS_INLINE void sparseChannels(const convPlan_t *p, const int8_t *patches, int32_t first, int32_t channel,
                                  int32_t end, int32_t lanes) {
  const layerInt8_t *layer = p->layer;
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
        s1 = multiplyAdd(loadUnit(x + i + CONV_MAX_FILTER), w, s1);
        if (lanes > 2) {
          s2 = multiplyAdd(loadUnit(x + i + 2 * CONV_MAX_FILTER), w, s2);
        }
        if (lanes > 3) {
          s3 = multiplyAdd(loadUnit(x + i + 3 * CONV_MAX_FILTER), w, s3);
        }
      }
    }
    write(p, first, channel, lanes, s0, s1, s2, s3);
  }
}

static void sparse4(const convPlan_t *p, const int8_t *patches, int32_t first, int32_t channel, int32_t end) {
  sparseChannels(p, patches, first, channel, end, 4);
}

static void sparse3(const convPlan_t *p, const int8_t *patches, int32_t first, int32_t channel, int32_t end) {
  sparseChannels(p, patches, first, channel, end, 3);
}

static void sparse2(const convPlan_t *p, const int8_t *patches, int32_t first, int32_t channel, int32_t end) {
  sparseChannels(p, patches, first, channel, end, 2);
}

void convInt8(const jobInt8_t *job) {
  static void (*const blockOf[2][3])(const convPlan_t *, const int8_t *, int32_t, int32_t, int32_t) = {
      {dense2, dense3, dense4}, {sparse2, sparse3, sparse4}};
  _Alignas(4) int8_t patches[LANES * CONV_MAX_FILTER];
  const convPlan_t p = plan(job);
  const int32_t sparse = p.layer->kind == LAYER_SPARSE_CONV;
  const int32_t units = sparse ? p.layer->outChannels : (p.layer->outChannels + 1) / 2;  // channels or pairs
  const int32_t places = LANES / p.area;                                                // outputs of a block
  const int32_t items = (p.outputs + places - 1) / places * units;
  const int32_t end = shareBegin(items, job->core + 1, job->cores);
  int32_t item = shareBegin(items, job->core, job->cores);
  while (item < end) {
    const int32_t first = item / units * places;
    const int32_t unit = item % units;
    const int32_t here = end - item < units - unit ? end - item : units - unit;
    const int32_t used = (p.outputs - first < places ? p.outputs - first : places) * p.area;
    const int32_t lanes = used < 2 ? 2 : used;
    gather(&p, first, lanes, patches);
    blockOf[sparse][lanes - 2](&p, patches, first, unit, unit + here);
    item += here;
  }
}
