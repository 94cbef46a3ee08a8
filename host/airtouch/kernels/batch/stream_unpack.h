// A streaming network out of the flat arrays that cffi hands over. Desktop only.
#pragma once

#include "network_unpack.h"
#include "stream_batch.h"
#include "stream_int8.h"

typedef struct {
  layerInt8_t layers[MAX_LAYERS];
  streamConv_t convs[STREAM_MAX_CONVS];
  streamInt8_t network;  // points into the two above
} unpackedStream_t;

// -1, or the first layer that does not fit.
int32_t unpackStream(const flatStreamInt8_t *flat, unpackedStream_t *to);
