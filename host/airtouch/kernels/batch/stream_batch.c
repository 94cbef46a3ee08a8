#include "stream_batch.h"

#include <stddef.h>

#include "stream_unpack.h"

int32_t unpackStream(const flatStreamInt8_t *flat, unpackedStream_t *to) {
  const int32_t wrong = unpackLayersInt8(flat->layers, to->layers);
  const int32_t convs = flat->layers->layerCount - 1;
  if (wrong >= 0 || convs < 1 || convs > STREAM_MAX_CONVS) {
    return wrong >= 0 ? wrong : 0;
  }
  for (int32_t i = 0; i < convs; i++) {
    to->convs[i] =
        (streamConv_t){.layer = to->layers[i], .dilation = flat->dilations[i], .zeroPoint = flat->zeroPoints[i]};
  }
  to->network = (streamInt8_t){.convs = to->convs,
                               .convCount = convs,
                               .stride = flat->stride,
                               .firstSkip = flat->firstSkip,
                               .head = &to->layers[convs]};
  return streamInt8Check(&to->network);
}

int32_t streamInt8BatchArena(const flatStreamInt8_t *flat) {
  unpackedStream_t to;
  const int32_t wrong = unpackStream(flat, &to);
  return wrong < 0 ? streamInt8ArenaBytes(&to.network) : -1 - wrong;
}

void streamInt8Flight(const flatStreamInt8_t *flat, const int8_t *inputs, int32_t samples, int8_t *arena,
                      int8_t *outputs) {
  unpackedStream_t to;
  streamState_t state;
  if (unpackStream(flat, &to) >= 0) {
    return;
  }
  streamInt8Reset(&to.network, &state, arena);
  const int32_t channels = to.convs[0].layer.inChannels;
  for (int32_t t = 0; t < samples; t++) {
    const int8_t *row = streamInt8Step(&to.network, &state, inputs + (int64_t)t * channels);
    for (int32_t o = 0; row != NULL && o < to.network.head->outChannels; o++) {
      *outputs++ = row[o];
    }
  }
}
