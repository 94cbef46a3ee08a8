// Desktop only: whole flights through the streaming network of gap8/kernels in one call.
// Read by cffi, so nothing but declarations here.
#pragma once

#include "network_batch.h"

// layers: the convs, one after the other, then the head; each as a dense layer.
typedef struct {
  const flatNetworkInt8_t *layers;
  const int32_t *dilations;   // one for each conv
  const int32_t *zeroPoints;  // of each conv's input
  int32_t stride;
  int32_t firstSkip;
} flatStreamInt8_t;

// Bytes of arena; -1 - i where layer i does not fit its neighbours, its weights or this build.
int32_t streamInt8BatchArena(const flatStreamInt8_t *flat);

// A flight: samples rows of quantised input; outputs: one row of the head for every stride-th sample,
// the first one included. Starts from a past of zeros.
void streamInt8Flight(const flatStreamInt8_t *flat, const int8_t *inputs, int32_t samples, int8_t *arena,
                      int8_t *outputs);
