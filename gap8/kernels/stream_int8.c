#include "stream_int8.h"

#include <stddef.h>
#include <string.h>

#include "dense_int8.h"
#include "sparse_dense_int8.h"

static int32_t ringRows(const streamConv_t *conv) { return (conv->layer.inRows - 1) * conv->dilation + 1; }

static int32_t patchBytes(const layerInt8_t *layer) { return alignedBytes(layer->inRows * layer->inChannels); }

/** The widest of what the patch holds: the taps of a conv, then the head's output. */
static int32_t widestPatch(const streamInt8_t *network) {
  int32_t widest = alignedBytes(network->head->outChannels);
  for (int32_t i = 0; i < network->convCount; i++) {
    const int32_t bytes = patchBytes(&network->convs[i].layer);
    widest = bytes > widest ? bytes : widest;
  }
  return widest;
}

/** What the head reads; a conv that it does not read writes its row there first. */
static int32_t skipBytes(const streamInt8_t *network) {
  int32_t widest = network->head->inRows * network->head->inChannels;
  for (int32_t i = 0; i < network->firstSkip; i++) {
    const int32_t channels = network->convs[i].layer.outChannels;
    widest = channels > widest ? channels : widest;
  }
  return alignedBytes(widest);
}

int32_t streamInt8ArenaBytes(const streamInt8_t *network) {
  int32_t bytes = widestPatch(network) + skipBytes(network);
  for (int32_t i = 0; i < network->convCount; i++) {
    const streamConv_t *conv = &network->convs[i];
    bytes += alignedBytes(ringRows(conv) * conv->layer.inChannels);
  }
  return bytes;
}

static bool layerFits(const layerInt8_t *layer) {
  if (!shapeFits(layer->inRows, 1, layer->inChannels) || !shapeFits(1, 1, layer->outChannels)) {
    return false;
  }
  const bool dense =
      layer->kind == LAYER_DENSE || (layer->kind == LAYER_SPARSE_DENSE && layer->inRows * layer->inChannels % 4 == 0);
  return dense && layer->inColumns == 1 && layer->outRows == 1 && layer->outColumns == 1;
}

int32_t streamInt8Check(const streamInt8_t *network) {
  if (network->convCount < 1 || network->convCount > STREAM_MAX_CONVS || network->stride < 1) {
    return 0;
  }
  int32_t skipped = 0;
  int64_t window = network->stride;  // streamInt8Window, and as many samples as its last row may lie back
  for (int32_t i = 0; i < network->convCount; i++) {
    const streamConv_t *conv = &network->convs[i];
    const bool follows = i == 0 || conv->layer.inChannels == network->convs[i - 1].layer.outChannels;
    if (!layerFits(&conv->layer) || !follows || conv->dilation < 1 || (i == 0 && conv->dilation != 1) ||
        !shapeFits(conv->layer.inRows, conv->dilation, conv->layer.inChannels)) {
      return i;
    }
    window += (int64_t)(i == 0 ? 1 : network->stride) * (ringRows(conv) - 1);
    if (window > 65535) {  // what a uint16_t holds
      return i;
    }
    skipped += i >= network->firstSkip ? conv->layer.outChannels : 0;
  }
  const bool from = network->firstSkip >= 0 && network->firstSkip < network->convCount;
  const bool fits = layerFits(network->head) && network->head->inRows * network->head->inChannels == skipped;
  return fits && from ? -1 : network->convCount;
}

void streamInt8Reset(const streamInt8_t *network, streamState_t *state, int8_t *arena) {
  *state = (streamState_t){.patch = arena, .skips = arena + widestPatch(network)};
  int8_t *place = state->skips + skipBytes(network);
  for (int32_t i = 0; i < network->convCount; i++) {
    const streamConv_t *conv = &network->convs[i];
    const int32_t bytes = ringRows(conv) * conv->layer.inChannels;
    state->rings[i] = place;
    memset(place, conv->zeroPoint, (size_t)bytes);
    place += alignedBytes(bytes);
  }
}

static void push(const streamConv_t *conv, streamState_t *state, int32_t i, const int8_t *row) {
  const int32_t next = state->newest[i] + 1;
  state->newest[i] = next < ringRows(conv) ? next : 0;
  memcpy(state->rings[i] + state->newest[i] * conv->layer.inChannels, row, (size_t)conv->layer.inChannels);
}

/**
 * The taps of conv i, oldest first, into the patch. The oldest is the row after the
 * newest, since the ring is as long as the conv looks back.
 */
static void gather(const streamConv_t *conv, streamState_t *state, int32_t i) {
  const int32_t rows = ringRows(conv);
  const int32_t channels = conv->layer.inChannels;
  int32_t row = state->newest[i] + 1;
  int8_t *patch = state->patch;
  for (int32_t tap = 0; tap < conv->layer.inRows; tap++, patch += channels, row += conv->dilation) {
    row = row >= rows ? row - rows : row;
    memcpy(patch, state->rings[i] + row * channels, (size_t)channels);
  }
}

static void run(const layerInt8_t *layer, const int8_t *input, int8_t *output) {
  const jobInt8_t job = {.layer = layer, .input = input, .output = output, .core = 0, .cores = 1};
  if (layer->kind == LAYER_DENSE) {
    denseInt8(&job);
  } else {
    sparseDenseInt8(&job);
  }
}

const int8_t *streamInt8Step(const streamInt8_t *network, streamState_t *state, const int8_t *sample) {
  push(&network->convs[0], state, 0, sample);
  if (state->phase > 0) {
    state->phase--;
    return NULL;
  }
  state->phase = network->stride - 1;
  int8_t *skip = state->skips;
  for (int32_t i = 0; i < network->convCount; i++) {
    const streamConv_t *conv = &network->convs[i];
    gather(conv, state, i);
    run(&conv->layer, state->patch, skip);  // the place is overwritten where the head does not read it
    if (i + 1 < network->convCount) {
      push(&network->convs[i + 1], state, i + 1, skip);
    }
    skip += i >= network->firstSkip ? conv->layer.outChannels : 0;
  }
  run(network->head, state->skips, state->patch);
  return state->patch;
}
