#include "gap8_core.h"

#include <string.h>

#include "feature_window.h"
#include "stream_window.h"

static void resetStream(void *context) {
  gap8Stream_t *stream = context;
  streamInt8Reset(stream->network, &stream->state, stream->arena);
}

static bool stepStream(void *context, const uint8_t sample[EDGE_LINK_SAMPLE_BYTES],
                       int8_t output[EDGE_LINK_OUTPUTS]) {
  gap8Stream_t *stream = context;
  const int8_t *logits = streamInt8Step(stream->network, &stream->state, (const int8_t *)sample);
  if (logits == NULL) {
    return false;
  }
  memcpy(output, logits, EDGE_LINK_OUTPUTS);
  return true;
}

static void resetWindow(void *context) {
  gap8Window_t *window = context;
  window->rows = 0;
  window->oldest = 0;
}

/** One column of the window, oldest row first, normalised by itself. */
static void normaliseColumn(gap8Window_t *window, int32_t c) {
  float *column = window->column[c];
  int32_t row = window->oldest;
  for (int32_t i = 0; i < AIRTOUCH_MODEL_ROWS; i++) {
    column[i] = window->ring[row * AIRTOUCH_MODEL_COLUMNS + c];
    row = row + 1 < AIRTOUCH_MODEL_ROWS ? row + 1 : 0;
  }
  zScoreWindow(column, AIRTOUCH_MODEL_ROWS, 1, column);
  for (int32_t i = 0; i < AIRTOUCH_MODEL_ROWS; i++) {
    window->window[i * AIRTOUCH_MODEL_COLUMNS + c] = column[i];
  }
}

static void meet(const teamInt8_t *team) {
  if (team->cores > 1) {
    team->barrier(team->context);
  }
}

/** One core's part: columns, then values, then what it has of each layer. */
static void shareWindow(gap8Window_t *window, const teamInt8_t *mine) {
  for (int32_t c = mine->core; c < AIRTOUCH_MODEL_COLUMNS; c += mine->cores) {
    normaliseColumn(window, c);
  }
  meet(mine);
  const int32_t begin = shareBegin(GAP8_VALUES, mine->core, mine->cores);
  const int32_t end = shareBegin(GAP8_VALUES, mine->core + 1, mine->cores);
  networkInt8Quantise(window->network, window->window + begin, end - begin, window->quantised + begin);
  meet(mine);
  const int8_t *logits = networkInt8RunTeam(window->network, window->quantised, window->arena, mine);
  if (mine->core == 0) {
    window->logits = logits;
  }
}

static void workOnWindow(void *argument) {
  gap8Window_t *window = argument;
  const gap8Team_t *team = window->team;
  const teamInt8_t mine = {.core = team->core(), .cores = team->cores, .barrier = team->barrier};
  shareWindow(window, &mine);
}

static void runWindow(gap8Window_t *window) {
  if (window->team != NULL) {
    window->team->fork(workOnWindow, window);
  } else {
    const teamInt8_t alone = {.core = 0, .cores = 1};
    shareWindow(window, &alone);
  }
}

static bool stepWindow(void *context, const uint8_t sample[EDGE_LINK_SAMPLE_BYTES],
                       int8_t output[EDGE_LINK_OUTPUTS]) {
  gap8Window_t *window = context;
  const int32_t columns = AIRTOUCH_MODEL_COLUMNS;
  memcpy(window->ring + window->oldest * columns, sample, EDGE_LINK_SAMPLE_BYTES);  // little endian at both ends
  window->oldest = window->oldest + 1 < AIRTOUCH_MODEL_ROWS ? window->oldest + 1 : 0;
  window->rows += window->rows < AIRTOUCH_MODEL_ROWS ? 1 : 0;
  if (window->rows < AIRTOUCH_MODEL_ROWS) {
    return false;
  }
  runWindow(window);
  memcpy(output, window->logits, AIRTOUCH_MODEL_OUTPUTS);
  return true;
}

void gap8CoreInit(gap8Core_t *core, const streamInt8_t *stream, const networkInt8_t *window, const gap8Team_t *team) {
  memset(core, 0, sizeof *core);
  core->window.team = team;
  core->stream.network = stream;
  core->window.network = window;
  core->networks[0] = (linkNetwork_t){.context = &core->stream,
                                      .reset = resetStream,
                                      .step = stepStream,
                                      .window = streamWindow(stream),
                                      .stride = (uint16_t)stream->stride,
                                      .algorithm = EDGE_LINK_BEST};
  core->networks[1] = (linkNetwork_t){.context = &core->window,
                                      .reset = resetWindow,
                                      .step = stepWindow,
                                      .window = AIRTOUCH_MODEL_ROWS,
                                      .stride = 1,
                                      .algorithm = EDGE_LINK_PAPER};
  edgeLinkDigest(AIRTOUCH_STREAM_SHA256, core->networks[0].digest);
  edgeLinkDigest(AIRTOUCH_MODEL_SHA256, core->networks[1].digest);
  resetStream(&core->stream);
  linkReceiverInit(&core->receiver, core->networks, GAP8_NETWORKS);
}

uint16_t gap8CoreTake(gap8Core_t *core, const uint8_t *bytes, uint16_t length, uint8_t *reply) {
  return linkReceiverTake(&core->receiver, bytes, length, reply);
}

uint16_t gap8CoreHeartbeat(gap8Core_t *core, uint32_t uptimeMs, uint8_t *bytes) {
  return linkReceiverHeartbeat(&core->receiver, uptimeMs, bytes);
}
